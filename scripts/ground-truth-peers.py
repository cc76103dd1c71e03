"""Open3D's methods, for scripts/ground-truth.

usage: ground-truth-peers.py normals tree|up CLOUD.ply OUT.ply
       ground-truth-peers.py poisson|bpa open|closed NORMALS.ply OUT.ply
       ground-truth-peers.py depth CLOUD.ply

normals: by principal components of 16 neighbours, turned by a spanning tree, or up. poisson: screened Poisson
surface with a finest cell of about one spacing; if it is open, trimmed where density is below depth - 2. bpa:
ball pivoting with radii of 1.5, 3 and 6 mean distances of neighbours. depth: prints that of the finest cell.
"""

import math
import sys

import numpy as np
import open3d as o3d


def depth_of(points):
    """Depth of an octree whose finest cell is about the spacing."""
    tree = o3d.geometry.KDTreeFlann(points)
    places = np.asarray(points.points)
    some = places[:: max(1, len(places) // 4096)]
    reach = [math.sqrt(tree.search_knn_vector_3d(place, 7)[2][6]) for place in some]
    spacing = float(np.median(reach)) * math.sqrt(math.pi / 6)
    extent = 1.1 * float((places.max(0) - places.min(0)).max())
    return min(max(math.ceil(math.log2(extent / (1.1 * spacing))), 6), 11)


def with_normals(points, direction):
    """The cloud with normals."""
    points.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(16))
    if direction == "up":
        points.orient_normals_to_align_with_direction([0.0, 0.0, 1.0])
        return points
    points.orient_normals_consistent_tangent_plane(12)
    highest = int(np.argmax(np.asarray(points.points)[:, 2]))
    if np.asarray(points.normals)[highest][2] < 0:
        points.normals = o3d.utility.Vector3dVector(-np.asarray(points.normals))
    return points


def poisson(points, surface):
    """Screened Poisson surface, trimmed if it is open."""
    depth = depth_of(points)
    mesh, density = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(points, depth=depth, n_threads=1)
    if surface == "open":
        mesh.remove_vertices_by_mask(np.asarray(density) < depth - 2)
    return mesh


def pivoted(points):
    """Ball pivoting."""
    mean = float(np.mean(points.compute_nearest_neighbor_distance()))
    radii = o3d.utility.DoubleVector([1.5 * mean, 3 * mean, 6 * mean])
    return o3d.geometry.TriangleMesh.create_from_point_cloud_ball_pivoting(points, radii)


def main():
    match sys.argv[1:]:
        case ["normals", ("tree" | "up") as direction, source, target]:
            cloud = with_normals(o3d.io.read_point_cloud(source), direction)
            done = o3d.io.write_point_cloud(target, cloud)
        case ["poisson", ("open" | "closed") as surface, source, target]:
            done = o3d.io.write_triangle_mesh(target, poisson(o3d.io.read_point_cloud(source), surface))
        case ["bpa", _, source, target]:
            done = o3d.io.write_triangle_mesh(target, pivoted(o3d.io.read_point_cloud(source)))
        case ["depth", source]:
            print(depth_of(o3d.io.read_point_cloud(source)))
            done = True
        case _:
            sys.exit(__doc__)
    if not done:
        sys.exit("the result cannot be written")


main()
