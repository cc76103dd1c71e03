//! Gaussian splats in PLY: points with colours in the first coefficients of spherical harmonics.

use outcrop_disk::error::Setting;
use outcrop_disk::workspace::progress::Observer;
use outcrop_ply::{Element, Property, Scalar};
use outcrop_points::columns::COLORS;

/// The coefficients of the colours that do not depend on the direction.
const COEFFICIENTS: [&str; 3] = ["f_dc_0", "f_dc_1", "f_dc_2"];

/// Other properties of all splats.
const OTHERS: [&str; 3] = ["opacity", "scale_0", "rot_0"];

/// The spherical harmonic of degree 0.
const HARMONIC: f64 = 0.282_094_791_773_878_14;

/// What is said of such a file.
pub(super) fn note(observer: &dyn Observer) -> String {
    format!(
        "Gaussian splats: their centres are points, also those of transparent ones, with colours of f_dc; {} leaves \
         out floaters, and an editor of splats those of low opacity",
        observer.spell(&Setting::Flag("drop_outliers"))
    )
}

/// True if the vertices are splats without colours of their own.
pub(super) fn is_splats(element: &Element) -> bool {
    let kind = |name: &str| {
        let found = element.properties.iter().find(|p| p.0 == name);
        found.map(|(_, property)| *property)
    };
    let real = |name: &&str| {
        let kind = kind(name);
        [Scalar::F32, Scalar::F64]
            .map(|s| Some(Property::One(s)))
            .contains(&kind)
    };
    COEFFICIENTS.iter().chain(&OTHERS).all(real) && COLORS.iter().all(|name| kind(name).is_none())
}

/// The colour of which a property of splats is the coefficient.
pub(super) fn color_of(name: &str) -> Option<&'static str> {
    let at = COEFFICIENTS.iter().position(|own| *own == name);
    at.map(|at| COLORS[at])
}

/// A colour from 0 to 1.
#[inline]
pub(super) fn color(coefficient: f64) -> f64 {
    (0.5 + HARMONIC * coefficient).clamp(0.0, 1.0)
}
