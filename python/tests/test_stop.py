"""Ctrl-C, time limits, resuming, and threads."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from conftest import Points, bumps

import outcrop

# Points of a run that takes long enough to be stopped.
MANY = 1_000_000

CHILD = """
import sys, time
import numpy as np
import outcrop

def told(stage, done, total):
    if stage == "cells" and done > 0:
        print("cells", flush=True)

points = np.load(sys.argv[1])
try:
    outcrop.reconstruct(points, output=sys.argv[2], memory="256MiB", threads=1, progress=told, resume=True)
except KeyboardInterrupt:
    print("interrupted", time.monotonic(), flush=True)
else:
    print("finished", flush=True)
"""


@pytest.mark.parametrize("scratch", [False, True])
def test_control_c_leaves_a_run_that_goes_on(tmp_path: Path, scratch: bool) -> None:
    points = bumps(MANY)
    np.save(tmp_path / "points.npy", points)
    mesh = tmp_path / "mesh.ply"
    code = CHILD.replace("resume=True", f"resume=True, scratch={str(tmp_path / 'scratch')!r}") if scratch else CHILD
    (tmp_path / "scratch").mkdir()
    line = [sys.executable, "-c", code, str(tmp_path / "points.npy"), str(mesh)]
    with subprocess.Popen(line, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None and child.stdout.readline() == "cells\n"
        sent = time.monotonic()
        child.send_signal(signal.SIGINT)
        last = child.stdout.read().splitlines()[-1]
    assert last.startswith("interrupted "), last
    seconds = float(last.split()[1]) - sent
    print(f"stopped {seconds:.2f} s after the signal")
    # Less than a second, and what a busy machine adds.
    assert seconds < 2.0
    folder = tmp_path / "scratch" if scratch else tmp_path
    kept = {name.rsplit(".", 1)[-1] for name in os.listdir(folder) if "outcrop" in name}
    assert kept == {"outcrop-scratch", "ply"} and not mesh.exists()

    where = tmp_path / "scratch" if scratch else None
    with pytest.raises(outcrop.ScratchError, match="unfinished"):
        outcrop.reconstruct(points, output=mesh, scratch=where, memory="256MiB")
    with pytest.raises(outcrop.ScratchError, match="other ones"):
        outcrop.reconstruct(points[1:], output=mesh, scratch=where, resume=True, memory="256MiB")
    stages: list[str] = []
    outcrop.reconstruct(
        points, output=mesh, scratch=where, resume=True, memory="512MiB", progress=lambda s, *_: stages.append(s)
    )
    assert not [name for name in os.listdir(folder) if "outcrop" in name]
    whole = outcrop.reconstruct(points, memory="256MiB")
    assert mesh.read_bytes() == Path(whole.path).read_bytes()
    assert "export" in stages


def test_a_time_limit_leaves_a_run_that_goes_on(tmp_path: Path) -> None:
    points, mesh = bumps(MANY), tmp_path / "mesh.ply"
    began = time.monotonic()
    outcrop.reconstruct(points, memory="256MiB")
    limit = (time.monotonic() - began) / 4
    with pytest.raises(outcrop.Interrupted, match="time limit") as caught:
        outcrop.reconstruct(points, output=mesh, memory="256MiB", time_limit=limit)
    assert caught.value.can_resume
    few = bumps(1000)
    again = outcrop.reconstruct(few, output=mesh, memory="256MiB", restart=True)
    assert again.report["points"] == len(few) and os.listdir(tmp_path) == ["mesh.ply"]


def test_an_error_of_the_callback_stops_the_run(points: Points) -> None:
    def broken(*_: object) -> None:
        raise RuntimeError("of the callback")

    with pytest.raises(RuntimeError, match="of the callback"):
        outcrop.reconstruct(points, memory="256MiB", progress=broken)


def test_two_runs_at_once_give_the_same_meshes() -> None:
    clouds = [bumps(40_000, seed) for seed in (1, 2)]

    def mesh(cloud: Points) -> bytes:
        made = outcrop.reconstruct(cloud, memory="256MiB", threads=1)
        return Path(made.path).read_bytes()

    alone = [mesh(cloud) for cloud in clouds]
    with ThreadPoolExecutor(2) as pool:
        assert list(pool.map(mesh, clouds)) == alone


def test_other_threads_go_on() -> None:
    gaps, over = [0.0], threading.Event()

    def count() -> None:
        last = time.monotonic()
        while not over.wait(0.01):
            now = time.monotonic()
            gaps.append(now - last)
            last = now

    thread = threading.Thread(target=count)
    thread.start()
    began = time.monotonic()
    outcrop.reconstruct(bumps(300_000), memory="256MiB", threads=1)
    took = time.monotonic() - began
    over.set()
    thread.join()
    assert max(gaps) < took / 2 and len(gaps) > 10


def test_one_run_at_a_time_for_an_output(tmp_path: Path) -> None:
    mesh = tmp_path / "mesh.ply"
    refused: list[outcrop.Error] = []

    def told(*_: object) -> None:
        if not refused:
            with pytest.raises(outcrop.ScratchError, match="another run") as caught:
                outcrop.reconstruct(bumps(1000), output=mesh, memory="256MiB", restart=True)
            refused.append(caught.value)

    outcrop.reconstruct(bumps(100_000), output=mesh, memory="256MiB", progress=told)
    assert len(refused) == 1 and os.listdir(tmp_path) == ["mesh.ply"]
