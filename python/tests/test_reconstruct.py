"""Meshes from arrays and files, and arrays from meshes."""

from __future__ import annotations

import gc
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import Points, bumps, write_ply

import outcrop

MEMORY = "256MiB"


def test_an_array_gives_the_mesh_of_the_command_line(points: Points, tmp_path: Path, program: Any) -> None:
    height = np.arange(len(points), dtype=np.float32)
    cloud = write_ply(tmp_path / "cloud.ply", points, height=height)
    told = tmp_path / "told.ply"
    done = program("reconstruct", cloud, "-o", told, "--memory", MEMORY, "--attributes", "height", "--smooth", 1)
    assert done.returncode == 0, done.stderr
    mesh = outcrop.reconstruct(
        points, output=tmp_path / "mesh.ply", columns={"height": height}, smooth=1, memory=MEMORY, threads=1
    )
    assert (tmp_path / "mesh.ply").read_bytes() == told.read_bytes()
    assert sorted(os.listdir(tmp_path)) == ["cloud.ply", "mesh.ply", "told.ply"]
    file = outcrop.reconstruct([cloud], attributes=["height"], smooth=1, memory=256 << 20)
    assert Path(file.path).read_bytes() == told.read_bytes()
    assert mesh.report["mesh"] == file.report["mesh"]


def test_arrays_of_a_mesh_are_views_of_its_file(points: Points) -> None:
    mesh = outcrop.reconstruct(points, memory=MEMORY)
    vertices, faces = mesh.vertices, mesh.faces
    assert vertices.shape == (5000, 3) and faces.shape[1:] == (3,) and faces.dtype == np.uint32
    assert len(faces) == mesh.report["mesh"]["triangles"] and faces.max() < len(vertices)
    assert not vertices.flags.owndata and not faces.flags.owndata and not vertices.flags.writeable
    assert np.shares_memory(vertices, mesh.vertices)
    # Vertices are points of the cloud.
    assert {tuple(p) for p in np.round(vertices.astype(float), 4)} == {tuple(p) for p in points}
    assert mesh.columns == {} and mesh.colors is None and mesh.normals is None
    assert mesh.origin is None and mesh.crs is None and mesh.report["version"] == outcrop.__version__
    assert repr(mesh).startswith("<Mesh mesh.ply: 5000 vertices")


def test_colours_and_columns_follow_their_points(points: Points) -> None:
    colors = (np.arange(len(points) * 3).reshape(-1, 3) * 5 % 251).astype(np.uint8)
    number = np.arange(len(points), dtype=np.int64)
    mesh = outcrop.reconstruct(points, colors=colors, columns={"number": number}, normals=True, memory=MEMORY)
    at = mesh.columns["number"].astype(int)
    assert np.allclose(mesh.vertices, points[at], atol=1e-5)
    assert mesh.colors is not None and mesh.colors.dtype == np.uint8
    assert (mesh.colors == colors[at]).all() and np.shares_memory(mesh.colors, mesh.columns["red"])
    assert mesh.normals is not None and (np.einsum("ij,ij->i", mesh.normals, points[at]) > 0).mean() > 0.99
    wide = outcrop.reconstruct(points, colors=colors.astype(np.uint16) * 257, wide_colors=True, memory=MEMORY)
    assert wide.colors is not None and wide.colors.dtype == np.uint16


@pytest.mark.parametrize("dtype", ["f4", "f8", ">f8", "i2", "i4", "i8", "u8", "f2"])
def test_types_of_numbers(dtype: str) -> None:
    random = np.random.default_rng(3)
    plane = np.stack([*random.integers(0, 1000, (2, 500)), np.zeros(500)], axis=1)
    mesh = outcrop.reconstruct(plane.astype(dtype), memory=MEMORY)
    assert {tuple(p) for p in mesh.vertices} <= {tuple(p) for p in plane.astype(dtype).astype(float)}
    strided = np.asfortranarray(plane.astype(dtype))[::-1]
    again = outcrop.reconstruct(strided, memory=MEMORY)
    assert Path(again.path).read_bytes() == Path(mesh.path).read_bytes()


def test_far_coordinates_are_doubles_or_have_an_origin(points: Points) -> None:
    far = points + [635_000, 848_000, 0]
    mesh = outcrop.reconstruct(far, memory=MEMORY)
    assert mesh.vertices.dtype == np.float64
    moved = outcrop.reconstruct(far, origin=(635_000, 848_000, 0), memory=MEMORY)
    assert moved.origin == (635_000, 848_000, 0)
    assert np.allclose(moved.vertices + moved.origin, mesh.vertices, atol=1e-6)
    assert tuple(moved.report["origin"]) == moved.origin


def test_a_temporary_mesh_goes_with_its_object(points: Points) -> None:
    mesh = outcrop.reconstruct(points, memory=MEMORY)
    path, vertices = mesh.path, mesh.vertices
    total = float(vertices.sum())
    assert os.listdir(os.path.dirname(path)) == ["mesh.ply"]
    del mesh
    gc.collect()
    assert not os.path.exists(os.path.dirname(path))
    assert float(vertices.sum()) == total


def test_saved_meshes(points: Points, tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    colors = np.full((len(points), 3), 90, np.uint8)
    mesh = outcrop.reconstruct(points, colors=colors, memory=MEMORY)
    for extension in ["ply", "obj", "stl"]:
        mesh.save(tmp_path / f"saved.{extension}")
        read = trimesh.load(tmp_path / f"saved.{extension}", process=False)
        assert np.allclose(read.triangles, mesh.vertices[mesh.faces], atol=1e-6), extension
    with pytest.raises(outcrop.ParameterError, match="saved.off"):
        mesh.save(tmp_path / "saved.off")
    held = mesh.to_trimesh()
    assert (held.faces == mesh.faces).all() and (held.visual.vertex_colors[:, :3] == 90).all()
    opened = outcrop.Mesh(tmp_path / "saved.ply")
    assert (opened.faces == mesh.faces).all() and opened.report == {}


def test_a_saved_glb_is_that_of_a_run(points: Points, tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    random = np.random.default_rng(1)
    colors = random.integers(0, 256, (len(points), 3)).astype(np.uint8)
    far = points + [635_000, 848_000, 0]
    cases: list[tuple[str, Points, dict[str, Any]]] = [
        ("near", points, {"colors": colors, "normals": True}),
        ("far", far, {"colors": colors}),
        ("wide", points, {"colors": colors.astype(np.uint16) * 257, "wide_colors": True}),
        ("moved", far, {"origin": (635_000, 848_000, 0), "normals": True}),
    ]
    for name, cloud, options in cases:
        mesh = outcrop.reconstruct(cloud, memory=MEMORY, **options)
        mesh.save(tmp_path / f"{name}.glb")
        outcrop.reconstruct(cloud, output=tmp_path / "run.glb", memory=MEMORY, **options)
        assert (tmp_path / f"{name}.glb").read_bytes() == (tmp_path / "run.glb").read_bytes(), name
        scene = trimesh.load(tmp_path / f"{name}.glb", process=False)
        (part,) = scene.geometry.values()
        assert (part.faces == mesh.faces).all()
    # Nothing is left beside them but the origin of the last run.
    names = ["far.glb", "moved.glb", "near.glb", "run.glb", "run.origin.json", "wide.glb"]
    assert sorted(os.listdir(tmp_path)) == names
    other = outcrop.reconstruct(points, output=tmp_path / "mesh.obj", memory=MEMORY)
    with pytest.raises(outcrop.InputError, match="mesh.obj"):
        other.save(tmp_path / "no.glb")
    with pytest.raises(outcrop.FileError, match="absent"):
        mesh.save(tmp_path / "absent" / "no.glb")


def test_what_is_not_installed_is_named(points: Points, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = outcrop.reconstruct(points, memory=MEMORY)
    for name in ["trimesh", "open3d"]:
        monkeypatch.setitem(sys.modules, name, None)
        with pytest.raises(ImportError, match=f"pip install {name}"):
            getattr(mesh, f"to_{name}")()


def test_a_mesh_in_open3d(points: Points) -> None:
    pytest.importorskip("open3d")
    colors = np.full((len(points), 3), [10, 20, 250], np.uint8)
    mesh = outcrop.reconstruct(points, colors=colors, memory=MEMORY)
    held = mesh.to_open3d()
    assert (np.asarray(held.triangles) == mesh.faces).all() and (np.asarray(held.vertices) == mesh.vertices).all()
    assert np.allclose(np.asarray(held.vertex_colors) * 255, colors[0])


def test_the_reference_system_is_known(points: Points, tmp_path: Path) -> None:
    cloud = write_ply(tmp_path / "cloud.ply", points)
    (tmp_path / "cloud.prj").write_text('PROJCS["somewhere",UNIT["metre",1]]')
    mesh = outcrop.reconstruct(cloud, output=tmp_path / "mesh.ply", memory=MEMORY)
    assert mesh.crs is not None and mesh.crs.startswith("somewhere")


def test_other_formats_have_no_arrays(points: Points, tmp_path: Path) -> None:
    mesh = outcrop.reconstruct(points, output=tmp_path / "mesh.obj", memory=MEMORY)
    assert os.path.getsize(mesh.path) > 0 and mesh.report["mesh"]["vertices"] == 5000
    with pytest.raises(outcrop.InputError, match="mesh.obj"):
        mesh.vertices
    assert "mesh.obj" in repr(mesh) and "mesh.obj" in mesh._repr_html_()
    tileset = outcrop.reconstruct(points, output=tmp_path / "town" / "tileset.json", memory=MEMORY)
    assert tileset.report["tiles"]["triangles"] > 0
    assert sorted(os.listdir(tmp_path)) == ["mesh.obj", "town"]


def test_a_mesh_in_a_notebook(points: Points) -> None:
    mesh = outcrop.reconstruct(points, memory=MEMORY)
    assert mesh.picture().startswith(b"\x89PNG")
    shown = mesh._repr_html_()
    assert "data:image/png;base64," in shown and len(shown) < 1 << 20


def test_other_commands(points: Points, tmp_path: Path, program: Any) -> None:
    mesh = outcrop.reconstruct(points, output=tmp_path / "mesh.ply", memory=MEMORY)
    verdict = outcrop.verify(mesh, memory=MEMORY)
    assert verdict["manifold"] is True and verdict["vertices"] == 5000
    assert str(verdict) == program("verify", mesh.path).stdout.rstrip("\n")
    described = outcrop.info(points, memory=MEMORY)
    assert described["points"] == 5000 and "spacing" in str(described)
    distance = outcrop.compare(mesh, points, samples=1000, memory=MEMORY)
    again = outcrop.compare(mesh.path, points, samples=1e3, memory=MEMORY)
    assert distance["a_to_b"] == again["a_to_b"]
    found = outcrop.volume(mesh, memory=MEMORY)
    assert str(found) == program("volume", mesh.path).stdout.rstrip("\n")
    assert found["body"]["volume"] == pytest.approx(verdict["volume"], rel=1e-12)
    above = outcrop.volume(mesh, above=0.5, crop=[-2, -2, 2, 2], memory=MEMORY)["earth"]
    assert above["above"] > 0 > above["below"] and above["is_closed"]
    assert outcrop.volume(mesh, above=mesh, memory=MEMORY)["earth"]["net"] == pytest.approx(0, abs=1e-9)
    heights = outcrop.raster(mesh, output=tmp_path / "dem.tif", cell=0.1, contours=0.25, memory=MEMORY)
    assert heights["cells"] > 0 and (tmp_path / "dem.tif").stat().st_size == heights["bytes"]
    assert heights["contours"]["path"] == str(tmp_path / "dem-contours.geojson")
    assert outcrop.raster(points, output=tmp_path / "points.tif", cell=0.1, memory=MEMORY)["source"]["points"] == 5000
    made = outcrop.tiles(mesh, output=tmp_path / "levels", memory=MEMORY)
    assert made["triangles"] == verdict["triangles"] and (tmp_path / "levels" / "tileset.json").exists()


def test_a_mesh_with_fewer_triangles(points: Points, tmp_path: Path, program: Any) -> None:
    mesh = outcrop.reconstruct(points, output=tmp_path / "mesh.ply", memory=MEMORY)
    made = outcrop.simplify(mesh, output=tmp_path / "small.ply", ratio=0.1, samples=1000, memory=MEMORY)
    small = outcrop.Mesh(tmp_path / "small.ply")
    assert made["triangles"] == len(small.faces) and made["goal"] == {"ratio": 0.1}
    assert 0.09 < len(small.faces) / len(mesh.faces) <= 0.1
    assert outcrop.verify(small, memory=MEMORY)["manifold"] is True
    assert 0 < made["measured"]["symmetric"]["mean"] < 0.1
    words = ["--ratio", "0.1", "--samples", "1000", "--memory", MEMORY]
    said = program("simplify", mesh.path, "-o", tmp_path / "again.ply", *words).stdout
    assert said.rstrip("\n") == str(made)
    assert (tmp_path / "again.ply").read_bytes() == (tmp_path / "small.ply").read_bytes()
    closer = outcrop.simplify(mesh.path, output=tmp_path / "small.obj", error=0.01, memory=MEMORY)
    assert 0 < closer["measured"]["symmetric"]["mean"] < 0.01 and closer["triangles"] > made["triangles"]
    with pytest.warns(outcrop.OutcropWarning, match="STL (holds|has) 32-bit floats"):
        unmeasured = outcrop.simplify(mesh.path, output=tmp_path / "small.stl", ratio=0.1, memory=MEMORY)
    assert unmeasured["measured"] is None
    fewest = outcrop.simplify(mesh, output=tmp_path / "small.ply", triangles=2e2, keep_boundary=True, memory=MEMORY)
    assert fewest["goal"] == {"triangles": 200} and 190 < fewest["triangles"] <= 200
    wrong: list[tuple[str, dict[str, Any]]] = [
        ("not provided: triangles or ratio or error$", {}),
        ("ratio.* cannot be used with .*error", {"ratio": 0.1, "error": 0.01}),
        ("^ratio: 2 is not valid", {"ratio": 2.0}),
    ]
    for why, goals in wrong:
        with pytest.raises(outcrop.ParameterError, match=why):
            outcrop.simplify(mesh, output=tmp_path / "none.ply", memory=MEMORY, **goals)
    assert not (tmp_path / "none.ply").exists()


def test_a_closed_mesh(points: Points, tmp_path: Path, program: Any) -> None:
    # A sphere without its lowest part.
    mesh = outcrop.reconstruct(points[points[:, 2] > -5], output=tmp_path / "mesh.ply", memory=MEMORY)
    made = outcrop.close(mesh, output=tmp_path / "closed.ply", kind="base", memory=MEMORY)
    verdict = outcrop.verify(tmp_path / "closed.ply", memory=MEMORY)
    assert verdict["manifold"] is True and verdict["closed"] is True and verdict["volume"] > 0
    filled = outcrop.Mesh(tmp_path / "closed.ply").filled
    assert filled is not None and filled.sum() == made["triangles"] - made["triangles_before"]
    assert mesh.filled is None
    assert made["kind"] == {"base": None} and made["closed"]["base"]["loops"] == 1
    said = program("close", mesh.path, "-o", tmp_path / "again.ply", "--kind", "base", "--memory", MEMORY).stdout
    assert said.rstrip("\n") == str(made)
    assert (tmp_path / "again.ply").read_bytes() == (tmp_path / "closed.ply").read_bytes()
    again = outcrop.reconstruct(points, output=tmp_path / "whole.ply", close="base", memory=MEMORY)
    assert outcrop.verify(again, memory=MEMORY)["closed"] is True
    small = outcrop.simplify(mesh, output=tmp_path / "small.ply", ratio=0.2, close=True, samples=0, memory=MEMORY)
    assert outcrop.verify(tmp_path / "small.ply", memory=MEMORY)["closed"] is True
    closed = small["closed"]["closed"]
    assert closed["lids"]["loops"] + closed["smooth"]["loops"] == 1
    with pytest.raises(outcrop.ParameterError, match="close"):
        outcrop.close(mesh, output=tmp_path / "none.ply", kind="base=1e9", memory=MEMORY)


def test_progress_is_told(points: Points) -> None:
    told: list[tuple[str, int, int]] = []

    def note(stage: str, done: int, total: int) -> None:
        told.append((stage, done, total))

    outcrop.reconstruct(points, memory=MEMORY, progress=note)
    stages = list(dict.fromkeys(stage for stage, _, _ in told))
    assert [s for s in stages if s in ("ingest", "order", "cells", "export")] == ["ingest", "order", "cells", "export"]
    ends = {stage: (done, total) for stage, done, total in told}
    assert ends["cells"] == (5000, 5000)


def test_bars_of_tqdm(points: Points, capfd: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("tqdm")
    outcrop.reconstruct(points, memory=MEMORY, progress=True)
    assert "cells" in capfd.readouterr().err
    outcrop.reconstruct(points, memory=MEMORY)
    assert capfd.readouterr().err == ""


def test_warnings_are_python_warnings(points: Points, tmp_path: Path) -> None:
    far = points + [635_000, 848_000, 0]
    with pytest.warns(outcrop.OutcropWarning, match='or give origin="auto"'):
        outcrop.reconstruct(far, output=tmp_path / "mesh.stl", memory=MEMORY)


def test_points_in_pieces_are_one_cloud(points: Points, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = outcrop.reconstruct(points, memory=MEMORY)
    monkeypatch.setattr("outcrop._points._CHUNK", 999)
    pieces = outcrop.reconstruct(points, memory=MEMORY)
    assert Path(whole.path).read_bytes() == Path(pieces.path).read_bytes()


def test_columns_of_all_types() -> None:
    cloud = bumps(1000)
    types = ["u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8", "?", "i8"]
    columns = {f"c_{n}": (np.arange(1000) % 100).astype(kind) for n, kind in enumerate(types)}
    mesh = outcrop.reconstruct(cloud, columns=columns, memory=MEMORY)
    assert list(mesh.columns) == list(columns)
    for name, values in columns.items():
        assert sorted(mesh.columns[name].astype(float)) == sorted(values.astype(float)), name


def test_columns_of_text_are_named(points: Points, tmp_path: Path) -> None:
    lines = [f"{number},{y!r},{x!r},{z!r},tree" for number, (x, y, z) in enumerate(points.astype(float).tolist())]
    path = tmp_path / "points.csv"
    path.write_text("a title of 2 lines\nof 2020\n" + "\n".join(lines) + "\n")
    mesh = outcrop.reconstruct(path, columns=["number", "y", "x", "z", "-"], skip_lines=2, memory=MEMORY)
    known = outcrop.info(path, columns="-,y,x,z", skip_lines=2)
    assert known["points"] == len(np.unique(points, axis=0))
    assert known["min"] == pytest.approx(points.min(axis=0).tolist()) and len(mesh.vertices) > 0
    with pytest.raises(outcrop.Error, match="columns"):
        outcrop.info(path, skip_lines=2)
    with pytest.raises(outcrop.Error, match="columns"):
        outcrop.reconstruct(points, columns="x,y,z")
