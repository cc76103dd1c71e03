//! Tests: certified cells are those of clipping line by line.

use super::super::Cell;
use super::*;
use proptest::prelude::*;

type Differences = Vec<[i32; 3]>;

/// Anywhere, in a plane, on a grid in a plane (with many co-circular points), or around a circle.
fn clouds() -> impl Strategy<Value = Differences> {
    let all = |from: i32| prop::collection::vec(prop::array::uniform3(-from..from), 3..=32);
    prop_oneof![
        2 => all(1 << 20),
        1 => all(1 << 29),
        4 => (all(1 << 12), 0i32..1 << 8).prop_map(|(all, thick)| {
            all.iter().map(|[x, y, z]| [*x, *y, z % (thick + 1)]).collect()
        }),
        2 => all(4).prop_map(|all| all.iter().map(|[x, y, _]| [*x, *y, 0]).collect()),
        1 => (3usize..32, 10.0f64..1e6).prop_map(|(count, radius)| {
            let at = |k: usize| (k as f64 * std::f64::consts::TAU / count as f64).sin_cos();
            (0..count).map(at).map(|(s, c)| [(s * radius) as i32, (c * radius) as i32, 0]).collect()
        }),
    ]
}

fn length2(d: &[i32; 3]) -> u64 {
    d.iter().map(|c| i64::from(*c).pow(2) as u64).sum()
}

/// The pairs of neighbours at the corners of the cell, clipped line by line, and its reach.
fn clipped(differences: &[[i32; 3]], site: &Site<'_>) -> (Vec<(u32, u32)>, u64) {
    let mut numbers: Vec<usize> = (0..differences.len()).collect();
    numbers.sort_by_key(|n| (length2(&differences[*n]), *n));
    let cell = cell(differences, site, numbers.into_iter());
    (corners(&cell), cell.reach2())
}

/// The cell, clipped by the neighbours with these numbers in their order.
fn cell(differences: &[[i32; 3]], site: &Site<'_>, numbers: impl Iterator<Item = usize>) -> Cell {
    let mut cell = Cell::new(1000, site.normal, site.radius);
    for number in numbers {
        cell.clip(differences[number].map(i64::from), number as u32);
    }
    cell
}

fn corners(cell: &Cell) -> Vec<(u32, u32)> {
    let mut pairs = Vec::new();
    cell.triples(|a, b| pairs.push((a.min(b), a.max(b))));
    pairs.sort_unstable();
    pairs
}

fn pairs(outline: &Outline) -> Vec<(u32, u32)> {
    let sides = outline.sides();
    let next = sides.iter().cycle().skip(1);
    let mut pairs: Vec<_> = (sides.iter().zip(next))
        .map(|(a, b)| (u32::from(*a.min(b)), u32::from(*a.max(b))))
        .collect();
    pairs.sort_unstable();
    pairs
}

fn columns(differences: &[[i32; 3]]) -> [[i32; MOST_NEIGHBORS]; 3] {
    let mut columns = [[0; MOST_NEIGHBORS]; 3];
    for (place, difference) in differences.iter().enumerate() {
        for (column, at) in columns.iter_mut().zip(difference) {
            column[place] = *at;
        }
    }
    columns
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]
    #[test]
    fn certified_cells_are_those_of_clipping(
        clouds in prop::collection::vec(clouds(), 1..=TOGETHER),
        normal in prop_oneof![
            3 => Just([0, 0, 1 << 24]),
            1 => (-9i32..9, -9i32..9).prop_map(|(x, y)| [x << 18, y << 18, 1 << 24]),
        ],
        radius in prop_oneof![3 => Just(1e10), 1 => 1.0f64..1e6],
        near in 0usize..40,
    ) {
        let clouds: Vec<Differences> = clouds.into_iter().map(|all| {
            let mut all: Vec<_> = all.into_iter().filter(|d| *d != [0; 3]).collect();
            all.sort_by_key(length2);
            all
        }).collect();
        // Some of the neighbours are first left out, and examined later.
        let near: Vec<_> = clouds.iter().map(|all| {
            let last2 = all.get(near).or(all.last()).map_or(0, length2);
            all.partition_point(|d| length2(d) <= last2)
        }).collect();
        let columns: Vec<_> = clouds.iter().zip(&near)
            .map(|(all, near)| columns(&all[..*near])).collect();
        let sites: Vec<_> = columns.iter().zip(&near).map(|(columns, near)| Site {
            differences: columns.each_ref(),
            count: *near,
            normal,
            radius,
        }).collect();
        for level in Level::all() {
            let mut wrapper = Wrapper::at(level);
            wrapper.wrap(&sites);
            for (place, ((cloud, site), near)) in clouds.iter().zip(&sites).zip(&near).enumerate() {
                let outline = wrapper.outline(place);
                let pairs = pairs(outline);
                if pairs.is_empty() {
                    continue;
                }
                let (expected, reach2) = clipped(&cloud[..*near], site);
                prop_assert_eq!(&pairs, &expected);
                prop_assert!(outline.reach2().abs_diff(reach2) <= reach2 >> 20);
                let own = [1 << 28; 3];
                let all = [0, 1, 2].map(|axis| cloud.iter().map(|d| d[axis] + own[axis]).collect::<Vec<_>>());
                let known2 = cloud[..*near].last().map_or(0, length2);
                let all = all.each_ref().map(|column| &column[..]);
                let (expected, _) = clipped(cloud, site);
                if wrapper.is_clear(place, own, known2, all) {
                    prop_assert_eq!(&pairs, &expected);
                }
                // The sides suffice to clip on.
                let sides = outline.sides().iter().map(|side| usize::from(*side));
                let on = cell(cloud, site, sides.chain(*near..cloud.len()));
                prop_assert_eq!(corners(&on), expected);
            }
        }
    }

    /// Also where the last lanes are not used, and after cells with more neighbours.
    #[test]
    fn cells_of_scattered_points_are_certified(
        clouds in prop::collection::vec(
            prop::collection::vec((-1i32 << 24..1 << 24, -1i32 << 24..1 << 24), 20..=32), 1..=2 * TOGETHER),
    ) {
        let mut known = 0;
        let clouds: Vec<Differences> = clouds.iter()
            .map(|all| all.iter().map(|(x, y)| [*x | 1, *y, (x ^ y) % 64]).collect()).collect();
        for level in Level::all() {
            let mut wrapper = Wrapper::at(level);
            for clouds in clouds.chunks(TOGETHER) {
                let columns: Vec<_> = clouds.iter().map(|all| columns(all)).collect();
                let sites: Vec<_> = clouds.iter().zip(&columns).map(|(cloud, columns)| Site {
                    differences: columns.each_ref(),
                    count: cloud.len(),
                    normal: [0, 0, 1 << 24],
                    radius: 1e10,
                }).collect();
                wrapper.wrap(&sites);
                for (place, (cloud, site)) in clouds.iter().zip(&sites).enumerate() {
                    let outline = wrapper.outline(place);
                    let (pairs, _) = clipped(cloud, site);
                    // On the rim, or with more sides than there is room for.
                    let closed = pairs.len() >= 3 && {
                        let mut ends: Vec<_> = pairs.iter().flat_map(|(a, b)| [a, b]).collect();
                        ends.sort_unstable();
                        ends.chunk_by(|a, b| a == b).all(|same| same.len() == 2)
                    };
                    known += usize::from(closed);
                    prop_assert!(!closed || outline.sides().len() == pairs.len());
                }
            }
        }
        prop_assert!(known * 2 > clouds.len());
    }
}

/// Two bisectors that are almost parallel meet at 10^16 steps, a million times as far as the rim.
#[test]
fn a_corner_beyond_the_rim_is_not_certified() {
    let cloud = [
        [0, 2393, 0],
        [369_425_182, 244_874_119, 278_959_911],
        [-486_112_637, -322_220_617, 95_775_782],
    ];
    let columns = columns(&cloud);
    let site = Site {
        differences: columns.each_ref(),
        count: cloud.len(),
        normal: [0, 0, 1 << 24],
        radius: 1e10,
    };
    assert_eq!(clipped(&cloud, &site).0.len(), 2);
    for level in Level::all() {
        let mut wrapper = Wrapper::at(level);
        wrapper.wrap(&[site]);
        assert!(wrapper.outline(0).sides().is_empty());
    }
}
