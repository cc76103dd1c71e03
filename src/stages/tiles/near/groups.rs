//! The nearest neighbours of all points of a leaf together, each set in order of id. Nothing is sorted.

use super::sums::{Unknown, certain_body, divided_body};
use super::{APPROXIMATE, OwnPage, Query, Search, Sums};
use crate::ids::Id;
use crate::tiles::Tile;
use outcrop_geom::{Point, distance2};
use outcrop_paper::clip::wrap::{MOST_NEIGHBORS, TOGETHER};
use outcrop_paper::kernels::{BLOCK, Pick, SUMMED_LIMIT2, kernel, second_moments_body};
use outcrop_paper::plane::Moments;
use std::ops::Range;

/// Factor, in squared distance, by which a leaf's candidates are gathered farther for members with too few.
const FARTHER: u64 = 2;

/// Most times that this is done; members that then have too few need queries.
const MOST_FARTHER: usize = 2;

/// A point and its `k` nearest neighbours.
#[derive(Debug, Clone)]
pub struct Neighborhood {
    /// The id of the point.
    pub id: Id,
    /// Its position.
    pub point: Point,
    index: usize,
    /// Sums over the neighbours; `None` if they are not known here.
    pub sums: Option<Sums>,
    /// All points within this squared distance are neighbours.
    pub complete2: u64,
    ids: [u32; MOST_NEIGHBORS + BLOCK],
    /// Differences to the point, one axis after the other.
    columns: [[u32; MOST_NEIGHBORS + BLOCK]; 3],
}

impl Neighborhood {
    const NONE: Self = Self {
        id: Id::new(0),
        point: [0; 3],
        index: 0,
        sums: None,
        complete2: 0,
        ids: [0; MOST_NEIGHBORS + BLOCK],
        columns: [[0; MOST_NEIGHBORS + BLOCK]; 3],
    };

    /// The ids of the neighbours.
    #[must_use]
    pub fn ids(&self) -> &[u32; MOST_NEIGHBORS] {
        self.ids.first_chunk().unwrap_or(&[0; MOST_NEIGHBORS])
    }

    /// The differences to the neighbours, one axis after the other, with zeros at the end.
    #[must_use]
    pub fn differences(&self) -> [&[i32; MOST_NEIGHBORS]; 3] {
        self.columns.each_ref().map(|column| {
            let column: &[u32; MOST_NEIGHBORS] =
                column.first_chunk().unwrap_or(&[0; MOST_NEIGHBORS]);
            bytemuck::cast_ref(column)
        })
    }
}

/// The points of a leaf.
#[derive(Debug)]
pub struct Group<'a> {
    tile: &'a Tile,
    own: &'a OwnPage,
    search: &'a mut Search,
    k: usize,
    members: &'a [Neighborhood],
    farthest2: u64,
}

impl<'a> Group<'a> {
    /// The points, in order of id.
    #[must_use]
    pub fn members(&self) -> &'a [Neighborhood] {
        self.members
    }

    /// The coordinates of all points within a squared distance of any member, and of others; `None` if the
    /// points at hand do not reach that far.
    #[must_use]
    pub fn within(&self, distance2: u64) -> Option<[&[i32]; 3]> {
        // Those of the leaf, also while a query uses its own.
        let candidates = self
            .search
            .aside
            .as_ref()
            .unwrap_or(&self.search.candidates);
        let known = distance2 <= candidates.complete2;
        known.then(|| candidates.columns.coordinates(candidates.len))
    }

    /// A query for points beyond the neighbours of a member, which are known; none is listed yet.
    #[must_use]
    pub fn beyond(&mut self, member: usize) -> Query<'_> {
        let member = &self.members[member];
        self.search.swap_back();
        self.search.near.clear();
        let last2 = member.sums.map_or(0, |sums| sums.last2);
        Query {
            tile: self.tile,
            own: self.own,
            search: self.search,
            point: member.point,
            id: member.id,
            complete2: member.complete2.max(last2),
        }
    }

    /// A query for the neighbours of a member, as by [`Tile::for_each_query`].
    pub fn query(&mut self, member: usize) -> Option<Query<'_>> {
        let Neighborhood { index, id, .. } = self.members[member];
        self.search.swap_back();
        let query = self.tile.query(self.own, index, id, self.k, self.search)?;
        self.farthest2 = query.farthest2(self.k).max(self.farthest2);
        Some(query)
    }
}

impl Tile {
    /// Calls `each` with all points of the tile, at most [`TOGETHER`] of a leaf at a time, in order of
    /// id. The neighbours of a member are not known if there are more than [`MOST_NEIGHBORS`], if the leaf's
    /// candidates do not include them, or if only ids tell the last one from others.
    pub fn for_each_group(
        &self,
        k: usize,
        search: &mut Search,
        grown: impl FnMut(u64),
        mut each: impl FnMut(&mut Group<'_>),
    ) {
        let mut members = vec![Neighborhood::NONE; TOGETHER.min(self.leaf)];
        self.for_leaves(
            k,
            search,
            |id| self.ids.contains(&id),
            grown,
            |own, first, leaf, search| {
                let mut farthest2 = 0;
                let ids = self.ids.start.max(first)..self.ids.end.min(first + leaf.len());
                for begin in ids.clone().step_by(members.len()) {
                    let count = members.len().min(ids.end - begin);
                    let members = &mut members[..count];
                    for (id, member) in (begin..).zip(&mut *members) {
                        member.id = Id::at(id);
                        member.index = leaf.start + (id - first);
                        member.point = self.points.get(member.index);
                        member.sums = None;
                    }
                    if k <= MOST_NEIGHBORS {
                        self.take(own, leaf.clone(), k, search, members);
                    }
                    let last2 = members.iter().filter_map(|member| Some(member.sums?.last2));
                    farthest2 = last2.max().unwrap_or(0).max(farthest2);
                    let mut group = Group {
                        tile: self,
                        own,
                        search: &mut *search,
                        k,
                        members,
                        farthest2,
                    };
                    each(&mut group);
                    farthest2 = group.farthest2;
                    search.swap_back();
                }
                farthest2
            },
        );
    }

    /// Takes the neighbours of the members; gathers candidates farther from the leaf if there are too few.
    fn take(
        &self,
        own: &OwnPage,
        leaf: Range<usize>,
        k: usize,
        search: &mut Search,
        members: &mut [Neighborhood],
    ) {
        let (level, mut left) = (search.level, MOST_FARTHER);
        let mut few = (1u32 << members.len()) - 1;
        loop {
            for (place, member) in members.iter_mut().enumerate() {
                if few >> place & 1 == 1
                    && take_nearest(level, search, k, member) != Err(Unknown::Few)
                {
                    few &= !(1 << place);
                }
            }
            let before2 = search.candidates.complete2;
            if few == 0 || left == 0 || before2 >= own.reach2 {
                return;
            }
            left -= 1;
            let around = self.points.bounds(leaf.clone());
            let farther2 = before2.saturating_mul(FARTHER).min(own.reach2);
            search.gather(self, &around, farther2);
        }
    }
}

kernel! {
    /// Measures the candidates and takes the `k` nearest neighbours of a member.
    fn take_nearest(search: &mut Search, k: usize, member: &mut Neighborhood) -> Result<(), Unknown> = take_body<Eight>
}

#[inline(always)]
fn take_body<P: Pick>(
    search: &mut Search,
    k: usize,
    member: &mut Neighborhood,
) -> Result<(), Unknown> {
    let (room, limit) = divided_body::<P, true>(search, member.point, k)?;
    if certain_body(limit) >= SUMMED_LIMIT2 as f64 {
        return Err(Unknown::Close);
    }
    let distances = search.distances[..room].as_chunks::<BLOCK>().0;
    let [from_x, from_y, from_z, ids] = search.picked.blocks(room);
    let [to_x, to_y, to_z] = &mut member.columns;
    let mut count = 0;
    for ((((x, y), z), ids), distances) in from_x
        .iter()
        .zip(from_y)
        .zip(from_z)
        .zip(ids)
        .zip(distances)
    {
        // Without the point itself, and without points in the same place.
        let within = P::within(distances, limit) & !P::within(distances, 0.0);
        P::pack_at(x, within, to_x, count);
        P::pack_at(y, within, to_y, count);
        P::pack_at(z, within, to_z, count);
        P::pack_at(ids, within, &mut member.ids, count);
        count += within.count_ones() as usize;
    }
    if count != k {
        return Err(Unknown::Close);
    }
    for (column, own) in member.columns.iter_mut().zip(member.point) {
        for (place, at) in column[..MOST_NEIGHBORS].iter_mut().enumerate() {
            *at = if place < k {
                at.wrapping_sub(own as u32)
            } else {
                0
            };
        }
    }
    let [x, y, z] = member.differences();
    let (sum, products) = second_moments_body(x, y, z);
    let mut last2 = 0;
    for ((x, y), z) in x.iter().zip(y).zip(z) {
        last2 = distance2([*x, *y, *z], [0; 3]).max(last2);
    }
    member.sums = Some(Sums {
        moments: Moments::from_sums(k, sum, products),
        last2,
    });
    member.complete2 = (f64::from(limit) * (1.0 - APPROXIMATE)) as u64;
    Ok(())
}
