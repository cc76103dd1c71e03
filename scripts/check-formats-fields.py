"""check-formats-fields.py OUTCROP: what files of other programs say of their columns, colours, systems and places,
in the mesh. Run by check-formats, in a folder of its own."""
import json, os, shutil, subprocess, sys, zipfile
import laspy, numpy as np, pandas, pyproj, trimesh
from plyfile import PlyData, PlyElement

try:
    import pye57
except Exception:
    pye57 = None

passed = failed = 0
random = np.random.default_rng(3)
side = np.arange(40) / 4
grid = np.stack([np.tile(side, 40), np.repeat(side, 40)], axis=1) + random.uniform(0, 0.05, (1600, 2))
places = np.column_stack([grid, np.sin(grid[:, 0]) + np.cos(grid[:, 1])]).round(3)
colours = random.integers(2, 256, places.shape)
XYZ, RGB = ["x", "y", "z"], ["red", "green", "blue"]


def check(what, good):
    global passed, failed
    passed, failed = passed + bool(good), failed + (not good)
    if not good:
        print("FAILED:", what)


def outcrop(*words):
    return subprocess.run([sys.argv[1], *words], capture_output=True, text=True)


def mesh(files, *options):
    """The vertices of the mesh, by their coordinates in thousandths; and what was said."""
    said = outcrop("reconstruct", *files, "-o", "fields.ply", "--smooth", "0", "--keep-all", *options)
    if said.returncode:
        return None, said.stderr
    return PlyData.read("fields.ply")["vertex"].data, said.stderr


def three(rows, names):
    return np.stack([rows[n].astype(float) for n in names], axis=1)


def same(what, files, places, columns, *options, said=""):
    """Columns of the mesh are those of the points, by position."""
    rows, err = mesh(files, *options)
    if rows is None:
        return check(f"{what}: {err}", False)
    key = lambda p: [tuple(row) for row in np.round(np.asarray(p) * 1000).astype(int)]
    wanted = dict(zip(key(places), np.stack(list(columns.values()), axis=1))) if columns else {}
    found = key(three(rows, XYZ))
    check(f"{what}: positions", set(found) <= set(key(places)) and len(found) > 0.9 * len(places))
    values = three(rows, columns) if columns else None
    check(f"{what}: values", not columns or all(
        np.array_equal(values[n], wanted[place]) for n, place in enumerate(found)))
    check(f"{what}: said {err!r}", said in err)


def las(path, places, colours):
    header = laspy.LasHeader(point_format=2, version="1.2")
    header.scales, header.offsets = [0.001] * 3, np.floor(places.min(axis=0))
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = places.T
    cloud.red, cloud.green, cloud.blue = np.asarray(colours, dtype=np.uint16).T
    cloud.write(path)
    return path


def ply(path, fields, comments=(), text=False):
    rows = np.empty(len(places), dtype=[(name, values.dtype) for name, values in fields.items()])
    for name, values in fields.items():
        rows[name] = values
    PlyData([PlyElement.describe(rows, "vertex")], text=text, comments=list(comments)).write(path)
    return path


xyz = {name: places[:, axis] for axis, name in enumerate(XYZ)}
rgb = {name: colours[:, axis] for axis, name in enumerate(RGB)}
KEEP = ["--attributes", "color"]

west, east = places[:, 0] < 5, places[:, 0] >= 5
for factor in 256, 257:
    tiles = [las("west.las", places[west], colours[west]), las("east.las", places[east], colours[east] * factor)]
    same(f"tiles of 8 and 16 bits, times {factor}", tiles, places, rgb, *KEEP, said="colours 8 bits in 1 file")
white = colours.copy()
white[7] = 65535
same("one white point", [las("white.las", places, white)], places,
     {n: np.minimum(white[:, k], 255) for k, n in enumerate(RGB)}, *KEEP, said="colours 8 bits")
floats = {n: (v / 255).astype(np.float32) for n, v in rgb.items()}
same("colours from 0 to 1", [ply("floats.ply", {**xyz, **floats})], places, rgb, *KEEP)

if pye57:
    path = "limits.e57"
    if os.path.exists(path):
        os.remove(path)
    with pye57.E57(path, mode="w") as file:
        data = {"cartesian" + n.upper(): xyz[n].copy() for n in XYZ}
        file.write_scan_raw({**data, **{"color" + n.capitalize(): v.astype(np.uint8) for n, v in rgb.items()}})
    same("E57 of pye57", [path], places, rgb, *KEEP)

number = np.arange(len(places), dtype=np.uint16)
same("a property X", [ply("extra.ply", {**xyz, "X": number})], places, {"extra_x": number}, "--attributes", "x")

classes = random.integers(0, 9, len(places)).astype(np.uint8)
for name in "classification", "scalar_Classification":
    path = ply("classes.ply", {**xyz, name: classes})
    same(f"classes in {name}", [path], places[classes == 6], {}, "--keep-classes", "6")

local = {n: v.astype(np.float32) for n, v in xyz.items()}
for beginning in "offset", "shift_":
    shift = dict(zip(XYZ, [635000, 848000, 400]))
    path = ply("moved.ply", local, [f"{beginning}{n} {v}" for n, v in shift.items()] + ["epsg 25832"], text=True)
    same(f"{beginning}x in comments", [path], places + np.array([635000, 848000, 400]), {})
    heads = open("fields.ply", "rb").read().partition(b"end_header")[0]
    check(f"{beginning}x: system", b"comment epsg 25832" in heads)

HARMONIC = 0.28209479177387814
splats = {f"f_dc_{k}": ((colours[:, k] / 255 - 0.5) / HARMONIC).astype(np.float32) for k in range(3)}
others = ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"]
splats.update({n: np.zeros(len(places), np.float32) for n in others})
same("splats", [ply("splats.ply", {**xyz, **splats})], places, rgb, *KEEP, said="Gaussian splats")

for kind in "f", "F":
    with open("cloud.pcd", "w") as file:
        file.write(f"FIELDS x y z\nSIZE 8 8 8\nTYPE {kind} {kind} {kind}\nPOINTS {len(places)}\nDATA ascii\n")
        np.savetxt(file, places, "%.3f")
    same(f"PCD of type {kind}", ["cloud.pcd"], places, {})

with zipfile.ZipFile("one.zip", "w", zipfile.ZIP_DEFLATED) as archive:
    archive.write("cloud.pcd")
    archive.writestr("readme.txt", "A cloud, by hand.\n")
same("one cloud in a ZIP archive", ["one.zip"], places, {})
with zipfile.ZipFile("two.zip", "w") as archive:
    archive.write("cloud.pcd")
    archive.write("splats.ply")
rows, err = mesh(["two.zip"])
check(f"two clouds in a ZIP archive: {err}", rows is None and "cloud.pcd" in err and "splats.ply" in err)

# Text, as pandas and numpy write it.
table = pandas.DataFrame({**xyz, **rgb})
table.to_csv("index.csv")
same("a CSV file with an index", ["index.csv"], places, rgb, *KEEP)
for separator in ",;\t":
    named = table.rename(columns={"x": "Easting [m]", "y": "Northing [m]", "z": "Height"})
    named.insert(0, "Point ID", range(len(named)))
    named[["Point ID", "Northing [m]", "Easting [m]", "Height", *RGB]].to_csv("named.csv", sep=separator, index=False)
    same(f"northing before easting, {separator!r}", ["named.csv"], places, rgb, *KEEP, said="columns 3, 2, 4")
table.assign(note='a, "b"').to_csv("quoted.csv", index=False, quoting=1)
same("a CSV file with quotes", ["quoted.csv"], places, rgb, *KEEP)
rows = np.hstack([places, colours])
six = ["%.3f"] * 3 + ["%d"] * 3
for what, head in ("names behind %", "% X Y Z R G B"), ("names behind //", "//X Y Z R G B"), ("no names", ""):
    np.savetxt("cloud.txt", rows, six, header=head, comments="")
    same(f"text, {what}", ["cloud.txt"], places, rgb, *KEEP)
with open("points3D.txt", "w") as file:
    file.write("# 3D point list with one line of data per point:\n")
    file.write("#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n")
    for number, row in enumerate(rows):
        track = " 1 2" * (1 + number % 4)
        file.write("%d %.3f %.3f %.3f %d %d %d 0.5" % (number, *row) + track + "\n")
same("points of COLMAP", ["points3D.txt"], places, rgb, *KEEP)
same("given columns", ["points3D.txt"], places, rgb, *KEEP, "--columns", "-,x,y,z,r,g,b", "--skip-lines", "2")
np.savetxt("unknown.csv", rows[:, :3], "%.3f", delimiter=",", header="alpha,beta,gamma", comments="")
rows_, err = mesh(["unknown.csv"])
check(f"unknown names: {err}", rows_ is None and "--columns" in err and "beta" in err)

faces = np.stack([np.arange(0, 1500), np.arange(1, 1501), np.arange(2, 1502)], axis=1)
shape = trimesh.Trimesh(places, faces, process=False)
shape.export("shape.off", digits=3)
same("OFF of trimesh", ["shape.off"], places, {})

# Of a folder only scans are read.
os.mkdir("folder")
las("folder/scan.las", places, colours)
shape.export("folder/mesh.ply")
np.savetxt("folder/matrix.txt", np.eye(4))
shutil.copy("folder/scan.las", "folder/scan.las.bak")
same("a folder", ["folder"], places, rgb, *KEEP, said="left out 3 files")

# Reference systems, against pyproj.


def globe(system, middle, metre=1.0):
    """Where `tiles --geo` puts a cloud around this middle, and where it is; heights are in units of so many metres."""
    header = laspy.LasHeader(point_format=6, version="1.4")
    crs = pyproj.CRS.from_user_input(system)
    header.add_crs(crs)
    header.scales, header.offsets = [0.001] * 3, middle
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = (places + middle).T
    cloud.write("globe.las")
    said = outcrop("reconstruct", "globe.las", "-o", "globe.ply", "--quiet")
    shutil.rmtree("tiles", ignore_errors=True)
    said = outcrop("tiles", "globe.ply", "-o", "tiles", "--geo", "--quiet")
    if said.returncode:
        return check(f"{system}: {said.stderr}", False)
    root = json.load(open("tiles/tileset.json"))["root"]
    matrix = np.array(root.get("transform", np.eye(4).ravel())).reshape(4, 4).T
    center = matrix @ [*root["boundingVolume"]["box"][:3], 1]
    want = middle + (places.min(axis=0) + places.max(axis=0)) / 2
    if not crs.is_geocentric:
        # Heights are taken for those over the ellipsoid.
        plane = crs.sub_crs_list[0] if crs.sub_crs_list else crs
        want[2] *= metre
        want = pyproj.Transformer.from_crs(plane.to_3d(), "EPSG:4978", always_xy=True).transform(*want)
    off = np.linalg.norm(center[:3] - want)
    # Bounds are of the mesh.
    check(f"{system}: {off} m off", off < 2)


survey_foot = 1200 / 3937
globe("EPSG:25832", [635000, 5848000, 400])
globe("EPSG:25832+7837", [635000, 5848000, 400])
globe("EPSG:6543", [2050000, 640000, 400], survey_foot)
globe("EPSG:6543+5703", [2050000, 640000, 400])
globe("EPSG:6543+6360", [2050000, 640000, 400], survey_foot)
globe("EPSG:4978", [3.8e6, 9e5, 5.0e6])

# Meshes near zero say where they are.
moved = las("moved.las", places + [634000, 5847000, 0], colours)
for name in "moved.glb", "moved.obj":
    shutil.rmtree("origin.json", ignore_errors=True)
    said = outcrop("reconstruct", moved, "-o", name, "--origin", "auto", "--smooth", "0", "--quiet")
    scene = trimesh.load(name, process=False, force="scene")
    ends = scene.bounds
    check(f"{name} with --origin: {ends} {said.stderr}", np.abs(ends).max() < 1000 + 12)

if pye57:
    # A room of five metres, seen from its middle.
    far, half = [500000.0, 5400000.0, 300.0], 2.5
    wall = random.uniform(-half, half, (20000, 3))
    axis, end = random.integers(0, 3, len(wall)), random.integers(0, 2, len(wall))
    wall[np.arange(len(wall)), axis] = np.where(end, half, -half)
    if os.path.exists("room.e57"):
        os.remove("room.e57")
    with pye57.E57("room.e57", mode="w") as file:
        data = {"cartesian" + n.upper(): np.ascontiguousarray(wall[:, k]) for k, n in enumerate(XYZ)}
        # Records in a grid were seen from the origin of the scan.
        places_in_grid = {"rowIndex": np.arange(len(wall)) // 200, "columnIndex": np.arange(len(wall)) % 200}
        data.update({name: value.astype(np.int32) for name, value in places_in_grid.items()})
        file.write_scan_raw(data, translation=np.array(far))
    said = outcrop("reconstruct", "room.e57", "-o", "room.ply")
    room = trimesh.load("room.ply", process=False)
    toward = far - room.triangles_center
    inward = (np.einsum("ij,ij->i", toward, room.face_normals) > 0).mean()
    check(f"a room in national coordinates: {inward} of it faces the scanner, {said.stderr}", inward > 0.99)

print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
