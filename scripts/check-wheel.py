"""Uses the installed package in all its ways once; scripts/check-wheel runs it, and compares the meshes.

usage: check-wheel.py FOLDER, which has points.ply, and a folder "there" for results
"""

import os
import platform
import sys

import numpy as np
import outcrop

folder = sys.argv[1]
there = os.path.join(folder, "there")
print(f"Python {platform.python_version()} on {platform.system()} {platform.machine()}, numpy {np.__version__}")

# A cloud of a file, and the same as an array.
cloud = os.path.join(folder, "points.ply")
mesh = outcrop.reconstruct(cloud, output=os.path.join(there, "mesh.ply"), threads=2, memory="512MiB")
with open(cloud, "rb") as file:
    head, _, rows = file.read().partition(b"end_header\n")
kind, numbers = ("<f8", 8) if b"property double x" in head else ("<f4", 4)
points = np.frombuffer(rows, kind).reshape(-1, 3)
array = outcrop.reconstruct(points, output=os.path.join(there, "array.ply"))
assert len(mesh.faces) == len(array.faces) > 1000 and mesh.vertices.shape[1] == 3, mesh

# A temporary mesh goes with the last of its arrays.
temporary = outcrop.reconstruct(points)
place, faces = os.path.dirname(temporary.path), temporary.faces
assert np.array_equal(faces, mesh.faces)
del temporary
assert faces.max() < len(points)
del faces
assert not os.path.exists(place), os.listdir(place)

assert outcrop.verify(mesh)["manifold"]
assert "vertices" in outcrop.compare(mesh, points, samples=1000).text
outcrop.simplify(mesh, output=os.path.join(there, "small.ply"), ratio=0.3)
outcrop.tiles(mesh, output=os.path.join(there, "tiles"))
for name in ("mesh.glb", "mesh.stl", "mesh.obj"):
    mesh.save(os.path.join(there, name))
assert mesh.picture().startswith(b"\x89PNG")

# A run that is stopped goes on, with the points of an array.
def stop(stage: str, done: int, total: int) -> None:
    raise KeyboardInterrupt


output = os.path.join(there, "stopped.ply")
try:
    outcrop.reconstruct(points, output=output, progress=stop)
except KeyboardInterrupt:
    outcrop.reconstruct(points, output=output, resume=os.path.isdir(output + ".outcrop-scratch"))
with open(output, "rb") as one, open(mesh.path, "rb") as other:
    assert one.read() == other.read()
assert not [name for name in os.listdir(there) if "outcrop-" in name], os.listdir(there)

# Refusals, with the numbers of errors that Python knows.
try:
    outcrop.info(os.path.join(folder, "nothing.laz"))
except outcrop.FileError as error:
    assert error.errno == 2, error.errno
try:
    outcrop.reconstruct(points, method="no")
except outcrop.ParameterError:
    print("all functions work")
