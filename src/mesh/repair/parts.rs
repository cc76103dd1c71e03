//! Partial fillings: triangles too wide for the surrounding surface are left out.

use super::fill::Corner;
use outcrop_stages::spacing::Density;
use rustc_hash::FxHashSet;

/// The part of a filling that is kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// Its triangles, as indices of corners.
    pub triangles: Vec<[usize; 3]>,
    /// Number of edges that stay open.
    pub left: usize,
}

impl Part {
    /// A complete filling.
    pub fn whole(triangles: Vec<[usize; 3]>) -> Self {
        Self { triangles, left: 0 }
    }

    /// The triangles of a filling of the loop of `corners` without the wide ones. At each corner they form a
    /// fan from one edge of the loop to the next. Triangles of a fan between two that are left out are left
    /// out as well, so that the others share edges with the surface around the loop.
    pub fn not_wide(
        corners: &[Corner],
        mut triangles: Vec<[usize; 3]>,
        density: Density<'_>,
    ) -> Self {
        let wide = |t: &[usize; 3]| {
            let of = t.map(|x| &corners[x]);
            density.is_wide(of.map(|c| c.id), of.map(|c| c.file))
        };
        let mut goes: Vec<bool> = triangles.iter().map(wide).collect();
        if !goes.contains(&true) {
            return Self::whole(triangles);
        }
        let fans = fans(corners.len(), &triangles);
        let mut more = true;
        while more {
            more = false;
            for fan in &fans {
                more |= spread(fan, &mut goes);
            }
        }
        let mut number = 0;
        triangles.retain(|_| {
            number += 1;
            !goes[number - 1]
        });
        let left = open_edges(corners.len(), &triangles);
        Self { triangles, left }
    }
}

/// The fan of triangles at each corner, from the loop's edge to the next corner to its edge to the previous
/// corner.
fn fans(corners: usize, triangles: &[[usize; 3]]) -> Vec<Vec<usize>> {
    let mut fans: Vec<Vec<(usize, usize)>> = vec![Vec::new(); corners];
    for (number, t) in triangles.iter().enumerate() {
        for k in 0..3 {
            let after = |x: usize| (x + corners - t[k]) % corners;
            let nearest = after(t[(k + 1) % 3]).min(after(t[(k + 2) % 3]));
            fans[t[k]].push((nearest, number));
        }
    }
    let sorted = |mut fan: Vec<(usize, usize)>| {
        fan.sort_unstable();
        fan.into_iter().map(|(_, number)| number).collect()
    };
    fans.into_iter().map(sorted).collect()
}

/// Marks the triangles of a fan that lie between two marked ones; true if there were any.
fn spread(fan: &[usize], goes: &mut [bool]) -> bool {
    let first = fan.iter().position(|&t| goes[t]);
    let last = fan.iter().rposition(|&t| goes[t]);
    let between = match (first, last) {
        (Some(first), Some(last)) => &fan[first..=last],
        _ => &[],
    };
    let mut more = false;
    for &t in between {
        more |= !std::mem::replace(&mut goes[t], true);
    }
    more
}

/// The number of edges that stay open if a loop of `corners` corners is closed by these triangles.
fn open_edges(corners: usize, triangles: &[[usize; 3]]) -> usize {
    let sides = |t: &[usize; 3]| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])];
    let all: FxHashSet<(usize, usize)> = triangles.iter().flat_map(sides).collect();
    let of_loop = |(a, b): (usize, usize)| (a + 1) % corners == b || (b + 1) % corners == a;
    let closed = all.iter().filter(|side| of_loop(**side)).count();
    let chords = all
        .iter()
        .filter(|(a, b)| !of_loop((*a, *b)) && !all.contains(&(*b, *a)));
    corners - closed + chords.count()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A loop of eight corners whose filling is a fan around corner 0.
    fn fan_of_eight() -> Vec<[usize; 3]> {
        (1..7).map(|x| [0, x, x + 1]).collect()
    }

    #[test]
    fn the_fan_at_a_corner_is_in_order() {
        let fans = fans(8, &fan_of_eight());
        assert_eq!(fans[0], [0, 1, 2, 3, 4, 5]);
        assert_eq!(
            fans[3],
            [2, 1],
            "from the edge to corner 4 to that from corner 2"
        );
    }

    #[test]
    fn what_lies_between_two_that_go_goes() {
        let mut goes = [false, true, false, false, true, false];
        assert!(spread(&[0, 1, 2, 3, 4, 5], &mut goes));
        assert_eq!(goes, [false, true, true, true, true, false]);
        assert!(!spread(&[0, 1, 2, 3, 4, 5], &mut goes));
        assert!(!spread(&[0, 5], &mut goes));
    }

    #[test]
    fn open_edges_are_those_of_the_loop_and_chords_beside_a_gap() {
        let all = fan_of_eight();
        assert_eq!(open_edges(8, &all), 0);
        assert_eq!(open_edges(8, &[]), 8);
        // Without the third and fourth triangle: two edges of the loop, and the chords to corners 3 and 5.
        let rest = [&all[..2], &all[4..]].concat();
        assert_eq!(open_edges(8, &rest), 4);
    }
}
