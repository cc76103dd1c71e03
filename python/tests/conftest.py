"""Clouds, and the program to compare with."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from typing import Any, Callable

import numpy as np
import numpy.typing as npt
import pytest

Points = npt.NDArray[np.float64]


def bumps(count: int, seed: int = 7) -> Points:
    """Points on a closed surface with bumps."""
    random = np.random.default_rng(seed)
    directions = random.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    radius = 10 + 0.5 * np.sin(7 * directions[:, :1]) * np.cos(5 * directions[:, 1:2])
    return np.asarray(np.round(directions * radius, 4))


@pytest.fixture(scope="session")
def points() -> Points:
    return bumps(5000)


@pytest.fixture(scope="session")
def program() -> Callable[..., subprocess.CompletedProcess[str]]:
    """Runs the program on the command line."""
    name = os.environ.get("OUTCROP")
    if not name:
        pytest.skip("OUTCROP, the path of the program, is not set")

    def run(*words: Any) -> subprocess.CompletedProcess[str]:
        line = [name, *map(str, words)]
        return subprocess.run(line, capture_output=True, text=True, check=False)

    return run


def write_ply(path: Path, points: Points, **columns: npt.NDArray[Any]) -> Path:
    """A PLY file as any program would write it, independent of the package."""
    names = {"f8": "double", "f4": "float", "i4": "int", "u1": "uchar", "u2": "ushort"}
    kind = points.dtype.str[1:]
    fields = [*((axis, kind) for axis in "xyz"), *((name, c.dtype.str[1:]) for name, c in columns.items())]
    rows = np.zeros(len(points), [(name, "<" + kind) for name, kind in fields])
    for axis, name in enumerate("xyz"):
        rows[name] = points[:, axis]
    for name, column in columns.items():
        rows[name] = column
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
    header += [f"property {names[kind]} {name}" for name, kind in fields] + ["end_header\n"]
    path.write_bytes("\n".join(header).encode() + rows.tobytes())
    return path
