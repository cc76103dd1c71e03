//! The reference system given in a file, as far as needed to name it and to compare two of them.
//!
//! Coordinates are read unchanged, so errors in the records are ignored.

use super::super::crs::{Crs, CrsSource, LONGEST};
use super::super::input::Input;
use super::Header;
use super::vlr::Records;
use las::Vlr;
use las::crs::{GeoTiffCrs, GeoTiffData};
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

/// Deepest nesting accepted in well-known text.
const DEEPEST: usize = 32;

/// The reference system of a file, if it gives one.
pub(super) fn read(input: &Input, header: &Header) -> Option<Crs> {
    let plain = Records::plain(input, header).take(MOST_RECORDS);
    let extended = header.raw.evlr.map(|evlr| {
        let most = MOST_RECORDS.min(evlr.number_of_evlrs as usize);
        Records::extended(input, evlr.start_of_first_evlr).take(most)
    });
    let records = std::iter::once(plain).chain(extended);
    // The last record of a kind counts.
    let records: BTreeMap<u16, Vlr> = records
        .flat_map(|records| records.map_while(Result::ok))
        .filter(|(_, r)| r.is_wkt_crs() || r.is_geotiff_crs() && r.data.len() <= LARGEST_KEYS)
        .map(|(_, record)| (record.record_id, record))
        .collect();
    crs(records)
}

/// From well-known text if present: files of newer point formats may have outdated keys beside it.
fn crs(mut records: BTreeMap<u16, Vlr>) -> Option<Crs> {
    // Numbers and texts that are missing are no reason to refuse the codes.
    for record_id in [NUMBERS, TEXTS] {
        let record = records.entry(record_id).or_default();
        (record.user_id, record.record_id) = ("LASF_Projection".into(), record_id);
        record.data.resize(LARGEST_KEYS, 0);
    }
    let mut builder = las::Builder::from((1, 4));
    builder.vlrs = records.into_values().collect();
    let header = builder.into_header().ok()?;
    let text = String::from_utf8_lossy(header.get_wkt_crs_bytes().unwrap_or_default());
    match text.trim_matches(|c: char| c == '\0' || c.is_whitespace()) {
        "" => geotiff(header.get_geotiff_crs().ok()??),
        text => Some(well_known(text)),
    }
}

fn geotiff(mut keys: GeoTiffCrs) -> Option<Crs> {
    // 32767 stands for a system described by other keys.
    let code = |key: Option<u16>| key.filter(|k| (1..32767).contains(k)).map(u32::from);
    let projected = keys.get_projected_crs_geo_key_value();
    let horizontal = code(projected.or(keys.get_geodetic_crs_geo_key_value()));
    let vertical = code(keys.get_vertical_crs_geo_key_value());
    let mut name = String::new();
    keys.entries.retain(|entry| {
        let citation = CITATIONS.contains(&entry.id);
        if let (true, true, GeoTiffData::String(text)) = (citation, name.is_empty(), &entry.data) {
            name = text.trim_end_matches(['|', '\0', ' ']).to_owned();
        }
        !citation
    });
    keys.entries.sort_by_key(|entry| entry.id);
    if name.is_empty() {
        name = format!("{} keys without a name", keys.entries.len());
    }
    (!keys.entries.is_empty()).then(|| Crs {
        horizontal,
        vertical,
        source: CrsSource::GeotiffKeys,
        wkt: None,
        normal: format!("{:?}", keys.entries),
        name,
    })
}

/// The system described by a well-known text, version 1 or 2.
pub(in crate::stages::ingest) fn well_known(text: &str) -> Crs {
    let mut crs = Crs {
        horizontal: None,
        vertical: None,
        source: CrsSource::WellKnownText,
        wkt: (text.len() <= LONGEST).then(|| text.to_owned()),
        normal: String::with_capacity(text.len()),
        name: String::new(),
    };
    let mut path: Vec<String> = Vec::new();
    let mut word = String::new();
    let mut arguments: Vec<String> = Vec::new();
    let mut quoted = false;
    for c in text.chars() {
        if c == '"' {
            quoted = !quoted;
        }
        if quoted || !c.is_whitespace() {
            crs.normal.push(c);
        }
        match c {
            _ if quoted || c == '"' => word.extend((c != '"').then_some(c)),
            '[' | '(' => {
                path.push(std::mem::take(&mut word).trim().to_ascii_uppercase());
                arguments.clear();
                if path.len() > DEEPEST {
                    break;
                }
            }
            ',' => arguments.push(std::mem::take(&mut word)),
            ']' | ')' => {
                arguments.push(std::mem::take(&mut word));
                crs.close(&path, &arguments);
                path.pop();
                arguments.clear();
            }
            _ => word.push(c),
        }
        if crs.name.is_empty() && path.len() == 1 && c == ',' {
            crs.name = arguments.first().cloned().unwrap_or_default();
        }
    }
    crs
}

impl Crs {
    /// Takes the code of a system from a completed node of well-known text.
    fn close(&mut self, path: &[String], arguments: &[String]) {
        let path: Vec<&str> = path.iter().map(String::as_str).collect();
        let of = match path[..] {
            [of, "AUTHORITY" | "ID"] => of,
            ["COMPD_CS" | "COMPOUNDCRS", of, "AUTHORITY" | "ID"] => of,
            _ => return,
        };
        let [authority, code, ..] = arguments else {
            return;
        };
        let code = code.trim().parse().ok();
        if !authority.trim().eq_ignore_ascii_case("EPSG") || code.is_none() {
            return;
        }
        match of {
            "PROJCS" | "PROJCRS" | "PROJECTEDCRS" | "GEOGCS" | "GEOGCRS" | "GEOGRAPHICCRS"
            | "GEOCCS" | "GEODCRS" => self.horizontal = code,
            "VERT_CS" | "VERTCRS" | "VERTICALCRS" => self.vertical = code,
            _ => {}
        }
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
        crs(records.iter().map(|r| (r.0, record(r))).collect())
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
