//! The triangles of a block, with the vertex numbers of the mesh file.

use super::number::{Numbering, Split};
use outcrop_disk::error::Result;
use outcrop_disk::spill::Inbox;
use outcrop_disk::workspace::Unit;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_mesh::repair::{FilledTriangle, Surface};
use outcrop_mesh::surface::star::sorted;
use outcrop_stages::ids::{Id, Ids, Triangle};

/// The triangles whose smallest vertex is in a block.
pub struct Faces<'a> {
    numbering: &'a Numbering,
    ids: Ids,
    /// Numbers in the file of the block's vertices.
    numbers: Vec<u32>,
    /// Triangles of the surface, ascending by sorted ids.
    triangles: Vec<Triangle>,
    /// Triangles that fill holes, in the same order.
    filled: Vec<Triangle>,
    /// Corners that use copies of pinched vertices, by triangle.
    splits: Vec<Split>,
}

impl<'a> Faces<'a> {
    /// Reads the triangles of `block`, whose ids are `ids`.
    pub fn load(
        unit: &Unit<'_>,
        block: usize,
        surface: &Surface<'_>,
        filled: &Inbox<FilledTriangle>,
        numbering: &'a Numbering,
        ids: Ids,
    ) -> Result<Self> {
        let (triangles, _) = surface.load(unit, block)?;
        let filled = filled.get(unit, block)?;
        let filled = filled.iter().map(|f| f.triangle);
        let mut filled: Vec<_> = filled.filter(|t| t[0] >= ids.start).collect();
        filled.sort_unstable_by_key(|t| sorted(*t));
        Ok(Self {
            numbering,
            numbers: ids.iter().map(|v| numbering.vertex(v)).collect(),
            ids,
            triangles,
            filled,
            splits: numbering.splits.get(unit, block)?,
        })
    }

    /// Allocated bytes.
    pub fn bytes(&self) -> u64 {
        let triangles = bytes_of(&self.triangles) + bytes_of(&self.filled);
        triangles + bytes_of(&self.numbers) + bytes_of(&self.splits)
    }

    /// Triangles of the surface whose smallest vertex is in the block.
    fn own(&self) -> &[Triangle] {
        let first = self.triangles.partition_point(|t| t[0] < self.ids.start);
        &self.triangles[first..]
    }

    /// All triangles by their ids, those that fill holes last.
    pub fn ids(&self) -> impl Iterator<Item = &Triangle> + Clone {
        self.own().iter().chain(&self.filled)
    }

    /// Passes all triangles to `put`, ascending by sorted ids: the numbers of their corners, and the ids.
    pub fn for_each(&self, mut put: impl FnMut([u32; 3], Triangle)) {
        let mut filled = self.filled.iter().copied().peekable();
        let mut splits = &self.splits[..];
        // The smallest vertex of the next triangle that needs a lookup of copies or of another block.
        let mut special = Id::default();
        for &t in self.own() {
            if t[0] >= special {
                while let Some(f) = filled.next_if(|f| sorted(*f) < sorted(t)) {
                    put(self.special(f, &mut splits), f);
                }
                put(self.special(t, &mut splits), t);
                let next_filled = filled.peek().map_or(Id::NONE, |f| f[0]);
                special = next_filled.min(splits.first().map_or(Id::NONE, |s| s.triangle[0]));
            } else {
                put(t.map(|v| self.number(v)), t);
            }
        }
        filled.for_each(|f| put(self.special(f, &mut splits), f));
    }

    #[inline]
    fn number(&self, v: Id) -> u32 {
        let own = self.numbers.get(self.ids.find(v));
        own.copied().unwrap_or_else(|| self.numbering.vertex(v))
    }

    /// Numbers of a triangle whose corners may use copies.
    fn special(&self, t: Triangle, splits: &mut &[Split]) -> [u32; 3] {
        let mut out = t.map(|v| self.number(v));
        while let Some((s, rest)) = splits.split_first()
            && s.triangle == sorted(t)
        {
            for (corner, v) in out.iter_mut().zip(t) {
                if v == s.vertex {
                    *corner = self.numbering.first_copy(s.block.index()) as u32 + s.copy;
                }
            }
            *splits = rest;
        }
        out
    }
}
