"""Points in memory, as a file that the program reads."""

from __future__ import annotations

import contextlib
import itertools
import os
import re
import tempfile
import zlib
from collections.abc import Iterator, Mapping
from typing import IO, Any, Optional

import numpy as np
import numpy.typing as npt

from . import _system
from ._run import InputError, Path, ScratchError, is_url, named

Array = npt.NDArray[Any]

# Points that are copied at a time.
_CHUNK = 1 << 17

# Types of numbers: as numpy and as PLY calls them.
PLY = {
    "<f4": "float",
    "<f8": "double",
    "|i1": "char",
    "|u1": "uchar",
    "<i2": "short",
    "<u2": "ushort",
    "<i4": "int",
    "<u4": "uint",
}


class Cloud:
    """Points with the values that they carry; nothing is copied."""

    def __init__(self, points: Any, colors: Any = None, columns: Optional[Mapping[str, Any]] = None) -> None:
        positions = np.asarray(points)
        if positions.ndim != 2 or positions.shape[1] != 3:
            raise InputError(f"points: found an array of shape {positions.shape}, expected (n, 3)")
        self.count = len(positions)
        self.names: list[str] = []
        self._fields: list[tuple[str, str, Array]] = []
        for axis, name in enumerate("xyz"):
            self._add(name, positions[:, axis])
        if colors is not None:
            values = np.asarray(colors)
            if values.ndim != 2 or values.shape[1] != 3 or values.dtype.str[1:] not in ("u1", "u2"):
                found = f"{values.dtype} of shape {values.shape}"
                raise InputError(f"colors: found {found}, expected uint8 or uint16 of shape ({self.count}, 3)")
            self.names.append("color")
            for channel, name in enumerate(("red", "green", "blue")):
                self._add(name, values[:, channel])
        for name, column in (columns or {}).items():
            if not re.fullmatch(r"[A-Za-z_]\w*", name, re.ASCII) or name in ("x", "y", "z", "color"):
                raise InputError(f"columns: found {name!r}, expected a name of letters, digits and _")
            self.names.append(name)
            self._add(name, np.asarray(column))
        dtype = [(name, kind) for name, kind, _ in self._fields]
        if len(dict(dtype)) != len(dtype):
            raise InputError("columns: found a name twice, expected each once")
        self._dtype = np.dtype(dtype)

    def _add(self, name: str, values: Array) -> None:
        if values.shape != (self.count,):
            raise InputError(f"{name}: found an array of shape {values.shape}, expected ({self.count},)")
        self._fields.append((name, np.dtype(_stored(name, values)).str, values))

    def header(self) -> bytes:
        """The header of the file."""
        lines = ["ply", "format binary_little_endian 1.0", f"element vertex {self.count}"]
        lines += [f"property {PLY[kind]} {name}" for name, kind, _ in self._fields]
        return "\n".join([*lines, "end_header", ""]).encode("ascii")

    def rows(self) -> Iterator[bytes]:
        """The rows of the file, in pieces."""
        for start in range(0, self.count, _CHUNK):
            stop = min(start + _CHUNK, self.count)
            rows = np.empty(stop - start, self._dtype)
            for name, _, values in self._fields:
                rows[name] = values[start:stop]
            yield rows.tobytes()

    def write(self, file: IO[bytes]) -> None:
        """Writes the file."""
        file.seek(0)
        file.truncate()
        file.write(self.header())
        for rows in self.rows():
            file.write(rows)
        file.flush()

    def is_in(self, file: IO[bytes]) -> bool:
        """True if the file has just this content."""
        file.seek(0)
        pieces = itertools.chain([self.header()], self.rows())
        return all(file.read(len(piece)) == piece for piece in pieces) and not file.read(1)


def _stored(name: str, values: Array) -> str:
    """The type that holds all values exactly, as a little-endian dtype."""
    kind, size = values.dtype.kind, values.dtype.itemsize
    if kind == "f" and size <= 8:
        return "<f4" if size <= 4 else "<f8"
    if kind == "b":
        return "u1"
    if kind in "iu" and size <= 4:
        return f"<{kind}{size}"
    if kind in "iu":
        low, high = (int(values.min()), int(values.max())) if len(values) else (0, 0)
        for narrow in ("<i4", "<u4"):
            limits = np.iinfo(narrow)
            if limits.min <= low and high <= limits.max:
                return narrow
        if max(-low, high) > 1 << 53:
            raise InputError(f"{name}: found {max(-low, high)}, expected integers of at most 2**53")
        return "<f8"
    raise InputError(f"{name}: found values of type {values.dtype}, expected numbers")


@contextlib.contextmanager
def written(cloud: Cloud, output: str, scratch: Optional[str], resume: bool, restart: bool) -> Iterator[str]:
    """A file with the points, beside the scratch folder of a run with absolute paths.

    It is deleted at the end, unless the run can be resumed: a run knows its inputs by the times of their files, so it
    needs this very file.
    """
    start = _place(output, scratch)
    place, folder = f"{start}.outcrop-points.ply", f"{start}.outcrop-scratch"
    with contextlib.ExitStack() as stack:
        try:
            with named(place, "open"):
                file = stack.enter_context(_system.locked(place))
        except _system.Taken:
            why = "another run is at work here; wait for it, or choose another scratch"
            raise ScratchError(f"{place}: {why}") from None
        try:
            if restart or not os.path.isdir(folder):
                with named(place, "write the points"):
                    cloud.write(file)
            elif not resume:
                why = "an unfinished run is here already; resume=True goes on with it, or restart=True begins again"
                raise ScratchError(f"{folder}: {why}")
            elif not cloud.is_in(file):
                raise ScratchError(f"{folder}: cannot go on: the points were other ones; restart=True begins again")
            _system.settle(file)
            yield place
        finally:
            if not os.path.isdir(folder):
                _system.settle(file)
                with contextlib.suppress(FileNotFoundError):
                    os.unlink(place)


def temporary_folder(scratch: Optional[Path]) -> str:
    """A new folder in that of the scratch files, or where the system has temporary files."""
    with named(scratch or tempfile.gettempdir(), "make a folder"):
        return _system.temporary_folder(None if scratch is None else os.fsdecode(scratch))


def _place(output: str, scratch: Optional[str]) -> str:
    """The path of the scratch folder of the run with this output, without its ending."""
    if is_url(output):
        names = [name for name in output.rstrip("/").split("/") if name != "tileset.json"]
        return os.path.abspath(os.path.join(scratch or "", f"{names[-1]}-{zlib.crc32(os.fsencode(output)):08x}"))
    if os.path.basename(output) == "tileset.json":
        output = os.path.dirname(output)
    folder, name = os.path.split(output)
    if scratch is None or scratch == folder:
        return output
    # Outputs of the same name in several folders may share one folder for scratch.
    return os.path.join(scratch, f"{name}-{zlib.crc32(os.fsencode(output)):08x}")


@contextlib.contextmanager
def temporary(points: Any, scratch: Optional[Path]) -> Iterator[str]:
    """A file with points, for the time of one command."""
    cloud = Cloud(points)
    folder = temporary_folder(scratch)
    try:
        place = os.path.join(folder, "points.ply")
        with open(place, "w+b") as file, named(place, "write the points"):
            cloud.write(file)
        yield place
    finally:
        _system.discard(folder)
