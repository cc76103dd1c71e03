//! Well-known text of reference systems, versions 1 and 2, as far as it tells codes, kinds and units.

use super::crs::{Crs, CrsSource, LONGEST};
use super::kind::CrsKind;

/// Deepest nesting accepted.
const DEEPEST: usize = 32;

/// The system described by a well-known text.
pub fn well_known(text: &str) -> Crs {
    let mut crs = Crs {
        wkt: (text.len() <= LONGEST).then(|| text.to_owned()),
        normal: String::with_capacity(text.len()),
        ..Crs::named(String::new(), None, None, CrsSource::WellKnownText)
    };
    let mut path: Vec<String> = Vec::new();
    let mut word = String::new();
    let mut arguments: Vec<String> = Vec::new();
    let (mut quoted, mut axis) = (false, Axis::default());
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
                // What a node has before the first node in it.
                crs.take(&path, &arguments, &mut axis);
                path.push(std::mem::take(&mut word).trim().to_ascii_uppercase());
                arguments.clear();
                if path.len() > DEEPEST {
                    break;
                }
                crs.open(&path);
            }
            ',' => arguments.push(std::mem::take(&mut word)),
            ']' | ')' => {
                arguments.push(std::mem::take(&mut word));
                crs.take(&path, &arguments, &mut axis);
                path.pop();
                arguments.clear();
            }
            _ => word.push(c),
        }
        if crs.name.is_empty() && path.len() == 1 && c == ',' {
            crs.name = arguments.first().cloned().unwrap_or_default();
        }
    }
    crs.completed()
}

/// The axis in which the text is.
#[derive(Debug, Default)]
struct Axis {
    up: bool,
}

/// The part of a path that begins with a system which is not a compound; none in a part of no system.
fn inside<'a, 'b>(mut path: &'a [&'b str]) -> Option<&'a [&'b str]> {
    loop {
        path = match path {
            ["COMPD_CS" | "COMPOUNDCRS", rest @ ..] | ["BOUNDCRS", "SOURCECRS", rest @ ..] => rest,
            [] | ["BOUNDCRS", ..] => return None,
            path => return Some(path),
        };
    }
}

fn is_vertical(word: &str) -> bool {
    matches!(word, "VERT_CS" | "VERTCRS" | "VERTICALCRS")
}

/// The kind of a system by its first word; none if it is no horizontal system.
fn kind_of(word: &str) -> Option<CrsKind> {
    Some(match word {
        "PROJCS" | "PROJCRS" | "PROJECTEDCRS" => CrsKind::Projected,
        "GEOGCS" | "GEOGCRS" | "GEOGRAPHICCRS" | "GEODCRS" | "GEODETICCRS" => CrsKind::Geographic,
        "GEOCCS" => CrsKind::Geocentric,
        "LOCAL_CS" | "ENGCRS" | "ENGINEERINGCRS" => CrsKind::Local,
        _ => return None,
    })
}

impl Crs {
    /// Takes the kind of a system that begins.
    fn open(&mut self, path: &[String]) {
        let path: Vec<&str> = path.iter().map(String::as_str).collect();
        if let Some([word]) = inside(&path)
            && self.kind.is_none()
        {
            self.kind = kind_of(word);
        }
    }

    /// Takes what a node tells by its arguments: codes, and units of axes.
    fn take(&mut self, path: &[String], arguments: &[String], axis: &mut Axis) {
        let path: Vec<&str> = path.iter().map(String::as_str).collect();
        let (Some(path), [first, second, ..]) = (inside(&path), arguments) else {
            return;
        };
        let (first, second) = (first.trim(), second.trim());
        match *path {
            [of, "AUTHORITY" | "ID"] => {
                let code = second.parse().ok();
                if first.eq_ignore_ascii_case("EPSG") && code.is_some() {
                    match is_vertical(of) {
                        true => self.vertical = code,
                        false if kind_of(of).is_some_and(|kind| kind != CrsKind::Local) => {
                            self.horizontal = code;
                        }
                        false => {}
                    }
                }
            }
            ["GEODCRS" | "GEODETICCRS", "CS"] if first.eq_ignore_ascii_case("Cartesian") => {
                self.kind = Some(CrsKind::Geocentric);
            }
            [_, "AXIS"] => axis.up = second.eq_ignore_ascii_case("up"),
            [of, "UNIT" | "LENGTHUNIT"] => self.take_unit(of, second, false),
            [of, "AXIS", "UNIT" | "LENGTHUNIT"] => self.take_unit(of, second, axis.up),
            _ => {}
        }
    }

    /// Takes the unit of a system; `up` if it is that of heights over a plane.
    fn take_unit(&mut self, of: &str, length: &str, up: bool) {
        let length = length
            .parse()
            .ok()
            .filter(|x: &f64| *x > 0.0 && x.is_finite());
        match kind_of(of) {
            _ if is_vertical(of) => self.height_unit = length,
            // That of geographic systems is an angle, but for heights.
            Some(CrsKind::Geographic) if up => self.height_unit = length,
            Some(CrsKind::Geographic) if self.kind == Some(CrsKind::Geocentric) => {
                self.unit = length
            }
            Some(CrsKind::Projected) if up => self.height_unit = length,
            Some(CrsKind::Projected | CrsKind::Geocentric | CrsKind::Local) => self.unit = length,
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_and_units_of_both_versions_are_told() {
        let plane = r#"PROJCS["a",GEOGCS["b",DATUM["c",SPHEROID["d",6378137,298.2]],UNIT["degree",0.0174]],
            PROJECTION["p"],PARAMETER["x",1],UNIT["US survey foot",0.3048006096012192,AUTHORITY["EPSG","9003"]],
            AXIS["E",EAST],AUTHORITY["EPSG","6543"]]"#;
        let height = r#"VERT_CS["h",VERT_DATUM["v",2005],UNIT["foot",0.3048],AXIS["H",UP]]"#;
        let crs = well_known(plane);
        assert_eq!(
            (crs.kind, crs.height_unit),
            (Some(CrsKind::Projected), None)
        );
        assert_eq!(crs.unit, Some(0.304_800_609_601_219_2));
        let crs = well_known(&format!("COMPD_CS[\"c\",{plane},{height}]"));
        assert_eq!(
            (crs.height_unit, crs.horizontal),
            (Some(0.3048), Some(6543))
        );
        let newer = r#"COMPOUNDCRS["c",PROJCRS["a",BASEGEOGCRS["b",DATUM["d",ELLIPSOID["e",6378137,298.2,
            LENGTHUNIT["metre",1]]]],CONVERSION["x",METHOD["m"],PARAMETER["f",1,LENGTHUNIT["metre",1]]],
            CS[Cartesian,2],AXIS["(E)",east,ORDER[1],LENGTHUNIT["foot",0.3048]],
            AXIS["(N)",north,ORDER[2],LENGTHUNIT["foot",0.3048]]],
            VERTCRS["h",VDATUM["v"],CS[vertical,1],AXIS["H",up],LENGTHUNIT["metre",1]]]"#;
        let crs = well_known(newer);
        assert_eq!((crs.unit, crs.height_unit), (Some(0.3048), Some(1.0)));
        let three = r#"PROJCRS["a",CS[Cartesian,3],AXIS["E",east,LENGTHUNIT["metre",1]],
            AXIS["N",north,LENGTHUNIT["metre",1]],AXIS["h",up,ORDER[3],LENGTHUNIT["foot",0.3048]]]"#;
        let crs = well_known(three);
        assert_eq!((crs.unit, crs.height_unit), (Some(1.0), Some(0.3048)));
        let bound =
            format!("BOUNDCRS[SOURCECRS[{plane}],TARGETCRS[GEOGCRS[\"w\",ID[\"EPSG\",4326]]]]");
        let crs = well_known(&bound);
        assert_eq!(
            (crs.horizontal, crs.kind),
            (Some(6543), Some(CrsKind::Projected))
        );
    }

    #[test]
    fn geocentric_systems_are_told_from_geographic_ones() {
        let unit = r#"LENGTHUNIT["kilometre",1000]"#;
        for (text, kind, length) in [
            (r#"GEOCCS["WGS 84",UNIT["metre",1]]"#.to_owned(), CrsKind::Geocentric, Some(1.0)),
            (
                format!(r#"GEODCRS["x",DATUM["d"],CS[Cartesian,3],AXIS["X",geocentricX],{unit}]"#),
                CrsKind::Geocentric,
                Some(1000.0),
            ),
            (
                r#"GEODCRS["x",DATUM["d"],CS[ellipsoidal,2],AXIS["lat",north],ANGLEUNIT["degree",0.017]]"#.into(),
                CrsKind::Geographic,
                None,
            ),
            (r#"GEOGCS["x",UNIT["degree",0.017]]"#.into(), CrsKind::Geographic, None),
            (r#"LOCAL_CS["site",UNIT["metre",1]]"#.into(), CrsKind::Local, Some(1.0)),
        ] {
            let crs = well_known(&text);
            assert_eq!((crs.kind, crs.unit), (Some(kind), length), "{text}");
        }
    }
}
