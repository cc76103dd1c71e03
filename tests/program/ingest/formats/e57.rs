//! E57.

use crate::ingest::bench::Bench;
use e57::{
    E57Writer, Quaternion, RawValues, Record, RecordDataType, RecordName, RecordValue, Transform,
    Translation,
};
use std::path::PathBuf;

/// A scan to write.
pub struct Scan {
    pub fields: Vec<Record>,
    pub pose: Option<Transform>,
    pub rows: Vec<RawValues>,
}

pub fn pose(w: f64, [x, y, z]: [f64; 3], to: [f64; 3]) -> Transform {
    Transform {
        rotation: Quaternion { w, x, y, z },
        translation: Translation {
            x: to[0],
            y: to[1],
            z: to[2],
        },
    }
}

pub fn scaled(lowest: i64, highest: i64, scale: f64, offset: f64) -> RecordDataType {
    RecordDataType::ScaledInteger {
        min: lowest,
        max: highest,
        scale,
        offset,
    }
}

fn value(kind: &RecordDataType, value: f64) -> RecordValue {
    match kind {
        RecordDataType::Single { .. } => RecordValue::Single(value as f32),
        RecordDataType::Double { .. } => RecordValue::Double(value),
        RecordDataType::ScaledInteger { .. } => RecordValue::ScaledInteger(value as i64),
        RecordDataType::Integer { .. } => RecordValue::Integer(value as i64),
    }
}

const CARTESIAN: [RecordName; 3] = [
    RecordName::CartesianX,
    RecordName::CartesianY,
    RecordName::CartesianZ,
];
pub const SPHERICAL: [RecordName; 3] = [
    RecordName::SphericalRange,
    RecordName::SphericalAzimuth,
    RecordName::SphericalElevation,
];

/// A scan of these coordinates (whole numbers unscaled), with an intensity before them.
pub fn scan(names: [RecordName; 3], kind: &RecordDataType, points: &[[f64; 3]]) -> Scan {
    let field = |name| Record {
        name,
        data_type: kind.clone(),
    };
    let row = |(number, point): (usize, &[f64; 3])| {
        let intensity = RecordValue::Integer(number as i64 % 500);
        let values = point.iter().map(|c| value(kind, *c));
        [intensity].into_iter().chain(values).collect()
    };
    Scan {
        fields: [Record::INTENSITY_U16]
            .into_iter()
            .chain(names.map(field))
            .collect(),
        pose: None,
        rows: points.iter().enumerate().map(row).collect(),
    }
}

pub fn cartesian(kind: &RecordDataType, points: &[[f64; 3]]) -> Scan {
    scan(CARTESIAN, kind, points)
}

/// Writes a file; `edit` changes its description.
pub fn edited(
    bench: &Bench,
    name: &str,
    scans: &[Scan],
    edit: impl Fn(String) -> String,
) -> PathBuf {
    let path = bench.path(name);
    let mut writer = E57Writer::from_file(&path, "a file").unwrap();
    for scan in scans {
        let mut part = writer
            .add_pointcloud("a scan", scan.fields.clone())
            .unwrap();
        part.set_transform(scan.pose.clone());
        scan.rows
            .iter()
            .for_each(|row| part.add_point(row.clone()).unwrap());
        part.finalize().unwrap();
    }
    writer.finalize_customized_xml(|xml| Ok(edit(xml))).unwrap();
    path
}

pub fn write(bench: &Bench, name: &str, scans: &[Scan]) -> PathBuf {
    edited(bench, name, scans, |xml| xml)
}

pub fn points(count: usize) -> Vec<[f64; 3]> {
    (0..count)
        .map(|i| [i as f64 + 0.5, (i % 7) as f64, (i % 3) as f64 * 0.25])
        .collect()
}

pub fn scans(bench: &Bench) -> Vec<PathBuf> {
    let single = || cartesian(&RecordDataType::F32, &points(20));
    let posed = || Scan {
        pose: Some(pose(0.5, [0.5; 3], [100.0, -50.0, 3.5])),
        ..cartesian(&RecordDataType::F64, &points(3000))
    };
    let empty = || cartesian(&RecordDataType::F32, &[]);
    vec![
        write(bench, "one.e57", &[single()]),
        write(bench, "posed.e57", &[posed()]),
        write(bench, "any name", &[posed(), empty(), single(), posed()]),
    ]
}

pub fn types(bench: &Bench) -> Vec<PathBuf> {
    let whole = RecordDataType::Integer { min: 0, max: 900 };
    let kinds = [
        RecordDataType::F32,
        RecordDataType::F64,
        whole,
        scaled(-10, 5000, 0.001, 100.0),
    ];
    let mut files = Vec::new();
    for (number, kind) in kinds.iter().enumerate() {
        let name = format!("{number}.e57");
        files.push(write(bench, &name, &[cartesian(kind, &points(100))]));
    }
    for (number, kind) in kinds[..2].iter().enumerate() {
        let name = format!("spherical-{number}.e57");
        files.push(write(bench, &name, &[scan(SPHERICAL, kind, &points(100))]));
    }
    files
}

/// A scan of 60 directions, every third of which has no point.
pub fn with_states() -> Scan {
    let mut scan = cartesian(&RecordDataType::F32, &points(60));
    scan.fields.push(Record::CARTESIAN_INVALID_STATE);
    for (number, row) in scan.rows.iter_mut().enumerate() {
        let state = [0, 1, 0, 2, 0, 0][number % 6];
        row.push(RecordValue::Integer(state));
    }
    scan
}

pub fn states(bench: &Bench) -> Vec<PathBuf> {
    vec![write(bench, "a.e57", &[with_states()])]
}

pub fn none(bench: &Bench) -> Vec<PathBuf> {
    let empty = cartesian(&RecordDataType::F32, &[]);
    vec![write(bench, "a.e57", &[]), write(bench, "b.e57", &[empty])]
}

/// Colours with other limits than those of 8 bits.
pub fn limits(bench: &Bench) -> Vec<PathBuf> {
    let colored = |most: i64| {
        let mut scan = cartesian(&RecordDataType::F32, &points(20));
        let names = [
            RecordName::ColorRed,
            RecordName::ColorGreen,
            RecordName::ColorBlue,
        ];
        scan.fields.extend(names.map(|name| Record {
            name,
            data_type: RecordDataType::Integer { min: 0, max: most },
        }));
        let color = |i: usize| [i as i64, 0, most].map(RecordValue::Integer);
        scan.rows
            .iter_mut()
            .enumerate()
            .for_each(|(i, row)| row.extend(color(i)));
        scan
    };
    let no_numbers = |xml: String| {
        let limits = "<colorLimits type=\"Structure\"><colorRedMaximum type=\"Integer\">many</colorRedMaximum>\
            </colorLimits><points ";
        xml.replace("<points ", limits)
    };
    vec![
        write(bench, "a.e57", &[colored(1023)]),
        write(bench, "b.e57", &[colored(255), colored(4095)]),
        edited(bench, "c.e57", &[colored(1023)], no_numbers),
    ]
}

/// Points that are all the same take no bits.
pub fn same(bench: &Bench) -> Vec<PathBuf> {
    let one = RecordDataType::Integer { min: 7, max: 7 };
    let two = RecordDataType::Integer { min: 7, max: 8 };
    let others = |xml: String| {
        let xml = xml.replace(
            "minimum=\"0\" maximum=\"65535\"",
            "minimum=\"0\" maximum=\"0\"",
        );
        xml.replace("minimum=\"7\" maximum=\"8\"", "minimum=\"7\" maximum=\"7\"")
    };
    vec![
        write(bench, "a.e57", &[cartesian(&one, &[[7.0; 3]; 50])]),
        edited(bench, "b.e57", &[cartesian(&two, &[[7.0; 3]; 50])], others),
    ]
}

pub fn cut(bench: &Bench) -> Vec<PathBuf> {
    let path = write(
        bench,
        "a.e57",
        &[cartesian(&RecordDataType::F64, &points(3000))],
    );
    let bytes = std::fs::read(path).unwrap();
    [1, 1024, bytes.len() - 100]
        .map(|less| bench.write(&format!("{less}.e57"), &bytes[..bytes.len() - less]))
        .into()
}

pub fn short(bench: &Bench) -> Vec<PathBuf> {
    vec![bench.write("a.e57", "ASTM-E57 and more")]
}

pub fn pages(bench: &Bench) -> Vec<PathBuf> {
    let path = write(
        bench,
        "a.e57",
        &[cartesian(&RecordDataType::F64, &points(3000))],
    );
    let bytes = std::fs::read(path).unwrap();
    // In the points, in a checksum, in the description at the end.
    [3000, 2 * 1024 - 1, bytes.len() - 900]
        .map(|at| {
            let mut copy = bytes.clone();
            copy[at] ^= 0x40;
            bench.write(&format!("{at}.e57"), copy)
        })
        .into()
}

/// A file with other bytes at these offsets, with right checksums.
pub fn patched(bench: &Bench, name: &str, scan: Scan, edits: &[(usize, &[u8])]) -> PathBuf {
    let path = write(bench, name, &[scan]);
    let mut bytes = std::fs::read(&path).unwrap();
    for (at, new) in edits {
        bytes[*at..*at + new.len()].copy_from_slice(new);
    }
    seal(&mut bytes);
    bench.write(name, bytes)
}

/// Corrects the checksums.
pub fn seal(bytes: &mut [u8]) {
    for page in bytes.chunks_exact_mut(1024) {
        let sum = crc32c::crc32c(&page[..1020]).to_be_bytes();
        page[1020..].copy_from_slice(&sum);
    }
}

pub fn headers(bench: &Bench) -> Vec<PathBuf> {
    let scan = || cartesian(&RecordDataType::F32, &points(9));
    vec![
        patched(bench, "a.e57", scan(), &[(8, &[2])]),
        patched(bench, "b.e57", scan(), &[(40, &[0, 8])]),
        patched(bench, "c.e57", scan(), &[(24, &[0xff; 8])]),
        patched(bench, "d.e57", scan(), &[(32, &[0xff; 8])]),
    ]
}

/// Damage of the section, which begins at byte 48, and of its first packet, at byte 80.
pub fn packets(bench: &Bench) -> Vec<PathBuf> {
    let scan = || cartesian(&RecordDataType::F32, &points(400));
    vec![
        patched(bench, "type.e57", scan(), &[(80, &[7])]),
        patched(bench, "short.e57", scan(), &[(82, &[0, 0])]),
        patched(bench, "long.e57", scan(), &[(82, &[0xff, 0xff])]),
        patched(bench, "streams.e57", scan(), &[(84, &[3])]),
        patched(bench, "stream.e57", scan(), &[(86, &[0xff, 0x7f])]),
        patched(bench, "none.e57", scan(), &[(86, &[0, 0])]),
        patched(bench, "over.e57", scan(), &[(80, &[2])]),
    ]
}

pub fn sections(bench: &Bench) -> Vec<PathBuf> {
    let scan = || cartesian(&RecordDataType::F32, &points(9));
    vec![
        patched(bench, "a.e57", scan(), &[(48, &[7])]),
        patched(bench, "b.e57", scan(), &[(64, &[0xff; 8])]),
    ]
}

/// Files with a part of the description replaced.
fn replaced(bench: &Bench, edits: &[(&str, &str)]) -> Vec<PathBuf> {
    let scan = || Scan {
        pose: Some(pose(1.0, [0.0; 3], [1.0, 2.0, 3.0])),
        ..cartesian(&scaled(0, 1000, 0.5, 0.0), &points(9))
    };
    let edit = |(number, (from, to)): (usize, &(&str, &str))| {
        edited(bench, &format!("{number}.e57"), &[scan()], |xml| {
            assert!(xml.contains(from), "{xml}");
            xml.replace(from, to)
        })
    };
    edits.iter().enumerate().map(edit).collect()
}

pub fn descriptions(bench: &Bench) -> Vec<PathBuf> {
    replaced(
        bench,
        &[
            ("</prototype>", "</prototypes>"),
            ("recordCount=\"9\"", "recordCount=\"nine\""),
            ("recordCount=\"9\"", ""),
            ("type=\"ScaledInteger\"", "type=\"String\""),
            (
                "minimum=\"0\" maximum=\"1000\"",
                "minimum=\"0\" maximum=\"-7\"",
            ),
            ("scale=\"0.5\"", "scale=\"half\""),
            ("scale=\"0.5\"", "scale=\"0.5"),
            ("<x type=\"Float\">1<", "<x type=\"Float\">one<"),
            (
                "<prototype type=\"Structure\">",
                "<prototype type=\"Structure\"><a type=\"Float\"><b/></a>",
            ),
        ],
    )
}

pub fn no_coordinates(bench: &Bench) -> Vec<PathBuf> {
    replaced(bench, &[("cartesianZ", "cartesianW")])
}

pub fn no_rotation(bench: &Bench) -> Vec<PathBuf> {
    replaced(
        bench,
        &[
            ("<w type=\"Float\">1<", "<w type=\"Float\">0<"),
            ("<x type=\"Float\">1<", "<x type=\"Float\">inf<"),
        ],
    )
}

pub fn bombs(bench: &Bench) -> Vec<PathBuf> {
    let flat = |xml: String| {
        let xml = xml.replace(
            "minimum=\"0\" maximum=\"65535\"",
            "minimum=\"0\" maximum=\"0\"",
        );
        let xml = xml.replace("minimum=\"0\" maximum=\"1\"", "minimum=\"0\" maximum=\"0\"");
        xml.replace("recordCount=\"9\"", "recordCount=\"9000000\"")
    };
    let one = RecordDataType::Integer { min: 0, max: 1 };
    let mut files = replaced(bench, &[("recordCount=\"9\"", "recordCount=\"90000\"")]);
    files.push(edited(
        bench,
        "flat.e57",
        &[cartesian(&one, &[[0.0; 3]; 9])],
        flat,
    ));
    files
}

pub fn shared(bench: &Bench) -> Vec<PathBuf> {
    let scan = || cartesian(&RecordDataType::F32, &points(9));
    let twice = |xml: String| {
        let second = xml.rfind("fileOffset=\"").unwrap();
        xml[..second].to_owned()
            + "fileOffset=\"48\" recordCount=\"9\"><prototype"
            + xml[second..].split_once("<prototype").unwrap().1
    };
    vec![edited(bench, "a.e57", &[scan(), scan()], twice)]
}
