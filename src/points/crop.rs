//! Selection of points by position: those in a region or within a margin around it.

use super::native::Native;
use super::source::Source;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::memory::{MemoryPool, Reservation};
use outcrop_geom::boxes::BoxTree;
use outcrop_geom::region::{Area, Region};

/// A region, and the margin around it within which points are read as well.
#[derive(Debug, Clone, PartialEq)]
pub struct Crop {
    /// The region.
    pub region: Region,
    /// Width of the margin, in the input's unit.
    pub margin: f64,
}

impl Crop {
    /// To be called if no point was kept.
    ///
    /// # Errors
    /// [`Error::Outside`] if some were left out because of their position.
    pub fn check_met(&self, sources: &[Source]) -> Result<()> {
        let mut boxes = sources.iter().filter_map(Source::whole_bounds);
        let Some(mut all) = boxes.next() else {
            return Ok(());
        };
        for [low, high] in boxes {
            for axis in 0..3 {
                all[0][axis] = all[0][axis].min(low[axis]);
                all[1][axis] = all[1][axis].max(high[axis]);
            }
        }
        let shown = |[x, y, z]: [f64; 3]| format!("{x},{y},{z}");
        Err(Error::Outside {
            region: self.region.to_string(),
            margin: self.margin,
            bounds: all.map(shown).join(" and "),
        })
    }
}

/// A crop prepared for tests of points.
#[derive(Debug)]
pub struct Nearby<'a> {
    area: Area<'a>,
    margin: f64,
    _held: Reservation,
}

impl<'a> Nearby<'a> {
    /// The same crop, with its outline in memory.
    ///
    /// # Errors
    /// [`Error::Memory`] if the outline does not fit into the budget.
    pub fn of(crop: &'a Crop, memory: &MemoryPool) -> Result<Self> {
        Ok(Self {
            _held: memory.reserve("crop: outline", crop.region.area_bytes())?,
            area: crop.region.area(),
            margin: crop.margin,
        })
    }

    /// False only if no point of a box is wanted.
    pub fn may_meet(&self, bounds: [[f64; 3]; 2]) -> bool {
        self.area.may_meet(bounds, self.margin)
    }

    /// Those of `boxes` that may have a wanted point, found by a tree of them.
    pub fn meeting(&self, boxes: &[[[f64; 3]; 2]]) -> Vec<usize> {
        let tree = BoxTree::of(boxes.iter().copied());
        let [min, max] = self.area.region().bounds();
        let low = [min[0] - self.margin, min[1] - self.margin, f64::MIN];
        let high = [max[0] + self.margin, max[1] + self.margin, f64::MAX];
        let near = tree.meeting([low, high]);
        near.filter(|n| self.may_meet(boxes[*n])).collect()
    }

    /// True if a point is read.
    #[inline]
    pub(super) fn takes(&self, position: [f64; 3]) -> bool {
        self.area.is_near(position, self.margin)
    }
}

impl Native {
    /// The position of a point, in the input's unit.
    #[inline]
    pub(super) fn position(&self, point: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Las { scale, offset } => {
                std::array::from_fn(|axis| point[axis] * scale[axis] + offset[axis])
            }
            Self::F32 | Self::F64 => point,
        }
    }
}
