"""A run whose work is done by an executor: the tasks of ``outcrop plan``, on whatever runs functions elsewhere."""

from __future__ import annotations

import concurrent.futures
import contextlib
import os
import warnings
from collections.abc import Mapping, Sequence
from typing import Any, Optional, Union

from . import _outcrop
from ._run import (
    LOOK,
    Answer,
    DiskError,
    Error,
    FileError,
    OutcropWarning,
    ParameterError,
    Progress,
    ScratchError,
    announced,
    finished,
    result,
    words,
)

# Attempts at a shard, or at the work between two steps, after which the run is given up.
_TRIES = 8

# The keywords of a whole run that a task has too.
_STORING = ("io", "scratch_compression")


def plan_words(options: Mapping[str, Any], shards: int) -> list[str]:
    """The options of a run as those of its plan: memory and threads are those of each task."""
    planned = {name: value for name, value in options.items() if name not in (*_STORING, "quiet", "report")}
    if planned.pop("time_limit") is not None:
        raise ParameterError("time_limit: with executor= the run is stopped by whoever waits for it; resume=True goes on")
    memory, threads = planned.pop("memory"), planned.pop("threads")
    return words({**planned, "shards": shards, "task_memory": memory, "task_threads": threads})


def share(
    executor: Any, line: Sequence[str], options: Mapping[str, Any], progress: Union[Progress, bool, None]
) -> tuple[Answer, str]:
    """Plans a run, does its work by the executor, and returns its report and the path of the mesh."""
    reports = options["report"]
    if reports is not None and not isinstance(reports, (str, bytes, os.PathLike)):
        reports = list(reports)
        if len(reports) > 1:
            raise ParameterError("report: with executor= there is one report")
        reports = reports[0] if reports else None
    storing = words({name: options[name] for name in _STORING})
    with announced(progress, bool(options["quiet"])) as told:
        # As text: a path of Python has no two slashes, which a URL has.
        folder: str = _json(["plan", *line])["folder"]
        advance = ["advance", "--quiet", *storing, *words({"report": reports}), "--", folder]
        tries, why = 0, ""
        while tries < _TRIES:
            status = _json(["status", "--", folder])
            if not status["can_advance"] and not status["finished"]:
                _work(executor, folder, status, storing, told)
            opened, mesh = result(advance)
            if opened["finished"] and mesh is not None:
                return Answer(opened["report"] or {}, opened.text), mesh
            why = opened["why"] or ""
            tries = 0 if opened["done"] else tries + 1
    raise _resumable(ScratchError(f"{folder}: {why}"))


def _work(executor: Any, folder: str, status: Answer, storing: Sequence[str], told: Optional[Progress]) -> None:
    """Does all that is left of the open step; what is lost is done again."""
    generation, left = status["generation"], _missing(status)
    stage, done, total = status["steps"][0].strip("/").split("/")[0], len(status["done"]), 0
    total = done + len(left)
    tries: dict[int, int] = {}
    futures: dict[concurrent.futures.Future[Any], int] = {}

    def submit(shard: int) -> None:
        try:
            futures[executor.submit(task, folder, generation, shard, list(storing))] = shard
        except concurrent.futures.BrokenExecutor as error:
            raise _resumable(Error(f"the executor is broken ({error}); resume=True goes on with another one")) from error

    try:
        for shard in left:
            submit(shard)
        while futures:
            if told is not None:
                told(stage, done, total)
            ended, _ = concurrent.futures.wait(
                futures, timeout=LOOK, return_when=concurrent.futures.FIRST_COMPLETED
            )
            for future in ended:
                shard = futures.pop(future)
                error = _error(future)
                if error is None:
                    done += 1
                    continue
                tries[shard] = tries.get(shard, 0) + 1
                final = isinstance(error, Error) and (isinstance(error, DiskError) or not isinstance(error, FileError))
                if final or tries[shard] == _TRIES:
                    if isinstance(error, Error):
                        raise _resumable(error)
                    raise _resumable(Error(f"shard {shard} failed {tries[shard]} times: {error}")) from error
                submit(shard)
        if told is not None:
            told(stage, done, total)
    finally:
        for future in futures:
            future.cancel()


def task(folder: str, generation: int, shard: int, options: Sequence[str]) -> list[str]:
    """The work of a task, in whatever process it runs; its warnings."""
    line = ["work", "--quiet", f"--generation={generation}", f"--shard={shard}", *options, "--", folder]
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", OutcropWarning)
        _json(line)
    # What is not done yet, because others are late or found damage, is left to the next look at the run.
    return [str(warning.message) for warning in told]


def _error(future: concurrent.futures.Future[Any]) -> Optional[BaseException]:
    try:
        told = future.result()
    except (Exception, concurrent.futures.CancelledError) as error:
        return error
    for message in told:
        warnings.warn(message, OutcropWarning, stacklevel=6)
    return None


def _missing(status: Answer) -> list[int]:
    return sorted([begun["shard"] for begun in status["begun"]] + status["new"])


def _json(line: list[str]) -> Answer:
    return result(line)[0]


def _resumable(error: Error) -> Error:
    error.can_resume = True
    return error
