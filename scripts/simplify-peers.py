#!/usr/bin/env python3
"""Simplifies a mesh by outcrop, PyMeshLab and meshoptimizer, and measures the distances to it.

usage: simplify-peers.py MESH.ply RATIO [OUTCROP]

MESH.ply is a binary PLY mesh of triangles, RATIO the part of them that is kept, OUTCROP the program
(target/release/outcrop). Peers that are not installed (pip install pymeshlab meshoptimizer numpy) are left out. Prints
for each: triangles, mean, root mean square and 99.9th percentile of the distance both ways, seconds."""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path


def without_origin(mesh: Path, copy: Path) -> None:
    """Copies a mesh without the origin of its coordinates, which peers do not know."""
    content = mesh.read_bytes()
    end = content.index(b"end_header")
    lines = content[:end].splitlines(keepends=True)
    kept = [line for line in lines if not line.startswith(b"comment offset")]
    copy.write_bytes(b"".join(kept) + content[end:])


def by_pymeshlab(mesh: Path, ratio: float, output: Path) -> float:
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(mesh))
    wanted = int(meshes.current_mesh().face_number() * ratio)
    start = time.time()
    meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=wanted)
    seconds = time.time() - start
    meshes.save_current_mesh(str(output))
    return seconds


def by_meshoptimizer(mesh: Path, ratio: float, output: Path) -> float:
    import meshoptimizer
    import numpy
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(mesh))
    positions = meshes.current_mesh().vertex_matrix()
    corner = positions.min(0)
    local = numpy.ascontiguousarray((positions - corner).astype(numpy.float32))
    indices = meshes.current_mesh().face_matrix().astype(numpy.uint32).ravel()
    made = numpy.zeros_like(indices)
    wanted = int(len(indices) * ratio) // 3 * 3
    start = time.time()
    count = meshoptimizer.simplify(
        made, indices, local, target_index_count=wanted, target_error=1e10
    )
    seconds = time.time() - start
    triangles = made[:count].reshape(-1, 3).astype(numpy.int32)
    simple = pymeshlab.MeshSet()
    simple.add_mesh(pymeshlab.Mesh(local.astype(numpy.float64) + corner, triangles))
    simple.meshing_remove_unreferenced_vertices()
    simple.save_current_mesh(str(output))
    return seconds


def main() -> None:
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    mesh, ratio = Path(sys.argv[1]), float(sys.argv[2])
    program = sys.argv[3] if len(sys.argv) == 4 else "target/release/outcrop"

    def by_outcrop(mesh: Path, ratio: float, output: Path) -> float:
        start = time.time()
        command = [program, "simplify", mesh, "-o", output, "--ratio", str(ratio)]
        subprocess.run([*command, "--samples", "0", "--quiet"], check=True, stdout=subprocess.DEVNULL)
        return time.time() - start

    with tempfile.TemporaryDirectory() as folder:
        copy, output = Path(folder, "mesh.ply"), Path(folder, "simple.ply")
        without_origin(mesh, copy)
        for simplify in (by_outcrop, by_pymeshlab, by_meshoptimizer):
            name = simplify.__name__.removeprefix("by_")
            try:
                seconds = simplify(copy, ratio, output)
            except ImportError as missing:
                print(f"{name}: skipped: {missing}")
                continue
            command = [program, "compare", copy, output, "--json", "--quiet"]
            found = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
            both, triangles = found["symmetric"], found["b"]["triangles"]
            print(
                f"{name}: {triangles} triangles, mean {both['mean']:.4g}, rms {both['rms']:.4g}, "
                f"99.9 % {both['p99_9']:.4g}, {seconds:.1f} s"
            )


main()
