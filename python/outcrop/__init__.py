"""Point clouds of any size to clean triangle meshes, inside the memory you give.

Functions are the commands of the program ``outcrop``, and their keywords its options, with ``_`` for ``-``; the text
of ``outcrop COMMAND --help`` describes them.
"""

from __future__ import annotations

import contextlib
import datetime
import os
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from typing import Any, Optional, Union

import numpy as np

from . import _outcrop, _system
from ._mesh import Mesh
from ._points import Cloud, temporary, temporary_folder, written
from ._run import (
    Answer,
    BudgetError,
    DiskError,
    Error,
    FileError,
    InputError,
    Interrupted,
    OutcropWarning,
    ParameterError,
    Path,
    Progress,
    ScratchError,
    is_url,
    run,
    words,
)
from ._shared import plan_words, share

__all__ = [
    "Answer",
    "BudgetError",
    "DiskError",
    "Error",
    "FileError",
    "InputError",
    "Interrupted",
    "Mesh",
    "OutcropWarning",
    "ParameterError",
    "ScratchError",
    "change",
    "close",
    "compare",
    "info",
    "raster",
    "reconstruct",
    "simplify",
    "tiles",
    "verify",
    "volume",
]

__version__ = _outcrop.__version__

# Tasks that share a run must all have the same extension.
_outcrop.part_of(str(_outcrop.__file__))

Size = Union[int, str]
Time = Union[float, str, datetime.timedelta]
Width = Union[float, str]
Classes = Union[int, str, Sequence[int]]
Region = Union[Path, Sequence[float]]


def reconstruct(
    points: Any,
    *,
    output: Optional[Path] = None,
    colors: Any = None,
    columns: Union[Mapping[str, Any], str, Sequence[str], None] = None,
    progress: Union[Progress, bool, None] = None,
    normals: bool = False,
    compress_glb: bool = False,
    split: Optional[float] = None,
    triangles: Optional[int] = None,
    close: Union[str, bool, None] = None,
    lossy: bool = False,
    drop_classes: Optional[Classes] = None,
    keep_classes: Optional[Classes] = None,
    skip_lines: int = 0,
    crop: Optional[Region] = None,
    crop_margin: Optional[float] = None,
    thin: Optional[float] = None,
    drop_outliers: Union[float, bool, None] = None,
    attributes: Union[str, Sequence[str]] = "none",
    wide_colors: bool = False,
    method: str = "robust",
    neighbors: int = 30,
    smooth: Union[int, str, None] = None,
    smoothing: Optional[str] = None,
    relax: Optional[int] = None,
    radius: Width = "auto",
    max_angle: Optional[float] = None,
    keep_all: bool = False,
    max_edge: Optional[Width] = None,
    facing: Union[str, Sequence[float]] = "auto",
    ignore_scanners: bool = False,
    input_normals: Optional[str] = None,
    max_hole_edges: Optional[int] = None,
    max_fill: Optional[Width] = None,
    min_component: Optional[int] = None,
    no_repair: bool = False,
    origin: Union[str, Sequence[float]] = "none",
    keep_far: bool = False,
    ignore_crs: bool = False,
    crs: Optional[Path] = None,
    memory: Optional[Size] = None,
    threads: Optional[int] = None,
    scratch: Optional[Path] = None,
    io: str = "auto",
    scratch_compression: Union[int, str] = "auto",
    quiet: bool = False,
    resume: bool = False,
    restart: bool = False,
    time_limit: Optional[Time] = None,
    report: Union[Path, Sequence[Path], None] = None,
    executor: Optional[Executor] = None,
    shards: int = 16,
) -> Mesh:
    """Makes a mesh from points.

    ``points`` is an array (n x 3), a file or folder of points, or a list of them. ``colors`` (n x 3, uint8 or uint16)
    and ``columns`` (arrays by name) are values of the points of an array; the mesh keeps them. Of text files
    ``columns`` has the names of the columns in their order, such as ``"x,y,z,intensity,-"``. Without ``output`` the mesh
    is in a temporary file, which is deleted with the :class:`Mesh`. ``output`` may be the URL of a file in a store, such
    as ``"s3://bucket/mesh.ply"``; its arrays are not here then.

    ``progress`` is a function of the name of the stage, the items done, and the items in all (0 if unknown), or
    ``True`` for bars of tqdm, which notebooks show by default. Time limits are texts such as ``"7h30m"``, or seconds.

    With an ``executor`` (:class:`concurrent.futures.Executor`: a pool of processes, Dask, MPI, Parsl) the work is divided
    into ``shards``, which it runs in whatever processes it has; ``memory`` (2 GiB) and ``threads`` (1) are those of each
    of them. They must see ``points``, and ``output`` and ``scratch``, under the same names.
    """
    options = dict(locals())
    for name in ("points", "output", "colors", "columns", "progress", "executor", "shards"):
        del options[name]
    if output is None and (resume or restart):
        raise ParameterError("resume, restart: a run without output= cannot be resumed")
    with contextlib.ExitStack() as stack:
        folder = None
        store = executor is not None and "://" in os.fsdecode(scratch or "")
        if output is None:
            folder = temporary_folder(None if store else scratch)
            failed = stack.enter_context(contextlib.ExitStack())
            failed.callback(_system.discard, folder)
            output = os.path.join(folder, "mesh.ply")
            if not store:
                options["scratch"] = folder
        inputs = _paths(points)
        if inputs is None:
            if store:
                raise ParameterError("points: with scratch in a store these are files or URLs that workers see")
            if columns is not None and not isinstance(columns, Mapping):
                raise ParameterError("columns: of points in an array these are arrays by name")
            cloud = Cloud(points, colors, columns)
            if cloud.names and attributes == "none":
                options["attributes"] = cloud.names
            output = os.fspath(output) if is_url(output) else os.path.abspath(output)
            if options["scratch"] is not None:
                options["scratch"] = os.path.abspath(options["scratch"])
            place = written(cloud, output, options["scratch"], resume, restart)
            inputs = [stack.enter_context(place)]
        elif colors is not None or isinstance(columns, Mapping):
            raise ParameterError("colors, columns: these belong to points in an array; of files, attributes= keeps them")
        else:
            options["columns"] = columns
        if executor is None:
            line = ["reconstruct", f"--output={os.fspath(output)}", *words(options), "--", *inputs]
            answer, made = run(line, progress, quiet)
        else:
            inputs = [path if "://" in path else os.path.abspath(path) for path in inputs]
            # What stands behind `--` is for schedulers.
            line = [*inputs, f"--output={os.path.abspath(output)}", *plan_words(options, shards)]
            answer, made = share(executor, line, options, progress)
        if folder is not None:
            failed.pop_all()
    return Mesh(made or output, answer, _temporary=folder)


def info(
    points: Any,
    *,
    progress: Union[Progress, bool, None] = None,
    html: Optional[Path] = None,
    headers: bool = False,
    all_points: bool = False,
    drop_classes: Optional[Classes] = None,
    keep_classes: Optional[Classes] = None,
    columns: Union[str, Sequence[str], None] = None,
    skip_lines: int = 0,
    crop: Optional[Region] = None,
    crop_margin: Optional[float] = None,
    crs: Optional[Path] = None,
    memory: Optional[Size] = None,
    threads: Optional[int] = None,
    scratch: Optional[Path] = None,
    io: str = "auto",
    scratch_compression: Union[int, str] = "auto",
    quiet: bool = False,
) -> Answer:
    """Describes a cloud (an array, a file or folder, or a list of them) and estimates what a run needs."""
    options = dict(locals())
    with _files(points, scratch) as files:
        del options["points"], options["progress"]
        return run(["info", *words(options), "--", *files], progress, quiet)[0]


def verify(
    mesh: Union[Mesh, Path],
    *,
    progress: Union[Progress, bool, None] = None,
    html: Optional[Path] = None,
    allow_unreferenced: bool = False,
    memory: Optional[Size] = None,
    threads: Optional[int] = None,
    scratch: Optional[Path] = None,
    io: str = "auto",
    scratch_compression: Union[int, str] = "auto",
    quiet: bool = False,
) -> Answer:
    """Checks that a mesh (PLY) is a manifold: ``["manifold"]`` of the result says so."""
    options = dict(locals())
    del options["mesh"], options["progress"]
    return run(["verify", *words(options), "--", _path(mesh)], progress, quiet)[0]


def compare(
    a: Any,
    b: Any,
    *,
    progress: Union[Progress, bool, None] = None,
    samples: Union[int, float, str] = 1_000_000,
    seed: int = 0,
    html: Optional[Path] = None,
    memory: Optional[Size] = None,
    threads: Optional[int] = None,
    scratch: Optional[Path] = None,
    io: str = "auto",
    scratch_compression: Union[int, str] = "auto",
    quiet: bool = False,
) -> Answer:
    """Measures the distance between two meshes or clouds, each a :class:`Mesh`, a file, a folder or an array."""
    options = dict(locals())
    del options["a"], options["b"], options["progress"]
    with _files(a, scratch) as first, _files(b, scratch) as second:
        return run(["compare", *words(options), "--", *first, *second], progress, quiet)[0]


def change(
    old: Any,
    new: Union[Mesh, Path],
    *,
    output: Optional[Path] = None,
    progress: Union[Progress, bool, None] = None,
    registration: float = 0,
    radius: Optional[float] = None,
    farthest: Optional[float] = None,
    areas: Optional[Path] = None,
    html: Optional[Path] = None,
    memory: Optional[Size] = None,
    threads: Optional[int] = None,
    scratch: Optional[Path] = None,
    io: str = "auto",
    scratch_compression: Union[int, str] = "auto",
    quiet: bool = False,
    resume: bool = False,
    restart: bool = False,
) -> Answer:
    """Measures what changed from one surface, a :class:`Mesh`, a file, a folder or an array, to a new mesh."""
    options = dict(locals())
    del options["old"], options["new"], options["progress"]
    with _files(old, scratch) as first:
        return run(["change", *words(options), "--", *first, _path(new)], progress, quiet)[0]


def volume(
    mesh: Union[Mesh, Path],
    *,
    progress: Union[Progress, bool, None] = None,
    above: Union[float, Mesh, Path, None] = None,
    crop: Optional[Region] = None,
    memory: Optional[Size] = None,
    threads: Optional[int] = None,
    scratch: Optional[Path] = None,
    io: str = "auto",
    scratch_compression: Union[int, str] = "auto",
    quiet: bool = False,
) -> Answer:
    """Measures what a mesh encloses, or what lies above and below a level or another mesh (``above``)."""
    options = dict(locals())
    del options["mesh"], options["progress"]
    if isinstance(above, Mesh):
        options["above"] = above.path
    return run(["volume", *words(options), "--", _path(mesh)], progress, quiet)[0]


def raster(
    source: Any,
    *,
    output: Path,
    cell: float,
    progress: Union[Progress, bool, None] = None,
    surface: str = "highest",
    crop: Optional[Region] = None,
    orthophoto: Optional[Path] = None,
    contours: Optional[float] = None,
    contours_output: Optional[Path] = None,
    memory: Optional[Size] = None,
    threads: Optional[int] = None,
    scratch: Optional[Path] = None,
    io: str = "auto",
    scratch_compression: Union[int, str] = "auto",
    quiet: bool = False,
    resume: bool = False,
    restart: bool = False,
) -> Answer:
    """Makes a raster of heights (GeoTIFF) of a mesh or points, with contours and an orthophoto if wanted."""
    options = dict(locals())
    del options["source"], options["progress"]
    with _files(source, scratch) as files:
        return run(["raster", *words(options), "--", *files], progress, quiet)[0]


def tiles(
    mesh: Union[Mesh, Path],
    *,
    output: Path,
    progress: Union[Progress, bool, None] = None,
    geo: bool = False,
    crs: Optional[Path] = None,
    lossy: bool = False,
    memory: Optional[Size] = None,
    threads: Optional[int] = None,
    scratch: Optional[Path] = None,
    io: str = "auto",
    scratch_compression: Union[int, str] = "auto",
    quiet: bool = False,
    resume: bool = False,
    restart: bool = False,
) -> Answer:
    """Cuts a mesh (PLY) into levels of detail for viewers of 3D Tiles, in the folder ``output``."""
    options = dict(locals())
    del options["mesh"], options["progress"]
    return run(["tiles", *words(options), "--", _path(mesh)], progress, quiet)[0]


def simplify(
    mesh: Union[Mesh, Path],
    *,
    output: Path,
    progress: Union[Progress, bool, None] = None,
    triangles: Union[int, float, str, None] = None,
    ratio: Optional[float] = None,
    error: Optional[float] = None,
    keep_boundary: bool = False,
    close: Union[str, bool, None] = None,
    samples: Union[int, float, str] = 1_000_000,
    memory: Optional[Size] = None,
    threads: Optional[int] = None,
    scratch: Optional[Path] = None,
    io: str = "auto",
    scratch_compression: Union[int, str] = "auto",
    quiet: bool = False,
    resume: bool = False,
    restart: bool = False,
) -> Answer:
    """Makes a mesh with fewer triangles of a mesh (PLY), in the file ``output``.

    One of ``triangles``, ``ratio`` and ``error`` says how far it goes. ``Mesh(output)`` opens what was made.
    """
    options = dict(locals())
    del options["mesh"], options["progress"]
    return run(["simplify", *words(options), "--", _path(mesh)], progress, quiet)[0]


def close(
    mesh: Union[Mesh, Path],
    *,
    output: Path,
    progress: Union[Progress, bool, None] = None,
    kind: str = "auto",
    memory: Optional[Size] = None,
    threads: Optional[int] = None,
    scratch: Optional[Path] = None,
    io: str = "auto",
    scratch_compression: Union[int, str] = "auto",
    quiet: bool = False,
    resume: bool = False,
    restart: bool = False,
) -> Answer:
    """Closes the boundary of a mesh (PLY), in the file ``output``.

    ``kind`` is ``auto``, ``lids``, ``smooth``, ``base`` or ``base=Z``. ``Mesh(output)`` opens what was made.
    """
    options = dict(locals())
    del options["mesh"], options["progress"]
    return run(["close", *words(options), "--", _path(mesh)], progress, quiet)[0]


def _path(mesh: Union[Mesh, Path]) -> str:
    return mesh.path if isinstance(mesh, Mesh) else os.fspath(mesh)


def _paths(points: Any) -> Optional[list[str]]:
    """The files, unless it is points in memory."""
    if isinstance(points, (str, bytes, os.PathLike)):
        return [os.fsdecode(points)]
    if isinstance(points, (list, tuple)) and points and all(isinstance(p, (str, bytes, os.PathLike)) for p in points):
        return [os.fsdecode(point) for point in points]
    return None


@contextlib.contextmanager
def _files(shape: Any, scratch: Optional[Path]) -> Iterator[list[str]]:
    """The files of a mesh, of files, or of points in memory."""
    paths = [shape.path] if isinstance(shape, Mesh) else _paths(shape)
    if paths is not None:
        yield paths
        return
    with temporary(np.asarray(shape), scratch) as path:
        yield [path]
