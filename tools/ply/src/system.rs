//! The reference system of the coordinates, in comments of the header.

/// What comments tell of the reference system.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct System {
    /// Comment `epsg`: the EPSG code of the plane.
    pub epsg: Option<u32>,
    /// Comment `crs`: codes or a name.
    pub crs: Option<String>,
    /// Comment `heightunit`: metres in a unit of heights.
    pub height_unit: Option<f64>,
}

/// Names of the comments.
const EPSG: &str = "epsg";
const CRS: &str = "crs";
const HEIGHT_UNIT: &str = "heightunit";

impl System {
    /// The comments that give it.
    #[must_use]
    pub fn comments(&self) -> Vec<String> {
        let epsg = self.epsg.map(|code| format!("{EPSG} {code}"));
        let crs = self.crs.as_ref().map(|crs| format!("{CRS} {crs}"));
        let unit = self.height_unit.map(|unit| format!("{HEIGHT_UNIT} {unit}"));
        [epsg, crs, unit].into_iter().flatten().collect()
    }

    /// True if no comment tells anything.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Takes the words of a comment, if it is one of these.
    pub(crate) fn take(&mut self, words: &[&str]) {
        // As other programs write it: `EPSG: 25832`.
        let key = words.first().map(|key| key.trim_end_matches([':', '=']));
        let key = key.unwrap_or_default().to_ascii_lowercase();
        let rest = words.get(1..).unwrap_or_default();
        match (&*key, rest) {
            (EPSG, [codes]) => self.take_codes(codes),
            (CRS, words) if !words.is_empty() => self.crs = Some(words.join(" ")),
            (HEIGHT_UNIT, [unit]) => {
                let unit = unit.parse().ok();
                let unit = unit.filter(|unit: &f64| *unit > 0.0 && unit.is_finite());
                self.height_unit = unit.or(self.height_unit);
            }
            _ => {}
        }
    }

    /// Takes the code of the plane, or those of plane and heights as in `25832+7837`.
    fn take_codes(&mut self, codes: &str) {
        let code = |text: &str| text.parse().ok().filter(|code| *code > 0);
        match codes.split_once('+') {
            None => self.epsg = code(codes).or(self.epsg),
            Some((plane, heights)) => {
                if let (Some(plane), Some(heights)) = (code(plane), code(heights)) {
                    self.epsg = Some(plane);
                    self.crs = Some(format!("EPSG:{plane}+{heights}"));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Header;

    fn read(comments: &[&str]) -> System {
        let lines: String = comments.iter().map(|c| format!("comment {c}\n")).collect();
        let text = format!("ply\nformat ascii 1.0\n{lines}end_header\n");
        Header::read(&mut text.as_bytes()).unwrap().system
    }

    #[test]
    fn comments_are_read_as_they_were_written() {
        let system = System {
            epsg: Some(6543),
            crs: Some("EPSG:6543+5703".into()),
            height_unit: Some(1200.0 / 3937.0),
        };
        let comments = system.comments();
        let comments: Vec<&str> = comments.iter().map(String::as_str).collect();
        assert_eq!(comments[..2], ["epsg 6543", "crs EPSG:6543+5703"]);
        assert_eq!(read(&comments), system);
        assert!(read(&["of a site", "epsg", "crs"]).is_empty());
        assert_eq!(read(&["EPSG: 25832"]).epsg, Some(25832));
        assert_eq!(
            read(&["epsg 25832+7837"]),
            read(&["epsg 25832", "crs EPSG:25832+7837"])
        );
    }

    #[test]
    fn comments_that_are_no_system_are_text() {
        for odd in [
            "epsg none",
            "epsg 0",
            "epsg 1 2",
            "heightunit 0",
            "heightunit nan",
            "epsgish 5",
        ] {
            assert!(read(&[odd]).is_empty(), "{odd}");
        }
    }
}
