//! Files of other programs by kind.

/// A kind, and its files.
pub const ZOO: &[(&str, &[&str])] = &[
    (
        "LAS 1.2, point formats 0 to 3",
        &["generated/pf0.las", "generated/pf3.las"],
    ),
    (
        "LAS 1.3, point formats 0 to 5",
        &["generated/pf4.las", "generated/pf5.las"],
    ),
    (
        "LAS 1.4, point formats 0 to 10",
        &[
            "generated/pf6.las",
            "generated/pf8.las",
            "generated/pf10.las",
            "generated/v1.4_pf1.las",
        ],
    ),
    (
        "LAS 1.0, point formats 0 and 1",
        &["generated/v1.0_pf1.las"],
    ),
    (
        "LAS 1.1, point formats 0 and 1",
        &["generated/v1.1_pf1.las"],
    ),
    (
        "LAZ 1.0 to 1.3, point formats 0 to 5",
        &["generated/pf1.laz", "laz-rs/point-time-color.laz"],
    ),
    (
        "LAZ 1.4, point formats 0 to 10",
        &[
            "generated/pf6.laz",
            "generated/pf9.laz",
            "generated/pf10.laz",
        ],
    ),
    ("COPC", &["laspy/simple.copc.laz"]),
    (
        "extra bytes, described or not",
        &[
            "generated/extra_bytes.laz",
            "generated/reclen_long_undeclared.las",
            "laz-rs/extra-bytes.laz",
        ],
    ),
    (
        "a name that says LAS for LAZ, or the other way round",
        &["generated/las_named.laz", "generated/laz_named.las"],
    ),
    (
        "a box in the header that is wrong",
        &[
            "generated/bbox_zero.las",
            "generated/bbox_nan.las",
            "generated/bbox_inverted.las",
        ],
    ),
    (
        "bytes after the points",
        &["generated/trailing_garbage.las"],
    ),
    (
        "no points",
        &[
            "generated/empty.las",
            "generated/empty.laz",
            "generated/empty14.laz",
        ],
    ),
    ("version 1.5", &["generated/v1.5_future.las"]),
    (
        "a count of 0 in the header, and points",
        &["generated/count_zero.las"],
    ),
    (
        "a count in the header that is too small",
        &["generated/count_too_small.las"],
    ),
    ("a negative scale", &["generated/scale_neg.las"]),
    ("point format 42", &["generated/bad_pointformat42.las"]),
    (
        "a record length below that of the point format",
        &["generated/reclen_zero.las", "generated/reclen_short.las"],
    ),
    (
        "a scale that is 0 or not a number",
        &["generated/scale_zero.las", "generated/scale_nan.las"],
    ),
    ("an offset that is infinite", &["generated/offset_inf.las"]),
    (
        "points that start outside the file",
        &[
            "generated/dataoffset_past_eof.las",
            "generated/dataoffset_in_header.las",
        ],
    ),
    (
        "a count in the header that is too large",
        &["generated/count_too_big.las", "generated/count_4e9.las"],
    ),
    (
        "LAS that ends early",
        &["generated/trunc60.las", "generated/trunc99.las"],
    ),
    ("LAZ that ends early", &["generated/trunc60.laz"]),
    (
        "a header that ends early",
        &["generated/trunc_header.las", "generated/magic_only.las"],
    ),
    (
        "a name that says LAS, and other content",
        &["generated/random.las", "generated/text_named.las"],
    ),
    (
        "text, little-endian and big-endian",
        &[
            "generated/ascii.ply",
            "generated/le_f32.ply",
            "generated/be_f32.ply",
        ],
    ),
    (
        "coordinates that are `float`, `double` or whole numbers",
        &["generated/le_f64.ply", "generated/int_coords.ply"],
    ),
    (
        "lists among the properties, and elements before the vertices",
        &[
            "generated/list_before_vertex.ply",
            "generated/with_faces_normals.ply",
        ],
    ),
    (
        "headers whose lines end with LF, CR LF or CR",
        &["generated/ascii_crlf.ply", "generated/bin_crlf_header.ply"],
    ),
    (
        "coordinates that are not finite",
        &["generated/nan_inf.ply", "generated/nan_ascii.ply"],
    ),
    ("no property z", &["generated/no_z.ply"]),
    (
        "a count that is negative or 2^64",
        &["generated/count_neg.ply"],
    ),
    (
        "a binary body that ends early, or a count that is too large",
        &["generated/short_body.ply", "generated/count_4e9.ply"],
    ),
    (
        "spaces, tabs, commas or semicolons between numbers",
        &[
            "generated/space.xyz",
            "generated/tab.xyz",
            "generated/comma.xyz",
            "generated/semicolon.xyz",
        ],
    ),
    (
        "decimal commas, with spaces or semicolons",
        &["generated/decimal_comma.xyz"],
    ),
    (
        "a line or comment of names, x, y and z first",
        &["generated/header.xyz", "generated/slashheader.xyz"],
    ),
    (
        "comments behind `#`, `//` or `%`, and blank lines",
        &["generated/hash.xyz"],
    ),
    (
        "PTS: lines that count the points after them",
        &["generated/pts_count.pts"],
    ),
    (
        "lines that end with LF, CR LF or CR, and a UTF-8 byte order mark",
        &[
            "generated/crlf.xyz",
            "generated/cr_only.xyz",
            "generated/bom.xyz",
        ],
    ),
    (
        "any name, if the content is such a list",
        &["generated/xyz_named.ply"],
    ),
    ("a line that is no point", &["generated/ragged.xyz"]),
    ("UTF-16", &["generated/utf16.xyz"]),
    ("an empty file", &["generated/empty_file.las"]),
    (
        "E57 with one scan or several, and poses",
        &["e57/bunnyFloat.e57", "generated/two_scans_pose.e57"],
    ),
    ("E57 that ends early", &["generated/trunc60.e57"]),
    (
        "a page with a wrong checksum",
        &["generated/badcrc.e57", "e57/corrupt_crc.e57"],
    ),
    (
        "PCD as text, with tabs or commas",
        &["pdal/utm17_tab.pcd", "pdal/utm17_comma.pcd"],
    ),
    (
        "PTX with one scan or several",
        &["pdal/multiple-and-transform.ptx", "pdal/1.2-with-color.ptx"],
    ),
    (
        "directions without a point, and scans without any",
        &["generated/two_scans.ptx", "pdal/complex-transform.ptx"],
    ),
    ("PTX that ends early", &["generated/trunc.ptx"]),
];
