"""A program with types, for mypy --strict: a plane of points, its mesh, and what is known of it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

import outcrop


def told(stage: str, done: int, total: int) -> None:
    print(stage, done, total)


def area(points: npt.NDArray[np.float64]) -> float:
    try:
        mesh = outcrop.reconstruct(points, memory="256MiB", radius="auto", crop=[0, 0, 9, 9], progress=told)
    except (outcrop.InputError, outcrop.BudgetError) as error:
        print(error, error.can_resume)
        return 0.0
    faces: npt.NDArray[np.uint32] = mesh.faces
    corners = mesh.vertices[faces]
    sides = corners[:, 1:] - corners[:, :1]
    assert outcrop.verify(mesh)["manifold"]
    return float(np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2)


if __name__ == "__main__":
    print(area(np.random.default_rng(1).random((1000, 3)) * [10, 10, 0]))
