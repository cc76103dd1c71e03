"""Commands at work: words, waiting, progress, and exceptions."""

from __future__ import annotations

import contextlib
import datetime
import errno
import json
import os
import sys
import warnings
from collections.abc import Iterable, Iterator, Mapping
from numbers import Integral, Real
from typing import Any, Callable, Optional, Union

import numpy as np

from . import _outcrop, _system

Path = Union[str, "os.PathLike[str]"]
Progress = Callable[[str, int, int], object]

# Seconds between two looks at signals and at the progress.
LOOK = 0.1

# Seconds that a run has to stop by itself. Its finished work is on disk, so nothing needs to wait for it after that.
_PATIENCE = 0.8


def is_url(path: Path) -> bool:
    """True for a file behind a URL."""
    return "://" in os.fspath(path)


class Error(Exception):
    """An error of outcrop; the message is the line that the program prints."""

    #: True if the run can go on with ``resume=True`` once the cause is removed.
    can_resume: bool = False


class InputError(Error, ValueError):
    """The points or the mesh cannot be read, or give no surface."""


class ParameterError(Error, ValueError):
    """An option has a value that is not valid."""


class BudgetError(Error, MemoryError):
    """The memory budget is too small; the message names one that would do."""


class FileError(Error, OSError):
    """A file cannot be read or written."""


class DiskError(FileError):
    """A disk is full, or too small."""


class ScratchError(Error):
    """The scratch folder is in use, damaged, or of another run."""


class Interrupted(Error):
    """The run was stopped, by its time limit or on request."""


class OutcropWarning(UserWarning):
    """A warning of a run."""


_ERRORS: dict[str, type[Error]] = {
    "input": InputError,
    "parameter": ParameterError,
    "memory": BudgetError,
    "file": FileError,
    "disk": DiskError,
    "scratch": ScratchError,
    "time": Interrupted,
    "cancelled": Interrupted,
}


class Answer(dict[str, Any]):
    """The result of a command: what it writes as JSON. As text, it is what the command prints."""

    def __init__(self, values: Mapping[str, Any], text: str) -> None:
        super().__init__(values)
        self.text = text

    def __str__(self) -> str:
        return self.text

    def __reduce__(self) -> tuple[Any, ...]:
        return Answer, (dict(self), self.text)


def words(options: Mapping[str, object]) -> list[str]:
    """Keywords as words of the command line. ``None`` and ``False`` leave an option out."""
    found: list[str] = []
    for name, value in options.items():
        flag = "--" + name.replace("_", "-")
        if value is None or (isinstance(value, (bool, np.bool_)) and not value):
            continue
        if isinstance(value, (bool, np.bool_)):
            found.append(flag)
        elif name == "report" and not isinstance(value, (str, bytes, os.PathLike)):
            assert isinstance(value, Iterable)
            found.extend(f"{flag}={_text(one)}" for one in value)
        elif name == "time_limit" and isinstance(value, Real):
            found.append(f"{flag}={round(float(value) * 1000)}ms")
        else:
            found.append(f"{flag}={_text(value)}")
    return found


def _text(value: object) -> str:
    if isinstance(value, (str, bytes, os.PathLike)):
        return os.fsdecode(value)
    if isinstance(value, Integral):
        return str(int(value))
    if isinstance(value, Real):
        return repr(float(value))
    if isinstance(value, datetime.timedelta):
        return f"{round(value.total_seconds() * 1000)}ms"
    if isinstance(value, Iterable):
        return ",".join(_text(one) for one in value)
    raise TypeError(f"{value!r} cannot be the value of an option")


@contextlib.contextmanager
def named(place: Optional[Path], action: str) -> Iterator[None]:
    """Errors of the system have the name of a file, and what failed."""
    try:
        yield
    except OSError as error:
        kind = DiskError if error.errno in (errno.ENOSPC, errno.EDQUOT) else FileError
        failed = kind(f"{place}: cannot {action}: {error.strerror}")
        failed.errno = error.errno
        raise failed from None


def run(
    words: list[str], progress: Union[Progress, bool, None] = None, quiet: bool = False
) -> tuple[Answer, Optional[str]]:
    """Runs a command; returns its result and the path of what was made."""
    with announced(progress, quiet) as told:
        return result(words, told)


@contextlib.contextmanager
def announced(progress: Union[Progress, bool, None], quiet: bool) -> Iterator[Optional[Progress]]:
    """Who is told of the progress: a function, bars, or nobody."""
    shown = _Bars() if progress is True or (progress is None and not quiet and _in_notebook()) else progress
    try:
        yield shown if callable(shown) else None
    finally:
        if isinstance(shown, _Bars):
            shown.close()


def result(words: list[str], told: Optional[Progress] = None) -> tuple[Answer, Optional[str]]:
    """The result of a command, and the path of what was made."""
    answer = finished(_outcrop.Job.command(words), told).answer()
    assert answer is not None
    values, text, made = answer
    return Answer(json.loads(values), text), None if made is None else os.fspath(made)


def finished(job: _outcrop.Job, told: Optional[Progress] = None) -> _outcrop.Job:
    """Waits for a job. Whatever ends the waiting, such as Ctrl-C, stops the job."""
    try:
        ended = False
        while not ended:
            ended = job.wait(LOOK)
            for message in job.warnings():
                warnings.warn(message, OutcropWarning, stacklevel=4)
            if told is not None:
                for stage, _, done, total in job.stages():
                    told(stage, done, total)
    except BaseException:
        job.cancel()
        job.wait(_PATIENCE)
        raise
    failure = job.failure()
    if failure is not None:
        raise _error(*failure)
    return job


def _error(kind: str, message: str, can_resume: bool, number: Optional[int]) -> Error:
    error = _ERRORS.get(kind, Error)(message)
    error.can_resume = can_resume
    if isinstance(error, OSError):
        error.errno = _system.number_of(number)
    return error


def _in_notebook() -> bool:
    """True in a notebook whose environment has tqdm."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if type(shell).__name__ != "ZMQInteractiveShell":
        return False
    try:
        import tqdm  # type: ignore[import-untyped, unused-ignore] # noqa: F401
    except ImportError:
        return False
    return True


class _Bars:
    """Progress bars of tqdm, one for each stage."""

    def __init__(self) -> None:
        with warnings.catch_warnings():
            # Without ipywidgets bars are text, which is fine.
            warnings.simplefilter("ignore")
            from tqdm.auto import tqdm  # type: ignore[import-untyped, unused-ignore]

        self._make = tqdm
        self._bar: Any = None
        self._stage = ""

    def __call__(self, stage: str, done: int, total: int) -> None:
        if self._bar is None or stage != self._stage:
            self.close()
            self._bar = self._make(total=total or None, desc=stage, unit_scale=True, leave=False)
            self._stage = stage
        self._bar.update(done - self._bar.n)

    def close(self) -> None:
        if self._bar is not None:
            self._bar.close()
            self._bar = None
