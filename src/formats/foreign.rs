//! Files that are no point cloud that is read, but are known: what they are, and what to do.

use super::point_format::{Head, has_extension};

/// What a file is, and what to do with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Known {
    pub(super) what: &'static str,
    pub(super) advice: &'static str,
}

/// The first line of a pointer.
const POINTER: &[u8] = b"version https://git-lfs.github.com/spec/v";

/// A file in the place of another one, which is not a format at all.
pub(super) fn stand_in(head: &[u8]) -> Option<Known> {
    head.starts_with(POINTER).then_some(Known {
        what: "a pointer of Git LFS in the place of the file",
        advice: "get the file itself by \"git lfs pull\"",
    })
}

const RECAP: &str = "export E57 or PTS from ReCap";
const FARO: &str = "export E57 from SCENE";
const LEICA: &str = "export E57, PTX or LAS from Cyclone";
const TRIMBLE: &str = "export E57 or LAS from RealWorks";
const RIEGL: &str = "export LAZ or E57 from RiSCAN PRO or RiPROCESS";
const TOPCON: &str = "export E57 or LAS from MAGNET Collage";
const MESH: &str = "it is a model, not points: save PLY, of which the vertices are read";
const MODEL: &str = "export its points as PLY, or as text with x, y and z";
const SPLATS: &str = "save the splats as PLY";
const ARRAY: &str = "write the points as PLY, LAS, or text with x, y and z";
const ROBOT: &str = "export PCD or PLY, as with bag_to_pcd of pcl_ros";
const SENSOR: &str = "export PCD, LAS or CSV from the viewer of the sensor";
const UNPACK: &str = "unpack it, and give its files or their folder";
const RASTER: &str = "turn it into points, as with gdal_translate -of XYZ";
const TABLE: &str = "save the sheet as CSV";

/// Formats by the first bytes of their files.
const SIGNATURES: [(&[u8], &str, &str); 18] = [
    (
        b"CCB2",
        "a file of CloudCompare",
        "save PLY, LAS or E57 there",
    ),
    (b"AC10", "an AutoCAD drawing", MODEL),
    (b"3D Geometry File Format", "a Rhino model", MODEL),
    (b"\xff\xfe\xffSketchUp", "a SketchUp model", MODEL),
    (b"glTF", "GLB", MESH),
    (b"Kaydara FBX Binary", "FBX", MESH),
    (b"BLENDER", "a Blender file", MESH),
    (b"\x89HDF", "HDF5", ARRAY),
    (b"\x93NUMPY", "a NumPy array", ARRAY),
    (b"#ROSBAG", "a ROS bag", ROBOT),
    (b"\x89MCAP", "an MCAP log", ROBOT),
    (b"II*\0", "a TIFF picture", RASTER),
    (b"MM\0*", "a TIFF picture", RASTER),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", UNPACK),
    (b"Rar!", "a RAR archive", UNPACK),
    (b"\xfd7zXZ", "a file compressed by xz", UNPACK),
    (b"BZh", "a file compressed by bzip2", UNPACK),
    (b"livox_tech", "a recording of Livox", SENSOR),
];

/// Formats by the extensions of their files.
const EXTENSIONS: [(&[&str], &str, &str); 38] = [
    (&["rcp"], "a ReCap project", RECAP),
    (&["rcs"], "a ReCap scan", RECAP),
    (&["pcg"], "an Autodesk point cloud", RECAP),
    (&["fls"], "a FARO scan", FARO),
    (&["fws", "lsproj"], "a FARO project", FARO),
    (
        &["zfs", "zfprj", "zfc"],
        "a Z+F scan",
        "export E57 or PTX from LaserControl",
    ),
    (&["imp"], "a Leica Cyclone database", LEICA),
    (&["lgs", "lgsx"], "a Leica LGS file", LEICA),
    (&["ptg", "ptb", "coe"], "a file of Leica Cyclone", LEICA),
    (
        &["pod"],
        "a Bentley Pointools file",
        "export E57 or LAS from Pointools",
    ),
    (
        &["rwp", "rwi", "rwcx"],
        "a Trimble RealWorks project",
        TRIMBLE,
    ),
    (&["tzf", "tzs", "tdx", "tcpsj"], "a Trimble scan", TRIMBLE),
    (&["rxp", "rdb", "rdbx", "rsp", "3dd"], "a RIEGL scan", RIEGL),
    (&["cl3", "clr", "mjf"], "a file of Topcon", TOPCON),
    (
        &["psx", "psz"],
        "a Metashape project",
        "export LAS, E57 or PLY from Metashape",
    ),
    (
        &["rcproj", "rsproj"],
        "a RealityScan project",
        "export LAS, E57 or XYZ from RealityScan",
    ),
    (
        &["bin"],
        "binary data of an unknown kind",
        "if CloudCompare reads it, save PLY or LAS there",
    ),
    (&["3dm"], "a Rhino model", MODEL),
    (&["dwg", "dxf"], "an AutoCAD drawing", MODEL),
    (&["dgn"], "a MicroStation design", MODEL),
    (&["skp"], "a SketchUp model", MODEL),
    (&["rvt", "ifc"], "a building model", MODEL),
    (
        &["step", "stp", "iges", "igs", "sldprt", "x_t"],
        "a solid model",
        MODEL,
    ),
    (&["obj"], "OBJ", MESH),
    (&["stl"], "STL", MESH),
    (
        &[
            "glb", "gltf", "fbx", "dae", "3ds", "3mf", "usd", "usdz", "blend",
        ],
        "a model",
        MESH,
    ),
    (
        &["splat", "ksplat", "spz", "sog"],
        "Gaussian splats",
        SPLATS,
    ),
    (
        &["npy", "npz", "mat", "h5", "hdf5", "pkl", "parquet"],
        "a file of arrays",
        ARRAY,
    ),
    (&["bag", "db3", "mcap"], "a ROS recording", ROBOT),
    (
        &["pcap", "pcapng", "lvx", "lvx2"],
        "a recording of a sensor",
        SENSOR,
    ),
    (
        &["7z", "rar", "tar", "tgz", "bz2", "xz"],
        "an archive",
        UNPACK,
    ),
    (
        &["tif", "tiff", "img", "hgt", "vrt"],
        "a picture or a grid of heights",
        RASTER,
    ),
    (&["shp", "gpkg", "kml", "kmz"], "a file of maps", MODEL),
    (&["xls", "xlsx", "ods"], "a sheet", TABLE),
    (
        &["slpk", "b3dm", "pnts"],
        "a tile for viewers",
        "use the cloud that it was made from",
    ),
    (
        &["ept", "nsp"],
        "an index of a cloud",
        "give the files of the cloud, or their folder",
    ),
    (
        &["vtk", "vtp", "vtu"],
        "a VTK file",
        "save PLY or CSV in ParaView",
    ),
    (
        &["sdc", "bpf"],
        "a file of laser points",
        "turn it into LAZ, as with pdal translate",
    ),
];

/// What a file is that no format recognised, by its first bytes, or else by its name.
pub(super) fn known(head: &Head) -> Option<Known> {
    let known = |(what, advice)| Known { what, advice };
    let by_bytes = SIGNATURES.iter().find(|s| head.bytes.starts_with(s.0));
    let by_name = || EXTENSIONS.iter().find(|e| has_extension(&head.path, e.0));
    let found = by_bytes.map(|s| (s.1, s.2));
    found.or_else(|| by_name().map(|e| (e.1, e.2))).map(known)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(path: &str, bytes: &[u8]) -> Head {
        Head {
            path: path.into(),
            bytes: bytes.into(),
            whole: true,
            layout: crate::Layout::default(),
        }
    }

    #[test]
    fn bytes_go_before_names_and_no_name_is_there_twice() {
        let what = |path, bytes: &[u8]| known(&head(path, bytes)).map(|known| known.what);
        assert_eq!(what("a.RCP", b"\0\x01"), Some("a ReCap project"));
        assert_eq!(what("a.fls", b"glTF\x02"), Some("GLB"));
        assert_eq!(what("a", b"7z\xbc\xaf\x27\x1c"), Some("a 7z archive"));
        assert_eq!(what("a.dat", b"\0\x01"), None);
        let mut names: Vec<&str> = EXTENSIONS.iter().flat_map(|e| e.0).copied().collect();
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count);
    }
}
