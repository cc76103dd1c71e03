//! Scans: PCD, PTX, E57 and EPT.

use super::{Result, Seeds};
use crate::ept;
use e57::{
    E57Writer, Quaternion, Record, RecordDataType, RecordName, RecordValue, Transform, Translation,
};
use outcrop_cloudgen::{Cloud, Format, Kind, LasOptions};

/// PCD with all encodings, other fields and padding.
pub(super) fn pcd_files(seeds: &Seeds) -> Result {
    let head = "# .PCD v0.7\nVERSION 0.7\nFIELDS x rgb y _ z\nSIZE 4 4 8 1 2\nTYPE F U F U I\n\
                COUNT 1 1 1 2 1\nWIDTH 3\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 3\nDATA ";
    let text = format!("{head}ascii\n1.5 9 2 0 0 3\nnan 9 2 0 0 -3\n4 9 1e3 0 0 7\n");
    seeds.put("pcd", "text.pcd", &text)?;
    seeds.put("pcd", "crlf.pcd", text.replace('\n', "\r\n"))?;
    let binary = [format!("{head}binary\n").as_bytes(), &[7; 60]].concat();
    seeds.put("pcd", "binary.pcd", binary)?;
    // A byte as it is, and copies of it: of 54 bytes without padding, and of 60 with it.
    for (name, content, copy) in [("packed", 54u32, 44u8), ("padded", 60, 50)] {
        let data = [0, 7, 0xe0, copy, 0];
        let sizes = [data.len() as u32, content].map(u32::to_le_bytes).concat();
        let head = format!("{head}binary_compressed\n");
        let bytes = [head.as_bytes(), &sizes, &data].concat();
        seeds.put("pcd", &format!("{name}.pcd"), bytes)?;
    }
    Ok(())
}

/// PTX with one scan and two, turned and moved.
pub(super) fn ptx_files(seeds: &Seeds) -> Result {
    let head = "2\n2\n1 2 3\n1 0 0\n0 1 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n1 2 3 1\n";
    let one = format!("{head}1.5 2 3 0.5\n0 0 0 0.5\n4 5 6 0.25\n7 8.125 9 1\n");
    let two = format!("{head}1 2 3 0.5 9 8 7\n0 0 0 0 0 0 0\n4 5 6 1 0 0 0\n7 8 9 1 1 1 1\n");
    seeds.put("ptx", "one.ptx", &one)?;
    seeds.put("ptx", "two.ptx", one.clone() + &two)?;
    seeds.put("ptx", "crlf.ptx", two.replace('\n', "\r\n"))
}

/// E57 with Cartesian and spherical coordinates of all types, states and poses.
pub(super) fn e57_files(seeds: &Seeds) -> Result {
    let whole = RecordDataType::Integer { min: 0, max: 200 };
    let scaled = RecordDataType::ScaledInteger {
        min: -3,
        max: 300,
        scale: 0.01,
        offset: 5.0,
    };
    let kinds = [RecordDataType::F32, RecordDataType::F64, whole, scaled];
    for (number, kind) in kinds.iter().enumerate() {
        for spherical in [false, true] {
            let path = seeds.path("e57", &format!("{number}-{spherical}.e57"))?;
            let mut writer = E57Writer::from_file(path, "file")?;
            for (points, posed) in [(9, false), (300, number % 2 == 1)] {
                e57_scan(&mut writer, kind, spherical, points, posed)?;
            }
            writer.set_coordinate_metadata(Some("LOCAL_CS[\"site\"]".into()));
            writer.finalize()?;
        }
    }
    Ok(())
}

fn e57_scan(
    writer: &mut E57Writer<std::fs::File>,
    kind: &RecordDataType,
    spherical: bool,
    points: u32,
    posed: bool,
) -> Result {
    let (names, state) = match spherical && matches!(kind, RecordDataType::Single { .. }) {
        true => (
            [
                RecordName::SphericalRange,
                RecordName::SphericalAzimuth,
                RecordName::SphericalElevation,
            ],
            Record::SPHERICAL_INVALID_STATE,
        ),
        false => (
            [
                RecordName::CartesianX,
                RecordName::CartesianY,
                RecordName::CartesianZ,
            ],
            Record::CARTESIAN_INVALID_STATE,
        ),
    };
    let field = |name| Record {
        name,
        data_type: kind.clone(),
    };
    let fields = names.map(field).into_iter().chain([state]).collect();
    let mut scan = writer.add_pointcloud("scan", fields)?;
    scan.set_transform(posed.then_some(Transform {
        rotation: Quaternion {
            w: 0.5,
            x: 0.5,
            y: 0.5,
            z: 0.5,
        },
        translation: Translation {
            x: 10.0,
            y: 20.0,
            z: 0.5,
        },
    }));
    for point in 0..points {
        let values = [point % 90, point / 7, point % 5].map(|value| match kind {
            RecordDataType::Single { .. } => RecordValue::Single(value as f32),
            RecordDataType::Double { .. } => RecordValue::Double(value.into()),
            RecordDataType::Integer { .. } => RecordValue::Integer(value.into()),
            RecordDataType::ScaledInteger { .. } => RecordValue::ScaledInteger(value.into()),
        });
        let state = RecordValue::Integer((point % 3 / 2).into());
        scan.add_point(values.into_iter().chain([state]).collect())?;
    }
    Ok(scan.finalize()?)
}

/// Sets of tiles of every type, with one node.
pub(super) fn tiles(seeds: &Seeds) -> Result {
    let about = |data: &str| {
        format!(
            r#"{{"bounds": [0, 0, 0, 9, 9, 9], "dataType": "{data}", "hierarchyType": "json", "points": 9, "schema": [
            {{"name": "X", "type": "signed", "size": 4, "scale": 0.01, "offset": 0}},
            {{"name": "Y", "type": "signed", "size": 4, "scale": 0.01, "offset": 0}},
            {{"name": "Z", "type": "signed", "size": 4, "scale": 0.01, "offset": 0}},
            {{"name": "Classification", "type": "unsigned", "size": 1}}], "srs": {{"wkt": ""}}, "version": "1.0.0"}}"#
        )
    };
    let rows: Vec<u8> = (0..9 * 13u8)
        .map(|n| if n % 13 % 4 > 1 { 0 } else { n })
        .collect();
    let page = br#"{"0-0-0-0": 9}"#;
    let packed = zstd::bulk::compress(&rows, 3)?;
    let folder = tempfile::tempdir()?;
    let laz = folder.path().join("cloud.laz");
    Cloud::new(Kind::Sphere)
        .points(9)
        .write(&laz, Format::Laz(LasOptions::default()))?;
    let laz = std::fs::read(laz)?;
    for (data, file) in [("binary", &rows), ("zstandard", &packed), ("laszip", &laz)] {
        let bytes = ept::joined([about(data).as_bytes(), page, file]);
        seeds.put("ept", data, bytes)?;
    }
    Ok(())
}
