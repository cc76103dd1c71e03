//! The kinds of files and their makers.

use super::{archives, compressed, e57, las, off, pcd, ply, ptx, text};
use crate::ingest::bench::Bench;
use std::path::PathBuf;

/// Makes the files of a kind.
pub type Kind = fn(&Bench) -> Vec<PathBuf>;

/// All kinds.
pub const KINDS: &[(&str, Kind)] = &[
    ("LAS 1.0, point formats 0 and 1", |b| {
        las::all(b, &[0], 0..=1, "las")
    }),
    ("LAS 1.1, point formats 0 and 1", |b| {
        las::all(b, &[1], 0..=1, "las")
    }),
    ("LAS 1.2, point formats 0 to 3", |b| {
        las::all(b, &[2], 0..=3, "las")
    }),
    ("LAS 1.3, point formats 0 to 5", |b| {
        las::all(b, &[3], 0..=5, "las")
    }),
    ("LAS 1.4, point formats 0 to 10", |b| {
        las::all(b, &[4], 0..=10, "las")
    }),
    ("LAZ 1.0 to 1.3, point formats 0 to 5", las::old_laz),
    ("LAZ 1.4, point formats 0 to 10", |b| {
        las::all(b, &[4], 0..=10, "laz")
    }),
    ("COPC", las::copc),
    ("extra bytes, described or not", las::extra_bytes),
    (
        "a name that says LAS for LAZ, or the other way round",
        las::misnamed,
    ),
    (
        "LAZ whose chunk table is missing, chunks of one size or point formats 6 to 10",
        las::no_table,
    ),
    ("a box in the header that is wrong", las::boxes),
    ("bytes after the points", las::trailing),
    ("points flagged as withheld", las::withheld),
    ("no points", las::none),
    ("version 1.5", |b| las::patched(b, &[(25, &[5])])),
    ("a count of 0 in the header, and points", |b| {
        las::patched(b, &[(107, &[0; 4])])
    }),
    ("a count in the header that is too small", |b| {
        las::patched(b, &[(107, &[50, 0, 0, 0])])
    }),
    ("a negative scale", |b| {
        las::patched(b, &[(131, &(-0.01f64).to_le_bytes())])
    }),
    ("version 2.0", |b| las::patched(b, &[(24, &[2, 0])])),
    ("point format 42", |b| las::patched(b, &[(104, &[42])])),
    ("a record length below that of the point format", |b| {
        las::patched(b, &[(105, &[19, 0])])
    }),
    ("a scale that is 0 or not a number", |b| {
        let zero = las::patched(b, &[(139, &0f64.to_le_bytes())]);
        [zero, las::patched(b, &[(147, &f64::NAN.to_le_bytes())])].concat()
    }),
    ("an offset that is infinite", |b| {
        las::patched(b, &[(155, &f64::INFINITY.to_le_bytes())])
    }),
    ("points that start outside the file", |b| {
        let after = las::patched(b, &[(96, &u32::MAX.to_le_bytes())]);
        [after, las::patched(b, &[(96, &[10, 0, 0, 0])])].concat()
    }),
    ("a count in the header that is too large", las::too_many),
    ("LAS that ends early", |b| las::cut(b, "las", &[60, 99])),
    ("LAZ that ends early", |b| las::cut(b, "laz", &[60])),
    ("a header that ends early", las::short_header),
    ("a name that says LAS, and other content", |b| {
        vec![b.write("a.las", "1 2 3\n"), b.write("b.laz", [1, 2, 3])]
    }),
    ("LAZ without its laszip record", las::no_record),
    (
        "LAZ with chunks of different sizes and no chunk table, point formats 0 to 5",
        las::variable_without_table,
    ),
    (
        "LAZ that claims more points than its size allows",
        las::bomb,
    ),
    ("E57 with one scan or several, and poses", e57::scans),
    ("E57 with limits of colours", e57::limits),
    (
        "E57 with coordinates of every type, and spherical ones",
        e57::types,
    ),
    ("directions of an E57 scan without a point", e57::states),
    ("E57 of which all points are the same", e57::same),
    ("E57 without scans, or scans without points", e57::none),
    ("E57 that ends early", e57::cut),
    ("an E57 header that ends early", e57::short),
    ("another version, size of pages, or length", e57::headers),
    ("a page with a wrong checksum", e57::pages),
    ("an E57 description that is damaged", e57::descriptions),
    ("E57 records without coordinates", e57::no_coordinates),
    ("a pose that is none", e57::no_rotation),
    (
        "E57 that claims more points than there is room for",
        e57::bombs,
    ),
    ("two E57 scans with the same points", e57::shared),
    ("an E57 section that is damaged", e57::sections),
    ("E57 packets that are damaged", e57::packets),
    ("text, little-endian and big-endian", ply::bodies),
    (
        "coordinates that are `float`, `double` or whole numbers",
        ply::types,
    ),
    ("an origin and a system in comments", ply::origins),
    ("Gaussian splats", ply::splats),
    (
        "lists among the properties, and elements before the vertices",
        ply::lists,
    ),
    (
        "headers whose lines end with LF, CR LF or CR",
        ply::line_ends,
    ),
    ("coordinates that are not finite", ply::not_finite),
    ("no element vertex", |b| {
        ply::header(b, "element face 0\n", "")
    }),
    ("no property z", |b| {
        ply::header(
            b,
            "element vertex 1\nproperty float x\nproperty float y\n",
            "1 2\n",
        )
    }),
    ("a list called x", |b| {
        let elements = "element vertex 1\nproperty list uchar float x\n\
                        property float y\nproperty float z\n";
        ply::header(b, elements, "1 1 2 3\n")
    }),
    ("two elements vertex, or two properties x", ply::twice),
    ("a count that is negative or 2^64", ply::bad_counts),
    (
        "a binary body that ends early, or a count that is too large",
        ply::short_binary,
    ),
    ("text that ends early", |b| {
        ply::counted(b, "5", "1 2 3\n4 5 6\n")
    }),
    ("a list that is longer than the file", ply::long_list),
    (
        "a header without end, or of more than 1 MiB",
        ply::endless_header,
    ),
    ("a type or a line that PLY does not have", ply::unknown),
    ("a byte order mark before the first line", |b| {
        let text = ply::text("1", "1 2 3\n");
        vec![b.write("a.ply", format!("\u{feff}{text}"))]
    }),
    ("PCD as text, binary, and compressed", pcd::bodies),
    (
        "types and bodies of PCD in lower and upper case",
        pcd::other_case,
    ),
    ("PCD with coordinates of every type", pcd::types),
    ("padding between the fields of PCD", pcd::padded),
    (
        "PCD headers of other versions, or with less in them",
        pcd::headers,
    ),
    ("PCD with coordinates that are not finite", pcd::not_finite),
    ("PCD as text, with tabs or commas", pcd::separators),
    ("PCD as text, with more lines than points", |b| {
        vec![pcd::header(b, "POINTS 2", "POINTS 1")]
    }),
    ("PCD as text that ends early", |b| pcd::cut(b, "ascii")),
    ("a line of PCD that is no point", |b| {
        vec![
            pcd::header(b, "2 3 1", "2 3 one"),
            pcd::header(b, "e+06 1\n", "e+06\n"),
        ]
    }),
    ("binary PCD that ends early", |b| pcd::cut(b, "binary")),
    ("compressed PCD that ends early", |b| {
        pcd::cut(b, "binary_compressed")
    }),
    ("compressed PCD with damaged data", pcd::damaged),
    (
        "compressed PCD whose size is not that of its points",
        pcd::other_sizes,
    ),
    (
        "compressed PCD that claims more than there can be",
        pcd::bombs,
    ),
    ("PCD without a field z", pcd::no_z),
    (
        "two fields x in PCD, or one with several values",
        pcd::twice,
    ),
    ("a word in a PCD header that it does not have", pcd::unknown),
    (
        "a PCD header without end, or of more than 1 MiB",
        pcd::endless,
    ),
    ("PTX with one scan or several", ptx::scans),
    (
        "directions without a point, and scans without any",
        ptx::empty,
    ),
    ("PTX that ends early", ptx::cut),
    ("the header of a later scan that is none", ptx::no_header),
    ("a matrix for points in columns", ptx::columns),
    ("a line of PTX that is no point", ptx::bad_line),
    ("OFF, also with colours or normals, and faces", off::meshes),
    ("binary OFF", |b| {
        vec![b.write("a.off", "OFF BINARY\n1 0 0\n")]
    }),
    ("an OFF header without numbers", |b| {
        vec![b.write("a.off", "OFF\n"), b.write("b.off", "OFF\na b c\n")]
    }),
    ("OFF that ends early", |b| {
        vec![b.write("a.off", "OFF\n3 0 0\n1 2 3\n")]
    }),
    ("a line of OFF that is no vertex", |b| {
        vec![b.write("a.off", "OFF\n2 0 0\n1 2 3\n1 2\n")]
    }),
    (
        "spaces, tabs, commas or semicolons between numbers",
        text::separators,
    ),
    (
        "decimal commas, with spaces or semicolons",
        text::decimal_commas,
    ),
    ("a line or comment of names, x, y and z first", text::names),
    (
        "names of coordinates in other places, or others",
        text::other_names,
    ),
    ("more than three columns without names", text::no_names),
    ("columns that cannot be told", text::untold),
    (
        "comments behind `#`, `//` or `%`, and blank lines",
        text::comments,
    ),
    ("PTS: lines that count the points after them", text::counts),
    (
        "lines that end with LF, CR LF or CR, and a UTF-8 byte order mark",
        text::line_ends,
    ),
    ("any name, if the content is such a list", text::any_name),
    (
        "numbers that are not finite, or too large for a double",
        |b| vec![b.write("a.xyz", "nan 1 2\n1 inf 2\n1e999 1 2\n3 4 5\n")],
    ),
    ("a line that is no point", |b| {
        vec![
            b.write("a.xyz", "1 2 3\n4 5 6\n7 8\n"),
            b.write("b.csv", "1,2,3\n4,5,6\n7,eight,9\n"),
        ]
    }),
    ("a count in PTS that is too large", |b| {
        vec![b.write("a.pts", "5\n1 2 3\n4 5 6\n")]
    }),
    ("a first line of more than 1 MiB", |b| {
        vec![b.write("a.xyz", "1 ".repeat(600_000) + "\n1 2 3\n")]
    }),
    ("a later line of more than 1 MiB", |b| {
        vec![b.write("a.xyz", "1 2 3\n".to_owned() + &"1 ".repeat(3 << 20))]
    }),
    ("UTF-16", text::utf16),
    ("binary data", |b| {
        vec![b.write("a.xyz", [1, 2, 0, 3]), b.write("b", [0; 5000])]
    }),
    ("prose", |b| {
        vec![b.write("a.txt", "It was a dark night.\n".repeat(20))]
    }),
    ("nothing but comments", |b| {
        vec![b.write("a.txt", "# nothing\n\n//\n")]
    }),
    (
        "LAS, LAZ, PLY and text in gzip or Zstandard",
        compressed::formats,
    ),
    (
        "several members or frames, and frames that are skipped",
        compressed::several,
    ),
    ("gzip that ends early", compressed::short_gzip),
    ("Zstandard that ends early", compressed::short_zstd),
    ("gzip or Zstandard with damaged data", compressed::damaged),
    ("something else behind a frame", compressed::more),
    ("nothing that is compressed", compressed::nothing),
    ("compression in compression", compressed::twice),
    ("a ZIP archive with one cloud", archives::one),
    ("a ZIP archive with several clouds", archives::several),
    ("a ZIP archive without a cloud", archives::none),
    ("a ZIP archive that is damaged", archives::damaged),
    (
        "a member of a ZIP archive that is encrypted, or compressed by another method",
        archives::unreadable,
    ),
    ("a ZIP archive with more than 1000 files", archives::many),
    ("a pointer of Git LFS", |b| {
        let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n";
        ["a.laz", "a.e57", "a.ply", "a.xyz", "a"]
            .map(|name| b.write(name, pointer))
            .into()
    }),
    (
        "files of other programs, by their first bytes or names",
        |b| {
            let names = [
                "rcp", "rcs", "fls", "fws", "zfs", "imp", "lgs", "pod", "rwp", "3dm", "dwg", "skp",
            ];
            let by_name = names.map(|end| b.write(&format!("a.{end}"), [1, 0, 2, 3]));
            let glb = b.write("b.fls", b"glTF\x02\0\0\0");
            let text = b.write("c.dxf", "0\nSECTION\n2\nHEADER\n");
            by_name.into_iter().chain([glb, text]).collect()
        },
    ),
    ("an empty file", |b| {
        ["a.las", "a.laz", "a.ply", "a.xyz", "a"]
            .map(|name| b.write(name, ""))
            .into()
    }),
    ("OBJ", |b| {
        vec![b.write("a.obj", "v 1 2 3\nv 4 5 6\nv 7 8 9\nf 1 2 3\n")]
    }),
    ("STL as text", |b| {
        vec![b.write("a.stl", "solid a\nfacet normal 0 0 1\n")]
    }),
    ("what is no regular file", |_| vec!["/dev/null".into()]),
];
