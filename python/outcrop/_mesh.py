"""A mesh in a file, seen as arrays."""

from __future__ import annotations

import base64
import html
import os
import shutil
from collections.abc import Mapping
from typing import IO, Any, Optional

import numpy as np
import numpy.typing as npt

from . import _outcrop, _system
from ._points import PLY
from ._run import Error, InputError, ParameterError, Path, finished, is_url, named

_NUMPY = {name: kind for kind, name in PLY.items()}

# Most triangles of a mesh that is drawn unasked.
_MOST_DRAWN = 5_000_000

# Most bytes of a picture in a notebook.
_MOST_BYTES = 700_000

# Triangles or vertices that are written at a time.
_CHUNK = 1 << 16

Array = npt.NDArray[Any]


class Mesh:
    """A mesh. Arrays are read-only maps of its file, so they take no memory that the system cannot take back.

    ``Mesh(path)`` opens a mesh (PLY) that is there already.
    """

    def __init__(
        self, path: Path, report: Optional[Mapping[str, Any]] = None, *, _temporary: Optional[str] = None
    ) -> None:
        self.path: str = os.fspath(path) if is_url(path) else os.path.abspath(path)
        #: The report of the run, as ``--report`` writes it; empty for a mesh that was opened.
        self.report: dict[str, Any] = report if isinstance(report, dict) else dict(report or {})
        self._rows: Optional[tuple[Array, Array, list[str]]] = None
        self._temporary = _temporary
        if _temporary is not None:
            _system.discard_after(_temporary, self, [])
        if report is None:
            self._map()

    def _map(self) -> tuple[Array, Array, list[str]]:
        if self._rows is None and is_url(self.path):
            raise InputError(f"{self.path}: a mesh in a store has no arrays here; copy it to this machine and open that")
        if self._rows is None:
            self._rows = _mapped(self.path)
            if self._temporary is not None:
                _system.discard_after(self._temporary, None, list(self._rows[:2]))
        return self._rows

    @property
    def vertices(self) -> Array:
        """Positions, n x 3: float64 where float32 would lose a step of the cloud's grid, else float32."""
        xyz: Array = self._map()[0]["xyz"]
        return xyz

    @property
    def faces(self) -> npt.NDArray[np.uint32]:
        """Numbers of the vertices of the triangles, m x 3."""
        corners: Array = self._map()[1]["corners"]
        return corners.view("<u4")

    @property
    def filled(self) -> Optional[npt.NDArray[np.bool_]]:
        """True for triangles that close the mesh, m; none if the mesh was not closed."""
        faces = self._map()[1]
        return faces["filled"] != 0 if "filled" in (faces.dtype.names or ()) else None

    @property
    def columns(self) -> dict[str, Array]:
        """The values of the vertices by name: those that the points carried, and normals ``nx``, ``ny``, ``nz``."""
        vertices = self._map()[0]
        return {name: vertices[name] for name in vertices.dtype.names or () if name != "xyz"}

    @property
    def colors(self) -> Optional[Array]:
        """Colours of the vertices, n x 3; none if the mesh has none."""
        return self._three("red", "green", "blue")

    @property
    def normals(self) -> Optional[Array]:
        """Normals of the vertices, n x 3; none unless they were asked for."""
        return self._three("nx", "ny", "nz")

    def _three(self, *names: str) -> Optional[Array]:
        """Three columns side by side as one view."""
        vertices = self._map()[0]
        fields: Mapping[str, Any] = vertices.dtype.fields or {}
        if any(name not in fields for name in names):
            return None
        kinds, offsets = zip(*(fields[name][:2] for name in names))
        size = kinds[0].itemsize
        if set(kinds) != {kinds[0]} or list(offsets) != [offsets[0] + n * size for n in range(3)]:
            return np.stack([vertices[name] for name in names], axis=1)
        field = {"names": ["three"], "formats": [(kinds[0], 3)], "offsets": [offsets[0]]}
        together: Array = vertices.view(np.dtype({**field, "itemsize": vertices.dtype.itemsize}))["three"]  # type: ignore[call-overload]
        return together

    @property
    def origin(self) -> Optional[tuple[float, float, float]]:
        """The position of the cloud that is the origin of the coordinates; none if that is the cloud's own."""
        offsets = [self._comment(f"offset{axis} ") for axis in "xyz"]
        if None in offsets:
            return None
        x, y, z = (float(offset or 0) for offset in offsets)
        return x, y, z

    @property
    def crs(self) -> Optional[str]:
        """The reference system: ``EPSG:n`` if its code is known, else its name; none if the inputs name none."""
        code = self._comment("epsg ")
        return self._comment("crs ") if code is None else f"EPSG:{code}"

    def _comment(self, start: str) -> Optional[str]:
        found = (line[len(start) :] for line in self._map()[2] if line.startswith(start))
        return next(found, None)

    def save(self, path: Path) -> None:
        """Writes the mesh.

        ``.ply`` is a copy, ``.glb`` has positions, colours and normals, ``.obj`` and ``.stl`` positions and triangles.
        """
        name = os.fsdecode(path)
        extension = os.path.splitext(name)[1].lower()
        if extension == os.path.splitext(self.path)[1].lower():
            with named(name, "write"):
                shutil.copyfile(self.path, name)
            return
        if extension == ".glb":
            comments = [line for line in self._map()[2] if not line.startswith("made by ")]
            finished(_outcrop.Job.save_glb(self.path, name, comments))
            return
        writers = {".obj": _write_obj, ".stl": _write_stl}
        if extension not in writers:
            raise ParameterError(
                f"{name}: cannot save as {extension or 'a name without extension'}: .ply, .glb, .obj and .stl can be; "
                "for others give the name to reconstruct(output=...)"
            )
        self._map()
        with named(name, "write"), open(name, "wb") as file:
            writers[extension](self, file)

    def picture(self) -> bytes:
        """The mesh from the south-west, as PNG, drawn in bounded memory. Boundary edges are marked."""
        png = finished(_outcrop.Job.picture(self.path)).png()
        return png or b""

    def to_trimesh(self) -> Any:
        """The mesh as a ``trimesh.Trimesh``, a copy in memory."""
        try:
            import trimesh
        except ImportError:
            raise ImportError("to_trimesh() needs trimesh: pip install trimesh") from None
        colors = self._bytes_of_colors()
        return trimesh.Trimesh(np.array(self.vertices), np.array(self.faces), vertex_colors=colors, process=False)

    def to_open3d(self) -> Any:
        """The mesh as an ``open3d.geometry.TriangleMesh``, a copy in memory."""
        try:
            import open3d  # type: ignore[import-not-found, unused-ignore]
        except ImportError:
            raise ImportError("to_open3d() needs Open3D: pip install open3d") from None
        utility = open3d.utility
        mesh = open3d.geometry.TriangleMesh(
            utility.Vector3dVector(np.ascontiguousarray(self.vertices, np.float64)),
            utility.Vector3iVector(np.ascontiguousarray(self.faces, np.int32)),
        )
        colors = self._bytes_of_colors()
        if colors is not None:
            mesh.vertex_colors = utility.Vector3dVector(colors / 255.0)
        return mesh

    def _bytes_of_colors(self) -> Optional[Array]:
        colors = self.colors
        if colors is None or colors.dtype == np.uint8:
            return None if colors is None else np.array(colors)
        return (colors >> 8).astype(np.uint8)

    def __repr__(self) -> str:
        name = os.path.basename(self.path)
        if not self.path.endswith(".ply"):
            return f"<Mesh {name}>"
        vertices, faces, _ = self._map()
        return f"<Mesh {name}: {len(vertices)} vertices, {len(faces)} triangles>"

    def _repr_html_(self) -> str:
        text = f"<p>{html.escape(repr(self))}</p>"
        if not self.path.endswith(".ply") or len(self._map()[1]) > _MOST_DRAWN:
            return text
        try:
            png = self.picture()
        except Error:
            return text
        if not 0 < len(png) <= _MOST_BYTES:
            return text
        image = base64.b64encode(png).decode("ascii")
        return f'{text}<img alt="the mesh" width="440" src="data:image/png;base64,{image}">'


def _mapped(path: str) -> tuple[Array, Array, list[str]]:
    """Vertices, triangles and comments of a mesh as outcrop writes it."""
    with named(path, "read"), open(path, "rb") as file:
        counts, properties, comments = _header(path, file)
        start = file.tell()
    fields: list[Any] = list(properties.get("vertex", []))
    if [name for name, _ in fields[:3]] != ["x", "y", "z"] or len({kind for _, kind in fields[:3]}) != 1:
        raise _unfit(path, "vertices that begin with x, y and z of one type")
    vertex = np.dtype([("xyz", fields[0][1], (3,)), *fields[3:]])
    (_, index), *more = properties.get("face") or [("", "")]
    if index not in ("<i4", "<u4"):
        raise _unfit(path, "faces that are lists of three int")
    face = np.dtype([("count", "u1"), ("corners", index, (3,)), *more])
    middle = start + counts["vertex"] * vertex.itemsize
    if os.path.getsize(path) != middle + counts["face"] * face.itemsize:
        raise _unfit(path, "a file that has just its vertices and triangles")
    vertices = _rows(path, vertex, start, counts["vertex"])
    return vertices, _rows(path, face, middle, counts["face"]), comments


def _rows(path: str, dtype: np.dtype[Any], offset: int, count: int) -> Array:
    if count == 0:
        return np.empty(0, dtype)
    return np.memmap(path, dtype, "r", offset, (count,))


def _header(path: str, file: IO[bytes]) -> tuple[dict[str, int], dict[str, list[tuple[str, str]]], list[str]]:
    """Numbers of rows, properties with their types, and comments."""
    counts: dict[str, int] = {}
    properties: dict[str, list[tuple[str, str]]] = {}
    comments: list[str] = []
    lines = [file.readline(1 << 16).rstrip(b"\r\n").decode("utf-8", "replace") for _ in range(2)]
    if lines != ["ply", "format binary_little_endian 1.0"]:
        raise _unfit(path, "a binary PLY (little-endian)")
    element = ""
    while True:
        line = file.readline(1 << 21).rstrip(b"\r\n").decode("utf-8", "replace")
        first, *rest = line.split(" ")
        if first == "end_header":
            return counts, properties, comments
        if first == "comment":
            comments.append(line[len("comment ") :])
        elif first == "element" and len(rest) == 2 and rest[1].isdigit() and rest[0] in ("vertex", "face"):
            element = rest[0]
            counts[element], properties[element] = int(rest[1]), []
        elif first == "property" and element and rest and rest[-2] in _NUMPY:
            properties[element].append((rest[-1], _NUMPY[rest[-2]]))
        else:
            raise _unfit(path, f"a header of a mesh of outcrop, not {line[:60]!r}")


def _unfit(path: str, expected: str) -> InputError:
    return InputError(f"{path}: no arrays of this file: expected {expected}")


def _write_obj(mesh: Mesh, file: IO[bytes]) -> None:
    vertices = mesh.vertices
    digits = "%.9g" if vertices.dtype.itemsize == 4 else "%.17g"
    for start in range(0, len(vertices), _CHUNK):
        np.savetxt(file, vertices[start : start + _CHUNK], "v " + " ".join([digits] * 3))
    faces = mesh.faces
    for start in range(0, len(faces), _CHUNK):
        np.savetxt(file, faces[start : start + _CHUNK].astype(np.int64) + 1, "f %d %d %d")


def _write_stl(mesh: Mesh, file: IO[bytes]) -> None:
    vertices, faces = mesh.vertices, mesh.faces
    file.write(b"binary STL of outcrop".ljust(80))
    file.write(np.uint32(len(faces)).tobytes())
    row = np.dtype([("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    for start in range(0, len(faces), _CHUNK):
        corners = vertices[faces[start : start + _CHUNK]].astype(np.float64)
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        rows = np.zeros(len(corners), row)
        rows["corners"] = corners
        rows["normal"] = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)
        file.write(rows.tobytes())
