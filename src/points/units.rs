//! The units of a reference system, and warnings about systems in which a mesh makes no sense.

use super::crs::Crs;
use super::kind::{CrsKind, height_of_code, name, of_code, same};
use super::stats::FileStats;
use outcrop_disk::error::Setting;
use outcrop_disk::workspace::progress::Observer;

impl Crs {
    /// The same, with the kind and the units that follow from the codes where the record does not tell them.
    pub fn completed(mut self) -> Self {
        if let Some((kind, unit)) = self.horizontal.and_then(of_code) {
            self.kind = self.kind.or(Some(kind));
            if self.kind == Some(kind) {
                self.unit = self.unit.or(unit);
            }
        }
        if self.kind == Some(CrsKind::Geographic) {
            self.unit = None;
        }
        self.height_unit = self.height_unit.or(self.vertical.map(height_of_code));
        self
    }

    /// Metres in a unit of heights: that of the plane, or one metre, where the system does not tell it.
    #[must_use]
    pub fn metres_of_heights(&self) -> f64 {
        self.height_unit.unwrap_or(self.usual_height_unit())
    }

    fn usual_height_unit(&self) -> f64 {
        self.unit.unwrap_or(1.0)
    }

    /// The unit of heights, if nothing else of the system tells it.
    pub(super) fn odd_height_unit(&self) -> Option<f64> {
        let odd = |unit: &f64| !same(*unit, self.usual_height_unit());
        self.height_unit.filter(odd)
    }

    /// The units in words: `in metres`, `in US survey feet, heights in metres`; nothing if they are not known.
    #[must_use]
    pub fn units(&self) -> String {
        let heights = match self.height_unit {
            Some(unit) => name(unit),
            None if self.kind == Some(CrsKind::Geographic) => "metres (taken so)".into(),
            None => String::new(),
        };
        let plane = match (self.kind, self.unit) {
            (Some(CrsKind::Geographic), _) => "degrees".to_owned(),
            (Some(CrsKind::Geocentric), Some(unit)) => {
                return format!("geocentric, in {}", name(unit));
            }
            (Some(CrsKind::Geocentric), None) => return "geocentric".into(),
            (_, Some(unit)) => name(unit),
            (_, None) if heights.is_empty() => return String::new(),
            (_, None) => return format!("heights in {heights}"),
        };
        match heights.is_empty() || heights == plane {
            true => format!("in {plane}"),
            false => format!("in {plane}, heights in {heights}"),
        }
    }
}

/// The lowest and the highest corner of all files.
fn bounds(files: &[FileStats]) -> Option<[[f64; 3]; 2]> {
    let boxes = files.iter().filter_map(|file| Some([file.min?, file.max?]));
    boxes.reduce(|a, b| {
        [
            [0, 1, 2].map(|k| a[0][k].min(b[0][k])),
            [0, 1, 2].map(|k| a[1][k].max(b[1][k])),
        ]
    })
}

/// A system in metres for a place in degrees: a zone of UTM, or one of the poles.
fn metric_system([low, high]: [[f64; 3]; 2]) -> u32 {
    let middle = |axis: usize| (low[axis] + high[axis]) / 2.0;
    let (longitude, latitude) = (middle(0), middle(1));
    let zone = (((longitude + 180.0).rem_euclid(360.0) / 6.0).floor() as u32 + 1).min(60);
    match latitude {
        _ if latitude > 84.0 => 32661,
        _ if latitude < -80.0 => 32761,
        _ if latitude < 0.0 => 32700 + zone,
        _ => 32600 + zone,
    }
}

/// A warning if a mesh in this system makes no sense: its axes have different units, or up is not z.
pub(super) fn warning(files: &[FileStats], crs: &Crs, observer: &dyn Observer) -> Option<String> {
    let path = files.first()?.path.display().to_string();
    let corners = bounds(files)?;
    let how = |code: String| {
        format!(
            "reproject the cloud first, as with `pdal translate {path} metres.laz reprojection \
             --filters.reprojection.out_srs=EPSG:{code}`"
        )
    };
    let option = |name| observer.spell(&Setting::Option(name));
    match crs.kind? {
        CrsKind::Geographic => {
            let reach = corners
                .as_flattened()
                .chunks(3)
                .flat_map(|corner| &corner[..2]);
            let reach = reach.fold(0.0, |most: f64, x| most.max(x.abs()));
            Some(match reach <= 360.0 {
                true => format!(
                    "{path}: its reference system {crs} is in degrees, so the mesh would be in degrees by {}: \
                     {}",
                    name(crs.metres_of_heights()),
                    how(metric_system(corners).to_string())
                ),
                false => format!(
                    "{path}: its reference system {crs} is in degrees, but coordinates reach {reach}: it is \
                     wrong, and {} gives the right one",
                    option("crs")
                ),
            })
        }
        CrsKind::Geocentric => Some(format!(
            "{path}: its coordinates are geocentric ({crs}), so z is not up, and which side is out may be \
             wrong without {}: {}",
            option("facing"),
            how("CODE".into())
        )),
        CrsKind::Projected | CrsKind::Local => None,
    }
}

#[cfg(test)]
mod tests {
    use super::super::crs::CrsSource;
    use super::*;

    /// Metres in a US survey foot.
    const FEET: f64 = 1200.0 / 3937.0;

    #[test]
    fn zones_are_those_of_utm() {
        let at = |x: f64, y: f64| metric_system([[x, y, 0.0], [x, y, 9.0]]);
        assert_eq!(at(9.0, 48.0), 32632);
        assert_eq!(at(-79.4, 43.6), 32617);
        assert_eq!(at(151.2, -33.9), 32756);
        assert_eq!(
            (at(-180.0, 1.0), at(179.99, 1.0), at(180.0, 1.0)),
            (32601, 32660, 32601)
        );
        assert_eq!((at(0.0, 89.0), at(0.0, -89.0)), (32661, 32761));
    }

    #[test]
    fn codes_tell_kinds_and_units() {
        let of = |plane, heights| {
            Crs::named(String::new(), Some(plane), heights, CrsSource::GeotiffKeys).completed()
        };
        assert_eq!(of(25832, None).units(), "in metres");
        assert_eq!(
            of(6543, Some(5703)).units(),
            "in US survey feet, heights in metres"
        );
        assert_eq!(of(6543, Some(6360)).units(), "in US survey feet");
        assert_eq!(of(2994, Some(8228)).units(), "in feet");
        assert_eq!(
            of(4326, None).units(),
            "in degrees, heights in metres (taken so)"
        );
        assert_eq!(of(4978, None).units(), "geocentric, in metres");
        assert_eq!(of(1_000_000, None).units(), "");
        assert_eq!(of(25832, Some(6360)).odd_height_unit(), Some(FEET));
        assert_eq!(of(6543, Some(6360)).odd_height_unit(), None);
        assert_eq!(of(6543, None).metres_of_heights(), FEET);
    }
}
