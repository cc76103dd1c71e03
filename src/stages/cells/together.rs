//! Cells of the points of a leaf, computed together from their nearest neighbours.

use super::cell::{CellMaker, Fit, Outcome};
use crate::geom::clip::wrap::{Site, TOGETHER};
use crate::geom::plane::{Moments, PLANES, Plane, planes};
use crate::kernels::Level;
use crate::stages::tiles::near::{Group, Neighborhood};

impl CellMaker<'_> {
    /// Computes the cells of all members that the points around the leaf certify. `each` receives a member's
    /// id and the ids at the corners of its cell. The outcome is `None` for the members that need a query.
    pub fn from_group(
        &mut self,
        group: &Group<'_>,
        mut each: impl FnMut(u32, u32, u32),
    ) -> [Option<Outcome>; TOGETHER] {
        let members = group.members();
        let mut outcomes = [None; TOGETHER];
        let planes = planes_of(members);
        let mut sites = Vec::with_capacity(members.len());
        let mut places = Vec::with_capacity(members.len());
        for (place, (member, plane)) in members.iter().zip(planes).enumerate() {
            let Some(sums) = member.sums else { continue };
            let fit = Fit::with(plane, sums);
            if !self.widen.is_enough(&fit.plane) {
                continue;
            }
            match self.disk(member.id, &fit) {
                Err(outcome) => outcomes[place] = Some(outcome),
                Ok((normal, radius)) => {
                    places.push(place);
                    sites.push(Site {
                        differences: member.differences(),
                        count: self.neighbors,
                        normal,
                        radius,
                    });
                }
            }
        }
        self.wrapper.wrap(&sites);
        for (lane, place) in places.into_iter().enumerate() {
            let (member, outline) = (&members[place], self.wrapper.outline(lane));
            let (ids, sides) = (member.ids(), outline.sides());
            let Some(last) = sides.last() else { continue };
            if outline.reach2() > member.complete2 {
                let last2 = member.sums.map_or(0, |sums| sums.last2);
                let is_clear = |columns| self.wrapper.is_clear(lane, member.point, last2, columns);
                if !group.within(outline.reach2()).is_some_and(is_clear) {
                    continue;
                }
            }
            let mut before = ids[*last as usize];
            for side in sides {
                let id = ids[*side as usize];
                each(member.id, before, id);
                before = id;
            }
            outcomes[place] = Some(Outcome::Complete);
        }
        outcomes
    }
}

/// The planes of the members whose sums are known.
fn planes_of(members: &[Neighborhood]) -> [Plane; PLANES] {
    const { assert!(TOGETHER <= PLANES) };
    let mut moments = [Moments::default(); PLANES];
    for (member, moments) in members.iter().zip(&mut moments) {
        *moments = member.sums.map_or(*moments, |sums| sums.moments);
    }
    planes(Level::best(), &moments)
}
