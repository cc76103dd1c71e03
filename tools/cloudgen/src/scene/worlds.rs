//! The surfaces of scenes. Lengths are metres in the room, the street and the land.

use super::Task;
use super::bodies::{ball, block, column, field, house, join, placed, prism};
use super::boxes::Boxes;
use crate::rng::{Purpose, Rng};
use crate::surface::{Bumpy, Sphere, Surface, Tessellation};
use crate::vec3::{length, scale};

/// Side of the sheet with a density jump.
pub(super) const SHEET: f64 = 400.0;

/// Side of the denser square in its middle.
pub(super) const DENSE: f64 = 80.0;

/// Side of the land.
pub(super) const LAND: f64 = 160.0;

/// A body with a curved side, straight ones, a re-entrant edge and a slanted top.
pub(super) fn edged() -> Tessellation {
    let at = |degrees: f64, radius: f64| {
        let (sin, cos) = libm::sincos(degrees.to_radians());
        [radius * cos, radius * sin]
    };
    let mut profile: Vec<[f64; 2]> = (0..=65).map(|i| at(2.0 * f64::from(i), 40.0)).collect();
    profile.extend([
        at(180.0, 45.0),
        at(205.0, 20.0),
        at(235.0, 46.0),
        at(310.0, 42.0),
    ]);
    prism(&profile, -18.0, |[x, _]| 14.0 + 0.25 * x)
}

/// A plate with nine fins and a rib across.
pub(super) fn fins() -> Tessellation {
    let mut boxes = Boxes::default();
    boxes.add([0.0; 3], [60.0, 40.0, 6.0]);
    for i in 0..9 {
        let x = 2.0 + 6.75 * f64::from(i);
        boxes.add([x, 2.0, 5.0], [x + 2.0, 38.0, 26.0]);
    }
    boxes.add([2.0, 18.5, 5.0], [58.0, 21.5, 12.0]);
    boxes.surface()
}

/// A room with a window, a table, a cupboard, a sofa, a bin, a lamp and a door that stands open.
pub(super) fn room() -> Tessellation {
    let mut boxes = Boxes::default();
    boxes.add([-0.2; 3], [5.2, 4.2, 2.9]);
    boxes.cut([0.0; 3], [5.0, 4.0, 2.7]);
    // A window in a niche.
    boxes.cut([1.5, -0.3, 0.9], [2.9, 0.1, 2.1]);
    boxes.add([1.4, -0.2, 0.8], [3.0, -0.15, 2.2]);
    // A table with a top of 3 cm.
    boxes.add([1.5, 1.5, 0.72], [3.1, 2.4, 0.75]);
    for (x, y) in [(1.55, 1.55), (1.55, 2.3), (3.0, 1.55), (3.0, 2.3)] {
        boxes.add([x, y, -0.05], [x + 0.05, y + 0.05, 0.73]);
    }
    boxes.add([4.3, 0.5, -0.05], [5.05, 2.0, 1.9]);
    boxes.add([0.3, 3.1, -0.05], [2.0, 3.8, 0.42]);
    boxes.add([0.3, 3.65, -0.05], [2.0, 3.9, 0.85]);
    let mut mesh = boxes.surface();
    // The door's leaf has 2 cm.
    let leaf = block([0.0, 0.0, 0.01], [0.9, 0.02, 2.0]);
    join(
        &mut mesh,
        &placed(leaf, 50f64.to_radians(), [3.3, 2.9, 0.0]),
    );
    join(&mut mesh, &placed(ball(0.18), 0.0, [2.3, 2.0, 2.1]));
    join(
        &mut mesh,
        &placed(column([0.12, 0.2], 0.6, 48), 0.0, [0.6, 0.6, -0.01]),
    );
    mesh
}

/// A street with façades on both sides.
pub(super) fn street(length: f64) -> Tessellation {
    let mut boxes = Boxes::default();
    boxes.add([0.0, -3.5, -1.0], [length, 3.5, 0.0]);
    boxes.add([0.0, 3.5, -1.0], [length, 12.0, 0.15]);
    boxes.add([0.0, -12.0, -1.0], [length, -3.5, 0.15]);
    facade(&mut boxes, length, [6.5, 11.5], 9.0);
    facade(&mut boxes, length, [-6.5, -11.5], 11.0);
    let every = |step: f64| (0..(length / step) as u32).map(move |i| step * f64::from(i));
    for x in every(10.0) {
        // A sign, thin, on a post.
        boxes.add([6.0 + x, -4.3, 0.1], [6.06 + x, -4.24, 2.6]);
        boxes.add([5.73 + x, -4.24, 2.0], [6.33 + x, -4.231, 2.6]);
    }
    for x in every(13.0) {
        // A car a quarter of a metre above the road, and a bench with a seat of 4 cm.
        boxes.add([3.0 + x, 1.4, 0.25], [7.2 + x, 3.1, 0.85]);
        boxes.add([3.9 + x, 1.5, 0.8], [6.3 + x, 3.0, 1.45]);
        boxes.add([8.0 + x, 4.6, 0.55], [9.6 + x, 5.1, 0.59]);
        boxes.add([8.1 + x, 4.7, 0.1], [8.16 + x, 5.0, 0.56]);
        boxes.add([9.44 + x, 4.7, 0.1], [9.5 + x, 5.0, 0.56]);
    }
    let mut mesh = boxes.surface();
    for x in every(10.0) {
        let post = column([0.08, 0.06], 6.0, 24);
        join(&mut mesh, &placed(post, 0.0, [4.0 + x, 4.2, 0.1]));
    }
    mesh
}

/// A wall from one `y` to another with three rows of windows and two cornices.
fn facade(boxes: &mut Boxes, length: f64, [front, back]: [f64; 2], height: f64) {
    let (low, high) = (front.min(back), front.max(back));
    boxes.add([0.5, low, 0.1], [length - 0.5, high, height]);
    for i in 0..((length - 2.0) / 3.2) as u32 {
        for k in 0..3 {
            let (x, z) = (1.5 + 3.2 * f64::from(i), 1.0 + 2.8 * f64::from(k));
            boxes.cut([x, front - 0.2, z], [x + 1.2, front + 0.2, z + 1.6]);
        }
    }
    for z in [3.3, 6.1] {
        boxes.add([0.5, front - 0.1, z], [length - 0.5, front + 0.1, z + 0.12]);
    }
}

fn hills(x: f64, y: f64) -> f64 {
    6.0 * libm::sin(x / 41.0) * libm::cos(y / 37.0)
        + 2.0 * libm::sin(x / 17.0 + 1.0) * libm::sin(y / 23.0)
        + 0.4 * libm::sin(x / 3.1) * libm::sin(y / 2.7)
}

/// Hills with houses and free-standing walls, which depend on the seed.
pub(super) fn land(seed: u64) -> Tessellation {
    let mut mesh = field([0.0; 2], [LAND; 2], [400; 2], hills);
    let mut rng = Rng::at(seed, Purpose::Object, 0);
    let mut within = |low: f64, high: f64| low + (high - low) * rng.uniform();
    let mut taken: Vec<[f64; 2]> = Vec::new();
    for _ in 0..14 {
        let [x, y] = [(); 2].map(|()| within(12.0, LAND - 12.0));
        let size = [within(6.0, 12.0), within(8.0, 16.0)];
        let (wall, roof, angle) = (within(3.0, 7.0), within(2.0, 4.0), within(0.0, 1.5));
        if taken.iter().any(|t| libm::hypot(x - t[0], y - t[1]) < 22.0) {
            continue;
        }
        taken.push([x, y]);
        let house = house(size, wall, roof);
        join(&mut mesh, &placed(house, angle, [x, y, hills(x, y)]));
    }
    for _ in 0..6 {
        let [x, y] = [(); 2].map(|()| within(20.0, LAND - 20.0));
        let (half, height, angle) = (within(5.0, 12.5), within(1.5, 2.5), within(0.0, 3.0));
        let wall = block([-half, -0.125, -1.5], [half, 0.125, height]);
        join(&mut mesh, &placed(wall, angle, [x, y, hills(x, y)]));
    }
    mesh
}

/// The smooth body, 100 high, on rough ground.
pub(super) fn statue() -> Tessellation {
    let ground = |x: f64, y: f64| {
        2.0 * libm::sin(x / 13.0) * libm::cos(y / 11.0)
            + 0.5 * libm::sin(x / 2.3) * libm::sin(y / 2.9)
    };
    let mut mesh = field([-90.0; 2], [90.0; 2], [257; 2], ground);
    let body = Bumpy::new(100.0);
    let [low, _] = body.bounds();
    let stand = [0.0, 0.0, -low[2] - 2.0];
    join(&mut mesh, &placed(body.reference(0.02), 0.3, stand));
    mesh
}

/// A gentle sheet.
pub(super) fn sheet() -> Tessellation {
    field([0.0; 2], [SHEET; 2], [200; 2], |x, y| {
        8.0 * libm::sin(x / 40.0) * libm::cos(y / 50.0)
    })
}

/// A plate of 60 by 40 whose thickness is the ratio in spacings.
pub(super) fn plate(task: &Task) -> Tessellation {
    let points = task.points.max(1) as f64;
    // The area depends on the thickness, and it on the spacing, slightly.
    let mut spacing = (4800.0 / points).sqrt();
    for _ in 0..20 {
        spacing = ((4800.0 + 200.0 * task.ratio * spacing) / points).sqrt();
    }
    block([0.0; 3], [60.0, 40.0, task.ratio * spacing])
}

/// A block with integer sides in the proportion 5 to 3, of a thickness, that has about as many lattice
/// points on its faces as are wanted.
pub(super) fn slab(task: &Task, thickness: f64) -> Tessellation {
    // 30 s² points on both large faces; 16 s on the rim for each step of the thickness.
    let b = 16.0 * thickness;
    let unit = ((b * b + 120.0 * task.points as f64).sqrt() - b) / 60.0;
    let sides = [5.0, 3.0].map(|side| (side * unit).round().max(1.0));
    block([0.0; 3], [sides[0], sides[1], thickness])
}

/// A cube with an integer side that has about as many lattice points on its faces as are wanted.
pub(super) fn cube(task: &Task) -> Tessellation {
    let side = (task.points as f64 / 6.0).sqrt().round().max(1.0);
    block([0.0; 3], [side; 3])
}

/// A round body with gentle waves.
pub(super) fn bust() -> Tessellation {
    let mut mesh = Sphere::new(100.0).reference(0.005);
    for v in &mut mesh.vertices {
        let d = scale(*v, 1.0 / length(*v));
        let waves = libm::sin(9.0 * d[0]) * libm::cos(4.0 * d[1]);
        *v = scale(d, 50.0 * (1.0 + 0.08 * waves));
    }
    mesh
}

/// Two squares of side 100 that face up, as far apart as the ratio says, in spacings.
pub(super) fn squares(task: &Task) -> Tessellation {
    let gap = task.ratio * (20_000.0 / task.points.max(1) as f64).sqrt();
    let mut mesh = field([0.0; 2], [100.0; 2], [1; 2], |_, _| 0.0);
    join(&mut mesh, &field([0.0; 2], [100.0; 2], [1; 2], |_, _| gap));
    mesh
}

#[cfg(test)]
mod tests {
    use super::super::bodies::volume;
    use super::*;
    use crate::surface::topology;

    #[test]
    fn closed_scenes_are_closed_and_face_outwards() {
        for (name, mesh) in [("edged", edged()), ("fins", fins()), ("bust", bust())] {
            assert_eq!(topology(&mesh), (2, true), "{name}");
            assert!(volume(&mesh) > 0.0, "{name}");
        }
        for (name, mesh) in [("room", room()), ("street", street(20.0))] {
            assert!(topology(&mesh).1, "{name}");
            assert!(volume(&mesh) > 0.0, "{name}");
        }
    }
}
