//! Checks of a description.

use crate::cloud::{Cloud, DEFAULT_SIZE, Order};
use crate::error::{Error, Result};
use crate::kind::Kind;
use crate::outdoor::{HIGHEST_WALL, MOST_TREES, MOST_WIRES, Objects};
use crate::sampling::Sampling;
use crate::scene::{Measuring, Scene};

/// Largest number of layers of a cloud.
const MOST_LAYERS: u32 = 100;

/// Refuses numbers out of range and settings that exclude each other.
pub(crate) fn check(cloud: &Cloud) -> Result<()> {
    numbers(cloud)?;
    objects(&cloud.objects)?;
    if cloud.kind == Kind::Mesh && cloud.mesh.is_none() {
        return Err(Error::parameter("mesh", "nothing", "a mesh file"));
    }
    measuring(cloud)?;
    let excluded = excluded(cloud).or_else(|| excluded_outdoors(cloud));
    match excluded.or_else(|| excluded_in_scenes(cloud)) {
        Some((first, second, why)) => Err(Error::Conflict { first, second, why }),
        None => Ok(()),
    }
}

fn numbers(cloud: &Cloud) -> Result<()> {
    let finite = |name, values: &[f64]| match values.iter().find(|v| !v.is_finite()) {
        Some(value) => Err(Error::parameter(name, value, "a finite number")),
        None => Ok(()),
    };
    let fraction = |name, value: f64| match value {
        0.0..1.0 => Ok(()),
        _ => Err(Error::parameter(
            name,
            value,
            "a fraction from 0 to below 1",
        )),
    };
    if cloud.points > 1 << 48 {
        return Err(Error::parameter("points", cloud.points, "at most 2^48"));
    }
    if !(1e-100..1e100).contains(&cloud.size) {
        return Err(Error::parameter("size", cloud.size, "a positive number"));
    }
    if !(0.0..1e100).contains(&cloud.noise) {
        let expected = "zero or a positive number";
        return Err(Error::parameter("noise", cloud.noise, expected));
    }
    if !(1..=MOST_LAYERS).contains(&cloud.layers) {
        let expected = format!("1 to {MOST_LAYERS}");
        return Err(Error::parameter("layers", cloud.layers, expected));
    }
    if !(-1e100..1e100).contains(&cloud.layer_offset) {
        let expected = "a finite number";
        return Err(Error::parameter(
            "layer-offset",
            cloud.layer_offset,
            expected,
        ));
    }
    fraction("outliers", cloud.outliers)?;
    fraction("duplicates", cloud.duplicates)?;
    finite("offset", &cloud.offset)?;
    finite("scanner", cloud.scanner.as_ref().map_or(&[], |s| s))?;
    match cloud.scanlines {
        Some(ratio) if !(1.0..=1e6).contains(&ratio) => {
            let expected = "a ratio from 1 to 1e6";
            Err(Error::parameter("scanlines", ratio, expected))
        }
        _ => Ok(()),
    }
}

fn objects(objects: &Objects) -> Result<()> {
    let few = |name, found, most| match found <= most {
        true => Ok(()),
        false => Err(Error::parameter(name, found, format!("at most {most}"))),
    };
    few("trees", objects.trees, MOST_TREES)?;
    few("wires", objects.wires, MOST_WIRES)?;
    match objects.wall_height {
        Some(height) if !(0.0..=HIGHEST_WALL).contains(&height) => {
            let expected = format!("0 to {HIGHEST_WALL}");
            Err(Error::parameter("wall-height", height, expected))
        }
        _ => Ok(()),
    }
}

/// Two settings that exclude each other, and the reason.
fn excluded(cloud: &Cloud) -> Option<(&'static str, &'static str, &'static str)> {
    let special = if cloud.falloff {
        Some("falloff")
    } else {
        cloud.scanlines.map(|_| "scanlines")
    };
    let chosen = match cloud.sampling {
        Sampling::Uniform => None,
        Sampling::Regular => Some("regular sampling"),
        Sampling::Adaptive => Some("adaptive sampling"),
    };
    if cloud.scanner.is_some() && !cloud.falloff {
        let why = "without falloff the scanner has no effect";
        return Some(("scanner", "even density", why));
    }
    if cloud.falloff && cloud.order == Order::Sorted {
        let why = "the falloff draws points by chance, in no order";
        return Some(("falloff", "sorted order", why));
    }
    let takes_mesh = match cloud.kind {
        Kind::Scene(scene) => scene.takes_mesh(),
        kind => kind == Kind::Mesh,
    };
    if cloud.mesh.is_some() && !takes_mesh {
        let why = "only the kinds mesh, body-scan and edged take a file";
        return Some(("a mesh file", cloud.kind.name(), why));
    }
    if cloud.layers == 1 && cloud.layer_offset != 0.0 {
        let why = "there is no second one to shift";
        return Some(("layer-offset", "one layer", why));
    }
    if let (Some(first), Some(second)) = (special, chosen) {
        return Some((first, second, "each has its own density"));
    }
    if cloud.kind == Kind::Grid
        && let Some(first) = special.or(chosen)
    {
        return Some((first, "grid", "its nodes are fixed"));
    }
    if let (Kind::Odd(odd), Some(first)) = (cloud.kind, special.or(chosen)) {
        return Some((first, odd.name(), "it has a density of its own"));
    }
    if cloud.kind == Kind::Mesh && cloud.scanlines.is_some() {
        let why = "it has no direction to scan it in";
        return Some(("scanlines", "mesh", why));
    }
    None
}

/// The same for scenes.
fn excluded_in_scenes(cloud: &Cloud) -> Option<(&'static str, &'static str, &'static str)> {
    let Kind::Scene(scene) = cloud.kind else {
        let why = "only scenes have them";
        let plain = cloud.measuring == Measuring::EXACT;
        let first = "range-noise, registration, flying or ratio";
        return (!plain).then_some((first, cloud.kind.name(), why));
    };
    let sized = scene.takes_mesh() || scene == Scene::Strewn;
    let density = "it has a density of its own";
    [
        (
            cloud.size != DEFAULT_SIZE && !sized,
            "size",
            "it has a size of its own",
        ),
        (cloud.falloff, "falloff", density),
        (cloud.scanlines.is_some(), "scanlines", density),
        (cloud.sampling != Sampling::Uniform, "sampling", density),
        (
            cloud.measuring.ratio.is_some() && scene.ratio().is_none(),
            "ratio",
            "it has nothing that a ratio could change",
        ),
    ]
    .into_iter()
    .find_map(|(set, first, why)| set.then_some((first, scene.name(), why)))
}

/// Refuses errors of measurement that are out of range.
fn measuring(cloud: &Cloud) -> Result<()> {
    let measuring = &cloud.measuring;
    for (name, value, most) in [
        ("range-noise", measuring.noise, 100.0),
        ("registration", measuring.registration, 100.0),
        ("flying", measuring.flying, 0.5),
    ] {
        if !(0.0..=most).contains(&value) {
            return Err(Error::parameter(name, value, format!("0 to {most}")));
        }
    }
    let Kind::Scene(scene) = cloud.kind else {
        return Ok(());
    };
    match (scene.ratio(), measuring.ratio) {
        (Some((least, most, _)), Some(ratio)) if !(least..=most).contains(&ratio) => {
            let expected = format!("{least} to {most}");
            Err(Error::parameter("ratio", ratio, expected))
        }
        _ => Ok(()),
    }
}

/// The same for the outdoor world.
fn excluded_outdoors(cloud: &Cloud) -> Option<(&'static str, &'static str, &'static str)> {
    if cloud.kind != Kind::Outdoor {
        let why = "only the kind outdoor has them";
        let plain = cloud.objects == Objects::default();
        return (!plain).then_some(("trees, wires, wall-height or epoch", cloud.kind.name(), why));
    }
    let density = "it has a density of its own";
    [
        (cloud.size != DEFAULT_SIZE, "size", "it is always 400 wide"),
        (cloud.rotated, "rotated", "its ground must face up"),
        (cloud.layers > 1, "layers", "it is no surface to be shifted"),
        (cloud.falloff, "falloff", density),
        (cloud.scanlines.is_some(), "scanlines", density),
        (cloud.sampling != Sampling::Uniform, "sampling", density),
    ]
    .into_iter()
    .find_map(|(set, first, why)| set.then_some((first, Kind::Outdoor.name(), why)))
}
