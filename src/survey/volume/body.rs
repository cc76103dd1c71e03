//! The volume that a mesh encloses, as a whole and by component.

use super::components::{Components, Connections, Parts, Table, rim};
use super::report::{Body, Component, Group};
use super::sums::{Scale, Scales, plan_area};
use crate::pieces::{Pass, Piece, Surface};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::{Workspace, lock};
use outcrop_geom::vector::{V3, cross, dot, sub};
use std::cmp::Reverse;
use std::sync::Mutex;

/// Components that are told one by one: more than a screen has lines help nobody.
const LISTED: usize = 10;

/// Share of the free memory for the sums of components; the triangles are read again for those that do not fit.
const SHARE: u64 = 2;

/// The units of the sums.
struct Units {
    origin: V3,
    scales: Scales,
    surface: Scale,
}

impl Units {
    fn of(surface: &Surface) -> Self {
        let (low, high) = (surface.bounds().min, surface.bounds().max);
        let [x, y, z] = sub(high, low);
        // In the middle, so that heights are small.
        let origin = [low[0], low[1], low[2] / 2.0 + high[2] / 2.0];
        let diagonal = surface.bounds().diagonal();
        Self {
            origin,
            scales: Scales::of([x, y], z),
            surface: Scale::of(diagonal * diagonal),
        }
    }

    /// The parts of a triangle.
    fn parts(&self, corners: [u32; 3], triangle: &[V3; 3]) -> (Parts, f64) {
        let plan = plan_area(triangle);
        let [a, b, c] = *triangle;
        let normal = cross(sub(b, a), sub(c, a));
        let volume = plan * ((a[2] + b[2] + c[2]) / 3.0);
        let parts = Parts {
            triangles: 1,
            volume: self.scales.volume.whole(volume),
            area: self.surface.whole(dot(normal, normal).sqrt() / 2.0),
            rim: rim(corners),
        };
        (parts, plan)
    }
}

/// What is found of all components.
#[derive(Default)]
struct Found {
    closed: (u64, Parts),
    open: (u64, Parts),
    /// The largest that are closed, the largest first.
    largest: Vec<(u32, Parts)>,
}

impl Found {
    fn take(&mut self, number: u32, parts: Parts) {
        let group = match parts.rim {
            0 => &mut self.closed,
            _ => &mut self.open,
        };
        group.0 += 1;
        group.1.join(&parts);
        if parts.rim != 0 {
            return;
        }
        let rank = |(number, parts): &(u32, Parts)| {
            Reverse((parts.volume.unsigned_abs(), Reverse(*number)))
        };
        let place = self
            .largest
            .partition_point(|other| rank(other) < rank(&(number, parts)));
        if place < LISTED {
            self.largest.truncate(LISTED - 1);
            self.largest.insert(place, (number, parts));
        }
    }
}

/// Measures a mesh.
pub(crate) fn measure(surface: &Surface, workspace: &Workspace) -> Result<Body> {
    let connections = Connections::new(surface.vertices(), workspace)?;
    let pass = Pass {
        step: "connect triangles",
        name: "volume: triangles",
        origin: None,
        more: 0,
    };
    surface.for_each_piece(pass, workspace, |_, piece| {
        connections.add(&piece.corners);
        Ok(())
    })?;
    let components = connections.finish();
    let units = Units::of(surface);
    let mut found = Found::default();
    let mut facing = [0i128; 2];
    let fitting = workspace.memory.available() / SHARE / Table::EACH;
    let window = u64::from(components.count).min(fitting.max(1)) as u32;
    let mut first = 0;
    while first < components.count {
        let count = window.min(components.count - first);
        let held =
            workspace.reserve("volume: sums of components", u64::from(count) * Table::EACH)?;
        let table = Table::new(count);
        facing = sum(
            surface,
            &units,
            (&components, first),
            (&table, count),
            workspace,
        )?;
        for (number, parts) in (first..).zip(table.all()) {
            found.take(number, parts);
        }
        first += count;
        drop(held);
    }
    report(surface, &units, &components, &found, facing)
}

/// Adds all triangles to the table, whose first component is `first`; returns the areas that face up and down.
fn sum(
    surface: &Surface,
    units: &Units,
    (components, first): (&Components, u32),
    (table, count): (&Table, u32),
    workspace: &Workspace,
) -> Result<[i128; 2]> {
    let facing = Mutex::new([0i128; 2]);
    let pass = Pass {
        step: "volumes",
        name: "volume: triangles",
        origin: Some(units.origin),
        more: 0,
    };
    surface.for_each_piece(pass, workspace, |_, piece| {
        let own = add_piece(
            piece,
            units,
            |vertex| components.of(vertex),
            |component, parts| {
                // Those below the first wrap around to numbers above all.
                let number = component.wrapping_sub(first);
                if number < count {
                    table.add(number, parts);
                }
            },
        );
        let mut facing = lock(&facing);
        (facing[0], facing[1]) = (facing[0] + own[0], facing[1] + own[1]);
        Ok(())
    })?;
    let facing = *lock(&facing);
    Ok(facing)
}

/// Adds the triangles of a piece, those that follow each other in one component at once.
fn add_piece(
    piece: &Piece,
    units: &Units,
    component: impl Fn(u32) -> u32,
    add: impl Fn(u32, &Parts),
) -> [i128; 2] {
    let mut facing = [0i128; 2];
    let (mut at, mut run) = (u32::MAX, Parts::default());
    for (corners, triangle) in piece.corners.iter().zip(&piece.triangles) {
        let own = component(corners[0]);
        if own != at {
            if run.triangles > 0 {
                add(at, &run);
            }
            (at, run) = (own, Parts::default());
        }
        let (parts, plan) = units.parts(*corners, triangle);
        run.join(&parts);
        facing[usize::from(plan < 0.0)] += units.scales.area.whole(plan.abs());
    }
    if run.triangles > 0 {
        add(at, &run);
    }
    facing
}

fn report(
    surface: &Surface,
    units: &Units,
    components: &Components,
    found: &Found,
    facing: [i128; 2],
) -> Result<Body> {
    let group = |(count, parts): &(u64, Parts)| Group {
        components: *count,
        triangles: parts.triangles,
        area: units.surface.value(parts.area),
        volume: (parts.rim == 0).then(|| units.scales.volume.value(parts.volume)),
    };
    let mut numbers: Vec<u32> = found.largest.iter().map(|(number, _)| *number).collect();
    numbers.sort_unstable();
    let firsts = components.first_vertices(&numbers);
    let mut rest = found.closed;
    let mut largest = Vec::new();
    for (number, parts) in &found.largest {
        let place = numbers.partition_point(|other| other < number);
        largest.push(Component {
            volume: units.scales.volume.value(parts.volume),
            area: units.surface.value(parts.area),
            triangles: parts.triangles,
            vertex: firsts[place],
            position: surface.position(firsts[place])?,
        });
        rest.0 -= 1;
        rest.1.triangles -= parts.triangles;
        rest.1.volume -= parts.volume;
        rest.1.area -= parts.area;
    }
    let (closed, mut open) = (group(&found.closed), group(&found.open));
    open.volume = None;
    Ok(Body {
        is_closed: open.components == 0,
        volume: closed.volume.filter(|_| open.components == 0),
        area: units.surface.value(found.closed.1.area + found.open.1.area),
        facing_up: units.scales.area.value(facing[0]),
        facing_down: units.scales.area.value(facing[1]),
        closed,
        open,
        largest,
        rest: group(&rest),
    })
}
