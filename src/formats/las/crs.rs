//! The reference system given in a file, as far as needed to name it and to compare two of them.
//!
//! Coordinates are read unchanged, so errors in the records are ignored.

use super::super::input::Input;
use super::Header;
use super::vlr::Records;
use las::Vlr;
use las::crs::{GeoTiffCrs, GeoTiffData};
use outcrop_points::kind::{CrsKind, length_of_code};
use outcrop_points::wkt::well_known;
use outcrop_points::{Crs, CrsSource};
use std::collections::BTreeMap;

/// Limit for the number of records read, and for the size of those with GeoTIFF keys: each key has a copy of
/// the numbers or the text that it names.
const MOST_RECORDS: usize = 200;
const LARGEST_KEYS: usize = 4 << 10;

/// Records with the numbers and the texts of GeoTIFF keys.
const NUMBERS: u16 = 34736;
const TEXTS: u16 = 34737;

/// GeoTIFF keys that only describe a system.
const CITATIONS: [u16; 4] = [1026, 2049, 3073, 4097];

/// GeoTIFF keys of the kind of a system, and of the units of its plane (a code, or a length) and of its heights.
const MODEL: u16 = 1024;
const PLANE_UNIT: u16 = 3076;
const PLANE_LENGTH: u16 = 3077;
const HEIGHT_UNIT: u16 = 4099;

/// The record with well-known text, and the names under which it stands: that of the standard, and that of the
/// library libLAS.
const TEXT: u16 = 2112;
const STANDARD: &str = "LASF_Projection";
const LIBLAS: &str = "liblas";

/// What stands before a well-known text in a citation of the makers of ArcGIS.
const IN_CITATION: &str = "ESRI PE String =";

/// The reference system of a file, if it gives one.
pub(super) fn read(input: &Input, header: &Header) -> Option<Crs> {
    let plain = Records::plain(input, header.records()).take(MOST_RECORDS);
    let extended = header.raw.evlr.map(|evlr| {
        let most = MOST_RECORDS.min(evlr.number_of_evlrs as usize);
        Records::extended(input, evlr.start_of_first_evlr).take(most)
    });
    let records = std::iter::once(plain).chain(extended);
    let records = records
        .flat_map(|records| records.map_while(Result::ok))
        .map(|(_, record)| record);
    from_records(records)
}

/// The system that records give. The last record of a kind counts, and that of the standard before others.
fn from_records(records: impl Iterator<Item = Vlr>) -> Option<Crs> {
    let (mut standard, mut liblas) = (BTreeMap::new(), None);
    for record in records {
        if named(&record, LIBLAS) && record.record_id == TEXT {
            liblas = Some(record);
        } else if named(&record, STANDARD) {
            let keys = record.is_geotiff_crs() && record.data.len() <= LARGEST_KEYS;
            let text = record.record_id == TEXT && !text_of(&record.data).is_empty();
            if keys || text {
                standard.insert(record.record_id, record);
            }
        }
    }
    if let (false, Some(record)) = (standard.contains_key(&TEXT), liblas) {
        let text = text_of(&record.data);
        if !text.is_empty() {
            return Some(well_known(&text));
        }
    }
    crs(standard)
}

/// True if a record has this user; writers differ in case and in what follows the name.
fn named(record: &Vlr, user: &str) -> bool {
    let name = record
        .user_id
        .trim_matches(|c: char| c == '\0' || c.is_whitespace());
    name.eq_ignore_ascii_case(user)
}

/// The text of a record.
fn text_of(data: &[u8]) -> String {
    let text = String::from_utf8_lossy(data);
    let text = text.trim_start_matches('\u{feff}');
    // What follows a zero is no part of it.
    let text = text
        .trim_start_matches('\0')
        .split('\0')
        .next()
        .unwrap_or_default();
    text.trim().to_owned()
}

/// From well-known text if present: files of newer point formats may have outdated keys beside it.
fn crs(mut records: BTreeMap<u16, Vlr>) -> Option<Crs> {
    if let Some(record) = records.remove(&TEXT) {
        return Some(well_known(&text_of(&record.data)));
    }
    // Numbers and texts that are missing are no reason to refuse the codes.
    for record_id in [NUMBERS, TEXTS] {
        let record = records.entry(record_id).or_default();
        record.record_id = record_id;
        record.data.resize(LARGEST_KEYS, 0);
    }
    for record in records.values_mut() {
        record.user_id = STANDARD.into();
    }
    let mut builder = las::Builder::from((1, 4));
    builder.vlrs = records.into_values().collect();
    let header = builder.into_header().ok()?;
    geotiff(header.get_geotiff_crs().ok()??)
}

fn geotiff(mut keys: GeoTiffCrs) -> Option<Crs> {
    // 32767 stands for a system described by other keys.
    let code = |key: Option<u16>| key.filter(|k| (1..32767).contains(k)).map(u32::from);
    let projected = keys.get_projected_crs_geo_key_value();
    let horizontal = code(projected.or(keys.get_geodetic_crs_geo_key_value()));
    let vertical = code(keys.get_vertical_crs_geo_key_value());
    let [model, plane, height] = [MODEL, PLANE_UNIT, HEIGHT_UNIT].map(|id| number(&keys, id));
    let plane = match plane {
        Some(code) => length_of_code(code as u32),
        None => None,
    };
    let plane = plane.or(number(&keys, PLANE_LENGTH).filter(|x| *x > 0.0 && x.is_finite()));
    let mut texts = Vec::new();
    keys.entries.retain(|entry| {
        let citation = CITATIONS.contains(&entry.id);
        if let (true, GeoTiffData::String(text)) = (citation, &entry.data) {
            texts.push(text.trim_end_matches(['|', '\0', ' ']).to_owned());
        }
        !citation
    });
    keys.entries.sort_by_key(|entry| entry.id);
    let described = || {
        let mut parts = texts.iter().filter_map(|text| text.split_once(IN_CITATION));
        parts.find_map(|(_, text)| text.contains('[').then(|| well_known(text.trim())))
    };
    if let (None, Some(crs)) = (horizontal, described()) {
        return Some(crs);
    }
    let name = texts.into_iter().find(|text| !text.is_empty());
    let name = name.unwrap_or_else(|| format!("{} keys without a name", keys.entries.len()));
    let known = Crs {
        kind: match model.map(|model| model as u32) {
            Some(1) => Some(CrsKind::Projected),
            Some(2) => Some(CrsKind::Geographic),
            Some(3) => Some(CrsKind::Geocentric),
            _ => None,
        },
        unit: plane,
        height_unit: height.and_then(|code| length_of_code(code as u32)),
        normal: format!("{:?}", keys.entries),
        ..Crs::named(name, horizontal, vertical, CrsSource::GeotiffKeys)
    };
    (!keys.entries.is_empty()).then(|| known.completed())
}

/// The number that a key has.
fn number(keys: &GeoTiffCrs, id: u16) -> Option<f64> {
    let entry = keys.entries.iter().find(|entry| entry.id == id)?;
    match &entry.data {
        GeoTiffData::U16(number) => Some(f64::from(*number)),
        GeoTiffData::Doubles(numbers) => numbers.first().copied(),
        GeoTiffData::String(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn from(records: &[(u16, &[u8])]) -> Option<Crs> {
        let record = |(record_id, data): &(u16, &[u8])| Vlr {
            user_id: "LASF_Projection".into(),
            record_id: *record_id,
            data: data.to_vec(),
            ..Vlr::default()
        };
        from_records(records.iter().map(record))
    }

    fn keys(entries: &[[u16; 4]], texts: &str) -> Crs {
        let head = [[1, 1, 0, entries.len() as u16]];
        let words = head.iter().chain(entries).flatten();
        let keys: Vec<u8> = words.flat_map(|w| w.to_le_bytes()).collect();
        from(&[(34735, &keys), (TEXTS, texts.as_bytes())]).unwrap()
    }

    const UTM_17: &str = r#"PROJCS["NAD83 / UTM zone 17N", GEOGCS["NAD83", AUTHORITY["EPSG","4269"]],
        PROJECTION["Transverse_Mercator"], AUTHORITY["EPSG","26917"]]"#;

    #[test]
    fn numbers_decide_where_both_have_one() {
        let a = keys(&[[1024, 0, 1, 1], [3072, 0, 1, 26917]], "");
        // As written by another program: with more keys and a name.
        let name = [3073, 34737, 5, 0];
        let b = keys(
            &[
                [1024, 0, 1, 1],
                [3072, 0, 1, 26917],
                name,
                [3076, 0, 1, 9001],
            ],
            "UTM|",
        );
        let c = keys(&[[1024, 0, 1, 1], [3072, 0, 1, 32617]], "");
        assert!(!a.differs(&b) && a.differs(&c));
        let text = well_known(UTM_17);
        assert_eq!(text.to_string(), "EPSG:26917");
        assert!(!a.differs(&text) && c.differs(&text));
        let with_heights = |vertical| {
            let text =
                format!(r#"COMPD_CS["a",{UTM_17},VERT_CS["b",AUTHORITY["EPSG","{vertical}"]]]"#);
            well_known(&text)
        };
        assert_eq!(with_heights(5703).to_string(), "EPSG:26917+5703");
        assert!(!with_heights(5703).differs(&text));
        assert!(with_heights(5703).differs(&with_heights(6360)));
        let newer =
            well_known(r#"PROJCRS["UTM",BASEGEOGCRS["x",ID["EPSG",4269]],ID["EPSG",26917]]"#);
        assert!(!newer.differs(&text));
    }

    #[test]
    fn without_numbers_texts_of_one_kind_are_compared() {
        let a = well_known("LOCAL_CS[\"site\", UNIT[\"metre\", 1]]");
        let b = well_known("LOCAL_CS[\"site\",\n  UNIT[\"metre\",1]]");
        let c = well_known("LOCAL_CS[\"other site\",UNIT[\"metre\",1]]");
        assert!(!a.differs(&b) && a.differs(&c));
        assert_eq!(c.to_string(), "\"other site\"");
        // With a code for only one of the two, nothing can be decided.
        assert!(!a.differs(&well_known(UTM_17)));
        let user_defined = keys(&[[3072, 0, 1, 32767], [3073, 34737, 4, 0]], "own|");
        assert!(!user_defined.differs(&well_known(UTM_17)));
        assert_eq!(user_defined.to_string(), "\"own\"");
        // A code is of use without the text and the numbers of other keys.
        let lost = [
            [3072, 0, 1, 26917],
            [3073, TEXTS, 40, 9],
            [2057, NUMBERS, 1, 3],
        ];
        assert_eq!(keys(&lost, "").to_string(), "EPSG:26917");
    }

    #[test]
    fn records_that_are_wrong_are_no_reference_system() {
        assert!(from(&[]).is_none());
        assert!(from(&[(34735, &[1, 0, 1, 0, 0, 0, 9, 0, 0, 4])]).is_none());
        assert_eq!(well_known(&"A[".repeat(5000)).horizontal, None);
        assert_eq!(well_known("]]]],\"").horizontal, None);
    }
}
