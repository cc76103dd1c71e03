//! Normals that points bring: directions for the disks (paper, section 3.3), and, where neighbours agree in sign,
//! evidence which side is out (not in the paper).

use super::attributes::StoredNormals;
use super::blocks::Blocks;
use super::ids::{Id, Ids};
use crate::order::PointStore;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::{Point, sub};
use outcrop_paper::method::METHOD;
use outcrop_paper::plane::Normal;
use outcrop_points::direction;
use serde::{Deserialize, Serialize};

/// What is done with the normals of the input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum InputNormals {
    /// Used where they suit the points.
    Auto,
    /// Used for every point that has one.
    Use,
    /// Not read.
    Ignore,
}

impl std::str::FromStr for InputNormals {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            "use" => Ok(Self::Use),
            "ignore" => Ok(Self::Ignore),
            _ => Err(format!("{text:?} is not auto, use or ignore")),
        }
    }
}

impl std::fmt::Display for InputNormals {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Auto => "auto",
            Self::Use => "use",
            Self::Ignore => "ignore",
        })
    }
}

/// The factor from the stored length of a normal to that of a plane's.
const SCALE: i32 = 1 << 9;

/// The normals of a cloud by id.
#[derive(Debug, Clone, Copy)]
pub struct Normals<'a> {
    stored: &'a StoredNormals,
    blocks: Blocks,
}

impl<'a> Normals<'a> {
    /// The normals of the points, which are divided into `blocks`.
    #[must_use]
    pub fn new(stored: &'a StoredNormals, blocks: Blocks) -> Self {
        Self { stored, blocks }
    }

    /// Bytes of memory for those of `ids` points while they are read.
    #[must_use]
    pub fn bytes(&self, ids: usize) -> u64 {
        self.stored.bytes(ids)
    }

    /// The normals of a range of ids.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn open(&self, unit: &Unit<'_>, ids: Ids) -> Result<Given> {
        Ok(Given {
            ids,
            blocks: self.blocks,
            words: self.stored.open(unit, ids.iter())?,
        })
    }

    /// The normals of some ids, ascending, in their order: of neighbours anywhere in the cloud.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn fetch(&self, unit: &Unit<'_>, ids: &[Id]) -> Result<Vec<Option<Normal>>> {
        let words = self.stored.open(unit, ids.iter().copied())?;
        Ok(words
            .as_chunks()
            .0
            .iter()
            .map(|words| normal(*words))
            .collect())
    }
}

/// The normal in these words, as long as that of a plane.
fn normal(words: [u32; 2]) -> Option<Normal> {
    direction(words).map(|n| n.map(|x| x * SCALE))
}

fn dot(a: Normal, b: Normal) -> i64 {
    let [x, y, z] = [0, 1, 2].map(|axis| i64::from(a[axis]) * i64::from(b[axis]));
    x + y + z
}

/// True if a point at the difference `d` is beside one with this normal: its height over the plane is at most a
/// quarter of its distance.
fn is_beside(normal: Normal, d: [i64; 3]) -> bool {
    let wide = |x: i64| i128::from(x);
    let along: i128 = (0..3).map(|k| wide(d[k]) * i128::from(normal[k])).sum();
    let distance2: i128 = d.iter().map(|x| wide(*x) * wide(*x)).sum();
    let sides = i128::from(METHOD.normals.sides);
    sides * sides * along * along <= distance2 * wide(dot(normal, normal))
}

/// The normals of consecutive points.
#[derive(Debug)]
pub struct Given {
    ids: Ids,
    blocks: Blocks,
    words: Vec<u32>,
}

impl Given {
    /// Allocated bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        bytes_of(&self.words)
    }

    /// The ids.
    #[must_use]
    pub fn ids(&self) -> Ids {
        self.ids
    }

    /// The normal of a point, about as long as that of a plane.
    #[must_use]
    #[inline]
    pub fn of(&self, id: Id) -> Option<Normal> {
        normal(*self.words.as_chunks().0.get(self.ids.find(id))?)
    }

    /// The normal of a point as a unit vector.
    #[must_use]
    pub fn unit(&self, id: Id) -> Option<[f64; 3]> {
        let n = self.of(id)?.map(f64::from);
        let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
        Some(n.map(|x| x / length))
    }

    /// True if a point has a normal, and most points beside it agree with its side: those behind it on the curve, of
    /// its run in its block, that have a normal and are not on another sheet. `at` has their positions.
    #[must_use]
    pub fn agrees(&self, id: Id, at: impl Fn(Id) -> Point) -> bool {
        let Some(own) = self.of(id) else { return false };
        let end = self.blocks.ids(self.blocks.of(id).index()).end;
        let run = Ids {
            start: id.behind(1),
            end: id.behind(METHOD.curve.run as u32).min(end),
        };
        let (mut others, mut against) = (0, 0);
        for other in run.iter() {
            if let Some(normal) = self.of(other)
                && is_beside(own, sub(at(other), at(id)))
            {
                others += 1;
                against += u64::from(dot(own, normal) <= 0);
            }
        }
        others >= METHOD.normals.beside && against * METHOD.normals.sides <= others
    }
}

/// True for the points at which sides are examined: one of each number of points on the curve.
#[must_use]
pub fn is_sample(id: Id) -> bool {
    u64::from(id.get()).is_multiple_of(METHOD.orientation.column)
}

/// What is known about the normals of a cloud.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct NormalStats {
    /// Names of their columns.
    pub columns: Vec<String>,
    /// True if neighbours agree in sign: normals tell which side is out.
    pub oriented: bool,
    /// Points without one.
    pub missing: u64,
    /// Points with one at which the signs were examined.
    pub sampled: u64,
    /// Those of them with which their neighbours agree.
    pub agreeing: u64,
}

impl std::fmt::Display for NormalStats {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let kind = match self.oriented {
            true => "oriented",
            false => "directions only",
        };
        write!(f, "{} ({kind})", self.columns.join(", "))?;
        match self.missing {
            0 => Ok(()),
            missing => write!(f, ", {missing} points without"),
        }
    }
}

/// Counts over the normals of some points.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
struct Looked {
    missing: u64,
    sampled: u64,
    agreeing: u64,
    down: u64,
}

impl Looked {
    fn of(given: &Given, points: &[Point]) -> Self {
        let at = |id: Id| points[given.ids.place(id)];
        let mut looked = Self::default();
        for id in given.ids().iter() {
            let normal = given.of(id);
            looked.missing += u64::from(normal.is_none());
            if let Some([_, _, z]) = normal.filter(|_| is_sample(id)) {
                looked.sampled += 1;
                looked.agreeing += u64::from(given.agrees(id, at));
                looked.down += u64::from(z < 0);
            }
        }
        looked
    }

    /// True if they tell which side is out. If all of them point up, they were turned so, and tell nothing.
    fn oriented(&self) -> bool {
        self.down > 0 && self.agreeing * METHOD.normals.sides >= self.sampled
    }
}

/// Looks through the normals of all points.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`], [`outcrop_disk::error::Error::Cancelled`].
pub fn look(
    normals: Normals<'_>,
    store: &PointStore,
    columns: Vec<String>,
    workspace: &Workspace,
) -> Result<NormalStats> {
    let blocks = normals.blocks;
    let bytes = |block: usize| {
        let ids = blocks.ids(block).len();
        normals.bytes(ids) + (ids * size_of::<Point>()) as u64
    };
    let work = |unit: &Unit<'_>| {
        let ids = blocks.ids(unit.number());
        let points = store.slice(ids.indices())?;
        let given = normals.open(unit, ids)?;
        let _held = unit.hold(given.bytes() + bytes_of(&points));
        Ok(Looked::of(&given, &points))
    };
    let mut all = Looked::default();
    workspace.units("normals", blocks.count(), bytes, work, |_, more| {
        all.missing += more.missing;
        all.sampled += more.sampled;
        all.agreeing += more.agreeing;
        all.down += more.down;
        Ok(())
    })?;
    Ok(NormalStats {
        columns,
        oriented: all.oriented(),
        missing: all.missing,
        sampled: all.sampled,
        agreeing: all.agreeing,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The normals of points, in words as they are stored.
    fn given(normals: &[Option<[i32; 3]>], block: u32) -> Given {
        let words = |n: &Option<[i32; 3]>| match n {
            Some(n) => {
                let [x, y, z] = n.map(|x| (x + 32767) as u32);
                [x << 16 | y, z << 16]
            }
            None => [u32::MAX, u32::MAX << 16],
        };
        Given {
            ids: Ids::at(&(0..normals.len())),
            blocks: Blocks::new(normals.len(), block),
            words: normals.iter().flat_map(words).collect(),
        }
    }

    const UP: Option<[i32; 3]> = Some([0, 0, 32767]);
    const DOWN: Option<[i32; 3]> = Some([0, 0, -32767]);

    /// Places on a plane, four in a row.
    fn flat(id: Id) -> Point {
        [id.get() as i32 % 4, id.get() as i32 / 4, 0].map(|x| 10 * x)
    }

    #[test]
    fn a_quarter_may_disagree() {
        let mut all = vec![UP; 128];
        let agrees = |all: &[_], block, id| given(all, block).agrees(Id::new(id), flat);
        assert!(agrees(&all, 100, 64));
        // Three of fifteen, and behind the run.
        (all[65], all[70], all[79], all[80]) = (DOWN, DOWN, DOWN, DOWN);
        assert!(agrees(&all, 1000, 64));
        all[71] = Some([32767, 0, 0]);
        assert!(!agrees(&all, 1000, 64));
        // Those without a normal do not count, nor those in another block; six are needed.
        all[65] = None;
        assert!(agrees(&all, 1000, 64) && !agrees(&all, 1000, 65));
        assert!(!agrees(&vec![UP; 128], 70, 64) && agrees(&vec![UP; 128], 71, 64));
        assert_eq!(given(&all, 1000).of(Id::new(71)), Some([32767 << 9, 0, 0]));
        assert_eq!(given(&all, 1000).unit(Id::new(70)), Some([0.0, 0.0, -1.0]));
        assert_eq!(given(&all, 1000).of(Id::new(128)), None);
    }

    #[test]
    fn points_on_another_sheet_do_not_count() {
        let normals: Vec<_> = (0..128)
            .map(|id| if id % 2 == 0 { UP } else { DOWN })
            .collect();
        let sheets = |id: Id| {
            let [x, y, _] = flat(Id::new(id.get() / 2));
            [x, y, 20 - 40 * (id.get() as i32 % 2)]
        };
        let given = given(&normals, 1000);
        assert!(given.agrees(Id::new(64), sheets) && !given.agrees(Id::new(64), flat));
        for (d, beside) in [
            ([4000, 0, 1032], true),
            ([4000, 0, 1033], false),
            ([-(1 << 30), 1 << 30, -(1 << 28)], true),
            ([0, 0, 1], false),
            ([0; 3], true),
        ] {
            assert_eq!(is_beside([0, 0, 1 << 24], d), beside, "{d:?}");
        }
    }

    #[test]
    fn clouds_are_oriented_if_a_quarter_agrees_and_not_all_point_up() {
        let looked = |sampled, agreeing, down| Looked {
            missing: 3,
            sampled,
            agreeing,
            down,
        };
        assert!(looked(100, 25, 1).oriented());
        assert!(!looked(100, 24, 50).oriented());
        assert!(!looked(100, 100, 0).oriented());
        assert!(!Looked::default().oriented());
        let mut all = vec![UP; 300];
        (all[0], all[5], all[128]) = (None, None, DOWN);
        let points: Vec<Point> = (0..300).map(|id| flat(Id::new(id))).collect();
        let found = Looked::of(&given(&all, 100), &points);
        assert_eq!(
            (found.missing, found.sampled, found.agreeing, found.down),
            (2, 4, 3, 1)
        );
    }
}
