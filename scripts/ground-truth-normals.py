#!/usr/bin/env python3
"""Gives the points of a generated cloud the normals of the surface of which they are measurements.

usage: ground-truth-normals.py KIND SEEN.ply CLOUD.ply OUT.ply

KIND: true; noise (turned by a normal deviate of 10 degrees about a random axis); unsigned (every sign at
random); flipped (a fifth turned over). SEEN and CLOUD are written by cloudgen, as f64, with as many points.
Exit code: 0; 1 if the files do not fit together.
"""

import math
import random
import struct
import sys


def rows(path, columns):
    """The numbers of a binary PLY file of doubles."""
    with open(path, "rb") as file:
        header = b""
        while not header.endswith(b"end_header\n"):
            line = file.readline()
            if not line:
                sys.exit(f"{path} is no PLY file")
            header += line
        if header.count(b"property double ") != columns:
            sys.exit(f"{path} does not have {columns} doubles a point")
        return list(struct.iter_unpack(f"<{columns}d", file.read()))


def turned(normal, rng):
    """A direction at an angle of 10 degrees, times a normal deviate, to a normal."""
    while True:
        other = [rng.gauss(0, 1) for _ in range(3)]
        along = sum(a * b for a, b in zip(other, normal))
        across = [a - along * b for a, b in zip(other, normal)]
        length = math.hypot(*across)
        if length > 1e-6:
            break
    angle = math.radians(rng.gauss(0, 10))
    return [math.cos(angle) * n + math.sin(angle) / length * a for n, a in zip(normal, across)]


def main():
    if len(sys.argv) != 5 or sys.argv[1] not in ("true", "noise", "unsigned", "flipped"):
        sys.exit(__doc__)
    kind, seen, cloud, out = sys.argv[1:]
    places, points = rows(seen, 6), rows(cloud, 3)
    if len(places) != len(points):
        sys.exit(f"{len(points)} points, but {len(places)} places: some are no measurement of a surface")
    rng = random.Random(7)
    share = {"true": 0.0, "noise": 0.0, "unsigned": 0.5, "flipped": 0.2}[kind]
    with open(out, "wb") as file:
        names = "".join(f"property double {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
        head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n{names}end_header\n"
        file.write(head.encode())
        for place, point in zip(places, points):
            normal = turned(place[3:], rng) if kind == "noise" else place[3:]
            sign = -1 if rng.random() < share else 1
            file.write(struct.pack("<6d", *point, *(sign * n for n in normal)))


if __name__ == "__main__":
    main()
