//! Kinds of reference systems, and units of length.

use proj4rs::Proj;
use serde::{Deserialize, Serialize};

/// Kind of a reference system.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CrsKind {
    /// A plane in lengths, and heights over it.
    Projected,
    /// Longitude and latitude, and heights.
    Geographic,
    /// Lengths from the middle of the earth.
    Geocentric,
    /// A system of a site.
    Local,
}

/// Metres in a US survey foot.
const SURVEY_FOOT: f64 = 1200.0 / 3937.0;

/// Metres in units of length, by their EPSG codes.
const LENGTHS: [(u32, f64); 11] = [
    (1025, 0.001),
    (1033, 0.01),
    (9001, 1.0),
    (9002, 0.3048),
    (9003, SURVEY_FOOT),
    (9005, 0.304_797_265_4),
    (9014, 1.8288),
    (9030, 1852.0),
    (9036, 1000.0),
    (9093, 1609.344),
    (9096, 0.9144),
];

/// Systems of heights in feet, and in US survey feet, by their EPSG codes; of other codes heights are in metres.
const IN_FEET: [u32; 3] = [8050, 8051, 8228];
const IN_SURVEY_FEET: [u32; 6] = [5702, 6358, 6359, 6360, 8052, 8053];

/// Names of units.
const NAMES: [(f64, &str); 4] = [
    (1.0, "metres"),
    (0.3048, "feet"),
    (SURVEY_FOOT, "US survey feet"),
    (1000.0, "kilometres"),
];

/// Units closer to each other than this, in relation to their size, are one.
const SAME: f64 = 1e-7;

/// Metres in the unit of length with this EPSG code.
pub fn length_of_code(code: u32) -> Option<f64> {
    let known = LENGTHS.iter().find(|(known, _)| *known == code);
    known.map(|(_, length)| *length)
}

/// True if two units are the same.
pub(super) fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= SAME * a.abs()
}

/// The name of a unit.
pub(super) fn name(length: f64) -> String {
    let known = NAMES.iter().find(|(known, _)| same(*known, length));
    known.map_or_else(
        || format!("units of {length} m"),
        |(_, name)| (*name).to_owned(),
    )
}

/// Metres in a unit of heights of the system with this EPSG code.
pub(super) fn height_of_code(code: u32) -> f64 {
    match code {
        _ if IN_FEET.contains(&code) => 0.3048,
        _ if IN_SURVEY_FEET.contains(&code) => SURVEY_FOOT,
        _ => 1.0,
    }
}

/// Kind and unit of the system with this EPSG code, if it is known here.
pub(super) fn of_code(code: u32) -> Option<(CrsKind, Option<f64>)> {
    let system = Proj::from_epsg_code(u16::try_from(code).ok()?).ok()?;
    Some(match (system.is_latlong(), system.is_geocent()) {
        (true, _) => (CrsKind::Geographic, None),
        (_, true) => (CrsKind::Geocentric, Some(system.to_meter())),
        _ => (CrsKind::Projected, Some(system.to_meter())),
    })
}
