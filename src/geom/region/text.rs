//! Regions as text: numbers, well-known text (WKT), GeoJSON.

use super::{NoRegion, Polygon, Region};
use geojson::{GeoJson, Geometry, GeometryValue};
use std::str::FromStr;
use wkt::Wkt;

/// Deepest nesting of brackets in WKT. A multipolygon has three; the parser calls itself for each.
const DEEPEST: usize = 8;

impl FromStr for Region {
    type Err = NoRegion;

    /// Reads `minx,miny,maxx,maxy`, `minx,miny,minz,maxx,maxy,maxz`, a polygon or multipolygon as WKT, or
    /// polygons as GeoJSON.
    fn from_str(text: &str) -> Result<Self, NoRegion> {
        if text.len() > Self::LONGEST {
            return Err(NoRegion::new(
                format!("a text of {} bytes", text.len()),
                format!("at most {}", Self::LONGEST),
            ));
        }
        let text = text.trim_start_matches('\u{feff}').trim();
        if let Some(numbers) = numbers(text) {
            return Self::of_numbers(&numbers);
        }
        let polygons = match text.starts_with('{') {
            true => of_geojson(text)?,
            false => of_wkt(text)?,
        };
        let region = Self::Polygons(polygons);
        region.check()?;
        Ok(region)
    }
}

impl Region {
    /// Largest text of a region, in bytes.
    pub const LONGEST: usize = 16 << 20;

    /// True if a text is a list of numbers, and not the name of a file.
    #[must_use]
    pub fn is_numbers(text: &str) -> bool {
        numbers(text).is_some()
    }
}

/// The numbers of a list of several.
fn numbers(text: &str) -> Option<Vec<f64>> {
    let numbers = text.split(',').map(|part| part.trim().parse().ok());
    let numbers: Vec<f64> = numbers.collect::<Option<_>>()?;
    (numbers.len() > 1).then_some(numbers)
}

/// The first characters of a text, for messages.
fn shown(text: &str) -> String {
    let first: String = text.chars().take(24).collect();
    format!("\"{}\"", first.escape_debug())
}

const EXPECTED: &str = "a polygon or multipolygon as WKT or GeoJSON";

fn of_wkt(text: &str) -> Result<Vec<Polygon>, NoRegion> {
    let mut depth = 0usize;
    for c in text.bytes() {
        match c {
            b'(' => depth += 1,
            b')' => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth > DEEPEST {
            let found = format!("WKT with brackets {depth} deep");
            return Err(NoRegion::new(found, EXPECTED));
        }
    }
    // The prefix of PostGIS; the reference system is that of the cloud.
    let plain = match text.split_once(';') {
        Some((first, rest)) if first.to_ascii_uppercase().starts_with("SRID=") => rest,
        _ => text,
    };
    let ring = |ring: &wkt::types::LineString<f64>| {
        let corners = ring.coords().iter().map(|c| [c.x, c.y]);
        open(corners.collect())
    };
    let polygon =
        |polygon: &wkt::types::Polygon<f64>| polygon.rings().iter().map(ring).collect::<Polygon>();
    match plain.parse::<Wkt<f64>>() {
        Ok(Wkt::Polygon(one)) => Ok(vec![polygon(&one)]),
        Ok(Wkt::MultiPolygon(all)) => Ok(all.polygons().iter().map(polygon).collect()),
        Ok(_) => Err(NoRegion::new(
            format!("{} as WKT", shown(text)),
            "a polygon or multipolygon",
        )),
        Err(why) => Err(NoRegion::new(format!("{} ({why})", shown(text)), EXPECTED)),
    }
}

fn of_geojson(text: &str) -> Result<Vec<Polygon>, NoRegion> {
    let parsed = text.parse::<GeoJson>();
    let parsed = parsed.map_err(|e| NoRegion::new(format!("invalid GeoJSON ({e})"), EXPECTED))?;
    let geometries: Vec<Geometry> = match parsed {
        GeoJson::Geometry(geometry) => vec![geometry],
        GeoJson::Feature(feature) => feature.geometry.into_iter().collect(),
        GeoJson::FeatureCollection(all) => {
            let features = all.features.into_iter();
            features.filter_map(|feature| feature.geometry).collect()
        }
    };
    let mut polygons = Vec::new();
    for geometry in geometries {
        match geometry.value {
            GeometryValue::Polygon { coordinates } => polygons.push(of_rings(&coordinates)?),
            GeometryValue::MultiPolygon { coordinates } => {
                for rings in &coordinates {
                    polygons.push(of_rings(rings)?);
                }
            }
            other => {
                return Err(NoRegion::new(
                    format!("a {} in GeoJSON", other.type_name()),
                    "only polygons and multipolygons",
                ));
            }
        }
    }
    Ok(polygons)
}

fn of_rings(rings: &[Vec<geojson::Position>]) -> Result<Polygon, NoRegion> {
    let corner = |position: &geojson::Position| match position.as_slice() {
        [x, y, ..] => Ok([*x, *y]),
        few => Err(NoRegion::new(
            format!("a position of {} number(s) in GeoJSON", few.len()),
            "two or three",
        )),
    };
    let ring = |ring: &Vec<geojson::Position>| {
        let corners: Result<Vec<_>, _> = ring.iter().map(corner).collect();
        Ok(open(corners?))
    };
    rings.iter().map(ring).collect()
}

/// The corners of a ring without the last one if it is the first one again.
fn open(mut corners: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    corners.dedup();
    if corners.len() > 1 && corners.first() == corners.last() {
        corners.pop();
    }
    corners
}
