//! Scanners and normals of the points of a cloud, and the files that bring them.

use crate::reference::{clouds, normals};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

type Point = [i32; 3];

/// Scanners, and which of them saw each point.
#[derive(Default)]
pub struct Seen {
    /// Places, ascending.
    pub scanners: Vec<Point>,
    /// For each point, the number of its scanner.
    pub by: Vec<Option<usize>>,
    /// For each point a normal, which only those without a scanner have; or nothing.
    pub normals: Vec<[i32; 3]>,
}

impl Seen {
    /// Scanners around and in a cloud; a few points were seen by none.
    pub fn some(points: &[Point], seed: u64) -> Self {
        let mut random = clouds::Random::new(seed);
        let most = points.iter().flatten().max().copied().unwrap_or(0);
        let mut place = || [0; 3].map(|_: i32| random.integer(-20, i64::from(most) + 20) as i32);
        let mut scanners: Vec<Point> = (0..3).map(|_| place()).collect();
        // Where a scanner is, it sees no point.
        scanners.retain(|s| !points.contains(s));
        scanners.sort_unstable();
        scanners.dedup();
        let all = scanners.len() as i64;
        let mut one = || usize::try_from(random.integer(0, 8) - 1).ok();
        let by = points
            .iter()
            .map(|_| one().map(|n| n % all.max(1) as usize));
        let by = by.map(|number| number.filter(|_| all > 0)).collect();
        Self {
            scanners,
            by,
            normals: Vec::new(),
        }
    }

    /// With normals that lead away from the middle, or up, or anywhere; some are turned, and some are none.
    pub fn with_normals(mut self, points: &[Point], seed: u64) -> Self {
        let mut random = clouds::Random::new(seed ^ 77);
        let most = points.iter().flatten().max().copied().unwrap_or(0);
        let turned = [0, 2, 10, 5][seed as usize % 4];
        let normal = |p: &Point| {
            let anywhere = [0; 3].map(|_: i32| random.integer(-9, 10) as i32);
            let from_middle = p.map(|x| 2 * x - most);
            let normal = match seed / 4 % 3 {
                0 => from_middle,
                1 => [anywhere[0], anywhere[1], 30],
                _ => anywhere,
            };
            match random.integer(0, 20) {
                0 => [0; 3],
                n if n <= turned => normal.map(|x| -x),
                _ => normal,
            }
        };
        self.normals = points.iter().map(normal).collect();
        self
    }

    /// The normal that counts of the points at each position.
    pub fn normals_at(&self, points: &[Point]) -> BTreeMap<Point, normals::Short> {
        let seen = self.at_positions(points);
        let mut all: BTreeMap<Point, normals::Short> = BTreeMap::new();
        for (p, normal) in points.iter().zip(&self.normals) {
            let normal = normals::short(normal.map(f64::from))
                .filter(|_| seen.get(p).is_none_or(Option::is_none));
            if let Some(normal) = normal {
                let least = all.entry(*p).or_insert(normal);
                *least = normal.min(*least);
            }
        }
        all
    }

    /// The scanner that counts of the points at each position.
    pub fn at_positions(&self, points: &[Point]) -> BTreeMap<Point, Option<Point>> {
        let mut all: BTreeMap<Point, Option<usize>> = BTreeMap::new();
        for (p, by) in points.iter().zip(&self.by) {
            let least = all.entry(*p).or_insert(*by);
            *least = (*by).min(*least);
        }
        let of = |by: Option<usize>| by.map(|number| self.scanners[number]);
        all.into_iter().map(|(p, by)| (p, of(by))).collect()
    }

    /// The files of a cloud: text, and a scan for each scanner.
    pub fn write(&self, points: &[Point], folder: &Path) -> Vec<PathBuf> {
        let mut texts = vec![(String::new(), 0); 1 + self.scanners.len()];
        for (number, &[x, y, z]) in points.iter().enumerate() {
            let by = self.by.get(number).copied().flatten();
            let [a, b, c] = by.map_or([0; 3], |number| self.scanners[number]);
            let (text, count) = &mut texts[by.map_or(0, |number| number + 1)];
            if by.is_none() && !self.normals.is_empty() {
                if text.is_empty() {
                    text.push_str("x y z Nx Ny Nz\n");
                }
                let [a, b, c] = self.normals[number];
                writeln!(text, "{x} {y} {z} {a} {b} {c}").unwrap();
                continue;
            }
            writeln!(text, "{} {} {}", x - a, y - b, z - c).unwrap();
            *count += 1;
        }
        let mut scans = String::new();
        for ((text, count), [x, y, z]) in texts[1..].iter().zip(&self.scanners).rev() {
            write!(
                scans,
                "1\n{count}\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n\
                 1 0 0 0\n0 1 0 0\n0 0 1 0\n{x} {y} {z} 1\n{text}"
            )
            .unwrap();
        }
        let files = [("cloud.xyz", &texts[0].0), ("scans.ptx", &scans)];
        let files = files.iter().filter(|(_, text)| !text.is_empty());
        let write = |(name, text): &(&str, &String)| {
            let path = folder.join(name);
            std::fs::write(&path, text).unwrap();
            path
        };
        files.map(write).collect()
    }
}
