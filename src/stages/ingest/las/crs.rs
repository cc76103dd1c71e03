//! The reference system given in a file, as far as needed to compare two of them.
//!
//! Coordinates are read unchanged; the records only serve for a warning. So errors in them are ignored.

use super::super::crs::Crs;
use super::super::input::{Input, u16_at, u64_at};
use super::Header;

/// User id of the records of reference systems.
const USER: &[u8] = b"LASF_Projection";

/// Record ids: GeoTIFF keys, their numbers and their texts, and well-known text.
const KEYS: u16 = 34735;
const NUMBERS: u16 = 34736;
const TEXTS: u16 = 34737;
const WELL_KNOWN: u16 = 2112;

/// Limits for the number of records read and for the size of one.
const MOST_RECORDS: u32 = 200;
const LARGEST: u64 = 64 << 10;

/// GeoTIFF keys with the code of a system, and keys that only describe one.
const GEOGRAPHIC: u16 = 2048;
const PROJECTED: u16 = 3072;
const VERTICAL: u16 = 4096;
const CITATIONS: [u16; 4] = [1026, 2049, 3073, 4097];

/// Deepest nesting accepted in well-known text.
const DEEPEST: usize = 32;

/// The records of a file that describe its reference system.
#[derive(Default)]
struct Records {
    keys: Vec<u8>,
    numbers: Vec<u8>,
    texts: Vec<u8>,
    well_known: Vec<u8>,
}

/// The reference system of a file, if it gives one.
pub(super) fn read(input: &Input, header: &Header) -> Option<Crs> {
    let mut records = Records::default();
    let plain = (header.vlrs, u32::MAX, 54, header.data);
    let extended = header
        .extended
        .map(|(start, count)| (start, count, 60, input.bytes));
    for (start, count, head_bytes, end) in std::iter::once(plain).chain(extended) {
        let mut at = Some(start);
        for _ in 0..count.min(MOST_RECORDS) {
            at = at.and_then(|at| records.take(input, at, head_bytes, end));
        }
    }
    records.crs()
}

impl Records {
    /// Reads the record at `at` if it is relevant; returns the offset of the next one.
    fn take(&mut self, input: &Input, at: u64, head_bytes: usize, end: u64) -> Option<u64> {
        let data = at.checked_add(head_bytes as u64)?;
        if data > end {
            return None;
        }
        let mut head = [0u8; 60];
        let head = &mut head[..head_bytes];
        (input.read_at(at, head).ok()? == head_bytes).then_some(())?;
        let bytes = match head_bytes {
            60 => u64_at(head, 20),
            _ => u64::from(u16_at(head, 20)),
        };
        let next = data.checked_add(bytes)?;
        let user = head[2..18].split(|b| *b == 0).next().unwrap_or(&[]);
        let slot = match (user == USER, u16_at(head, 18)) {
            (true, KEYS) => &mut self.keys,
            (true, NUMBERS) => &mut self.numbers,
            (true, TEXTS) => &mut self.texts,
            (true, WELL_KNOWN) => &mut self.well_known,
            _ => return Some(next),
        };
        if bytes <= LARGEST && next <= input.bytes {
            slot.resize(bytes as usize, 0);
            (input.read_at(data, slot).ok()? == slot.len()).then_some(())?;
        }
        Some(next)
    }

    /// From well-known text if present: files of newer point formats may have outdated keys beside it.
    fn crs(&self) -> Option<Crs> {
        let text = String::from_utf8_lossy(&self.well_known);
        let text = text.trim_matches(|c: char| c == '\0' || c.is_whitespace());
        if text.is_empty() {
            self.geotiff()
        } else {
            Some(well_known(text))
        }
    }

    fn geotiff(&self) -> Option<Crs> {
        let word = |at: usize| Some(u16_at(self.keys.get(at..at + 2)?, 0));
        let count = usize::from(word(6)?);
        let mut found: Vec<(u16, String)> = Vec::new();
        let mut name = String::new();
        for entry in 1..=count {
            let field = |n: usize| word(8 * entry + 2 * n);
            let (Some(key), Some(place), Some(size), Some(value)) =
                (field(0), field(1), field(2), field(3))
            else {
                break;
            };
            let (size, value) = (usize::from(size), usize::from(value));
            let shown = match place {
                0 => value.to_string(),
                NUMBERS => {
                    let bytes = self.numbers.get(8 * value..8 * (value + size));
                    format!("{:?}", bytes.unwrap_or_default())
                }
                _ => {
                    let text = self.texts.get(value..value + size).unwrap_or_default();
                    let text = String::from_utf8_lossy(text);
                    text.trim_end_matches(['|', '\0', ' ']).to_owned()
                }
            };
            match CITATIONS.contains(&key) {
                true if name.is_empty() => name = shown,
                true => {}
                false => found.push((key, shown)),
            }
        }
        found.sort();
        let code = |key: u16| {
            let (_, value) = found.iter().find(|(k, _)| *k == key)?;
            // 32767 stands for a system described by other keys.
            value.parse().ok().filter(|code| (1..32767).contains(code))
        };
        let projected = found.iter().any(|(key, _)| *key == PROJECTED);
        if name.is_empty() {
            name = format!("{} keys without a name", found.len());
        }
        (!found.is_empty()).then(|| Crs {
            horizontal: code(if projected { PROJECTED } else { GEOGRAPHIC }),
            vertical: code(VERTICAL),
            normal: format!("{found:?}"),
            name,
        })
    }
}

/// The system described by a well-known text, version 1 or 2.
fn well_known(text: &str) -> Crs {
    let mut crs = Crs {
        horizontal: None,
        vertical: None,
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

    fn keys(entries: &[[u16; 4]], texts: &str) -> Crs {
        let head = [[1, 1, 0, entries.len() as u16]];
        let words = head.iter().chain(entries).flatten();
        Records {
            keys: words.flat_map(|w| w.to_le_bytes()).collect(),
            texts: texts.into(),
            ..Records::default()
        }
        .crs()
        .unwrap()
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
    }

    #[test]
    fn records_that_are_wrong_are_no_reference_system() {
        let none = Records::default().crs();
        assert!(none.is_none());
        let cut = Records {
            keys: vec![1, 0, 1, 0, 0, 0, 9, 0, 0, 4],
            ..Records::default()
        };
        assert!(cut.crs().is_none());
        assert_eq!(well_known(&"A[".repeat(5000)).horizontal, None);
        assert_eq!(well_known("]]]],\"").horizontal, None);
    }
}
