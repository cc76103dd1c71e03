"""Exceptions, and their messages."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import Points, bumps

import outcrop
from outcrop._run import named


def said(done: Any) -> str:
    """The message of the program, without its name."""
    text: str = done.stderr.strip()
    return text.removeprefix("outcrop: ") if hasattr(text, "removeprefix") else text[len("outcrop: ") :]


def keywords(line: str) -> str:
    """A line of the command line with options as keywords."""
    line = re.sub(r"--(\w+) (\d+MiB)", r'\1="\2"', line)
    return re.sub(r"--([a-z-]+)", lambda found: found[1].replace("-", "_"), line)


def test_messages_are_those_of_the_command_line(tmp_path: Path, program: Any) -> None:
    bad = tmp_path / "bad.las"
    bad.write_bytes(b"LASF" + bytes(10))
    mesh = tmp_path / "mesh.ply"
    absent = tmp_path / "absent.laz"
    line = tmp_path / "line.xyz"
    line.write_text("".join(f"{n} 0 0\n" for n in range(20)))
    cases: list[tuple[type[Exception], Path, list[str], dict[str, Any]]] = [
        (outcrop.InputError, bad, [], {}),
        (outcrop.InputError, line, [], {}),
        (outcrop.FileError, absent, [], {}),
        (outcrop.ParameterError, line, ["--neighbors=2"], {"neighbors": 2}),
        (outcrop.ParameterError, line, ["--max-angle=500"], {"max_angle": 500}),
        (outcrop.BudgetError, line, ["--memory=1MiB"], {"memory": 1 << 20}),
    ]
    for kind, cloud, words, options in cases:
        with pytest.raises(kind) as caught:
            outcrop.reconstruct(cloud, output=mesh, **options)
        assert str(caught.value) == keywords(said(program("reconstruct", cloud, "-o", mesh, *words))), words
        assert isinstance(caught.value, outcrop.Error) and not mesh.exists()


def test_exceptions_are_those_that_python_programs_expect(tmp_path: Path) -> None:
    with pytest.raises(OSError) as caught:
        outcrop.info(tmp_path / "absent.laz")
    assert caught.value.errno == 2
    with pytest.raises(outcrop.FileError, match="absent: cannot make a folder: No such file"):
        outcrop.reconstruct(bumps(100), scratch=tmp_path / "absent")
    with pytest.raises(outcrop.FileError, match="absent.mesh.ply"):
        outcrop.reconstruct(bumps(100), output=tmp_path / "absent" / "mesh.ply")
    with pytest.raises(outcrop.FileError, match="absent.ply: cannot read: No such"):
        outcrop.Mesh(tmp_path / "absent.ply")
    with pytest.raises(MemoryError):
        outcrop.reconstruct(bumps(100), memory="1MiB")
    with pytest.raises(ValueError, match="for threads: "):
        outcrop.reconstruct(bumps(100), threads=0)
    with pytest.raises(TypeError):
        outcrop.reconstruct(bumps(100), no_such_option=1)  # type: ignore[call-arg]


@pytest.mark.parametrize(
    "points, options, message",
    [
        (np.zeros((4, 2)), {}, r"points: found an array of shape \(4, 2\), expected \(n, 3\)"),
        (np.zeros((4, 3), complex), {}, "x: found values of type complex128"),
        (np.zeros((4, 3), np.longdouble), {}, "x: found values of type"),
        (np.array([["a"] * 3]), {}, "x: found values of type <U1"),
        (np.array([[1 << 60, 0, 0]] * 4), {}, "expected integers of at most"),
        (np.zeros((4, 3)), {"colors": np.zeros((4, 3))}, "colors: found float64"),
        (np.zeros((4, 3)), {"colors": np.zeros((4, 4), np.uint8)}, "colors: found uint8 of shape"),
        (np.zeros((4, 3)), {"colors": np.zeros((5, 3), np.uint8)}, "red: found an array of shape"),
        (np.zeros((4, 3)), {"columns": {"a": np.zeros(3)}}, "a: found an array of shape"),
        (np.zeros((4, 3)), {"columns": {"a b": np.zeros(4)}}, "'a b'"),
        (np.zeros((4, 3)), {"columns": {"x": np.zeros(4)}}, "'x'"),
        (np.zeros((0, 3)), {}, "no usable point"),
        (np.full((9, 3), np.nan), {}, "no usable point"),
    ],
)
def test_arrays_that_are_no_cloud(points: Any, options: Any, message: str, tmp_path: Path) -> None:
    with pytest.raises(outcrop.InputError, match=message):
        outcrop.reconstruct(points, output=tmp_path / "mesh.ply", memory="256MiB", **options)
    assert os.listdir(tmp_path) == []


def test_values_of_files_are_not_arrays(tmp_path: Path) -> None:
    with pytest.raises(outcrop.ParameterError, match="attributes"):
        outcrop.reconstruct("a.laz", colors=np.zeros((4, 3), np.uint8))
    with pytest.raises(outcrop.ParameterError, match="output"):
        outcrop.reconstruct(bumps(100), resume=True)


def test_a_full_disk_is_told() -> None:
    with pytest.raises(outcrop.DiskError, match="f.ply: cannot write the points: No space left"):
        with named("f.ply", "write the points"), open("/dev/full", "wb") as full:
            full.write(bytes(1 << 20))


def test_no_temporary_folder_is_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with pytest.raises(outcrop.InputError):
        outcrop.reconstruct(np.zeros((4, 3)), memory="256MiB")
    with pytest.raises(outcrop.FileError):
        outcrop.compare(bumps(100), tmp_path / "absent.ply", memory="256MiB")
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize(
    "text",
    [
        b"",
        b"ply\nformat ascii 1.0\nend_header\n",
        b"ply\nformat binary_little_endian 1.0\nelement vertex 9\nproperty float x\n",
        b"ply\nformat binary_little_endian 1.0\nelement vertex 9\nproperty float x\nproperty float y\n"
        b"property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n",
        b"ply\nformat binary_little_endian 1.0\nelement vertex 99999999999999999999\nend_header\n",
        b"ply\nformat binary_little_endian 1.0\nproperty\n",
    ],
)
def test_files_that_are_no_meshes(text: bytes, tmp_path: Path) -> None:
    path = tmp_path / "odd.ply"
    path.write_bytes(text)
    with pytest.raises(outcrop.InputError, match="odd.ply"):
        outcrop.Mesh(path)


def test_answers_can_be_pickled(points: Points) -> None:
    import pickle

    described = outcrop.info(points, memory="256MiB")
    again = pickle.loads(pickle.dumps(described))
    assert again == described and str(again) == str(described)
