"""What Windows does in its own way: locks, deletion, numbers of errors."""

from __future__ import annotations

import contextlib
import glob
import os
import shutil
import sys
import tempfile
import weakref
from collections.abc import Iterator
from typing import IO, Any, Optional

# What temporary folders begin with, and the file that marks one which only maps of its mesh keep.
_PREFIX, _LEFT = "outcrop-", "left"


class Taken(Exception):
    """Another process has the file."""


if sys.platform == "win32":
    import msvcrt

    @contextlib.contextmanager
    def locked(place: str) -> Iterator[IO[bytes]]:
        """A file that no other process has so at the same time; ``Taken`` if one has. The lock is that of a file beside
        it: others could not read what is locked."""
        lock = os.open(place + ".lock", os.O_RDWR | os.O_CREAT | os.O_BINARY)
        try:
            try:
                msvcrt.locking(lock, msvcrt.LK_NBLCK, 1)
            except PermissionError:
                raise Taken from None
            with os.fdopen(os.open(place, os.O_RDWR | os.O_CREAT | os.O_BINARY), "r+b") as file:
                yield file
        finally:
            os.close(lock)
            # Another process may have it open by now.
            with contextlib.suppress(OSError):
                os.unlink(place + ".lock")

    def settle(file: IO[bytes]) -> None:
        """The content is complete: from here on its time does not change, and it can be deleted."""
        file.close()

    def number_of(number: Optional[int]) -> Optional[int]:
        """The number of an error of Windows as one of C, which Python has in ``errno``."""
        return None if number is None else OSError(0, "", None, number).errno

else:
    import fcntl

    @contextlib.contextmanager
    def locked(place: str) -> Iterator[IO[bytes]]:
        """A file that no other process has so at the same time; ``Taken`` if one has."""
        file = os.fdopen(os.open(place, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600), "r+b")
        with file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise Taken from None
            yield file

    def settle(file: IO[bytes]) -> None:
        """The content is complete. The file is open still: the lock is its own."""

    def number_of(number: Optional[int]) -> Optional[int]:
        """The number of an error."""
        return number


def temporary_folder(place: Optional[str]) -> str:
    """A new folder in this one, or where the system has temporary files. What earlier ones had to leave there goes."""
    place = os.path.abspath(place or tempfile.gettempdir())
    if sys.platform == "win32":
        for mark in glob.glob(os.path.join(glob.escape(place), _PREFIX + "*", _LEFT)):
            discard(os.path.dirname(mark))
    return tempfile.mkdtemp(prefix=_PREFIX, dir=place)


def discard(folder: str) -> None:
    """Deletes a temporary folder. Windows keeps a file that is mapped: a mark then says that nobody needs it."""
    shutil.rmtree(folder, ignore_errors=True)
    if sys.platform == "win32" and os.path.isdir(folder):
        with contextlib.suppress(OSError), open(os.path.join(folder, _LEFT), "wb"):
            pass


def discard_after(folder: str, owner: Any, maps: list[Any]) -> None:
    """Deletes a temporary folder with its owner; on Windows, where that fails, with the last map of its mesh."""
    if owner is not None:
        weakref.finalize(owner, discard, folder)
    if sys.platform == "win32":
        for rows in maps:
            if getattr(rows, "_mmap", None) is not None:
                weakref.finalize(rows._mmap, discard, folder)
