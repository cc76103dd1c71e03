//! Cells of the points of a leaf, computed together from their nearest neighbours.

use super::cell::{CellMaker, Outcome};
use super::fit::Fit;
use crate::ids::Id;
use crate::spacing::Nearby;
use crate::tiles::near::{Group, Neighborhood};
use outcrop_paper::clip::wrap::{Site, TOGETHER};
use outcrop_paper::kernels::Level;
use outcrop_paper::plane::{Moments, PLANES, Plane, planes};

impl CellMaker<'_> {
    /// Computes the cells of all members whose outlines are certified, by themselves or with farther points.
    /// `each` receives a member's id and the ids at the corners of its cell. The outcome is `None` for the
    /// members that need a query.
    pub fn from_group(
        &mut self,
        group: &mut Group<'_>,
        mut each: impl FnMut(Id, u32, u32),
    ) -> [Option<Outcome>; TOGETHER] {
        let members = group.members();
        let mut outcomes = [None; TOGETHER];
        let (places, sites) = self.wrap(members, &mut outcomes);
        for (lane, (place, site)) in places.into_iter().zip(sites).enumerate() {
            let (member, outline) = (&members[place], self.wrapper.outline(lane));
            let (ids, sides) = (member.ids(), outline.sides());
            let Some(last) = sides.last() else { continue };
            if outline.reach2() <= member.complete2 || self.is_clear(lane, member, group) {
                let mut before = ids[*last as usize];
                for side in sides {
                    let id = ids[*side as usize];
                    each(member.id, before, id);
                    before = id;
                }
                outcomes[place] = Some(Outcome::Complete);
            } else {
                self.cell.start(member.id.get(), site.normal, site.radius);
                for side in sides.iter().map(|side| *side as usize) {
                    let difference = site.differences.map(|column| i64::from(column[side]));
                    self.cell.clip(difference, ids[side]);
                }
                let id = member.id;
                outcomes[place] = Some(self.clip(&mut group.beyond(place), |a, b| each(id, a, b)));
            }
        }
        outcomes
    }

    /// Computes the outlines of the members with a disk, and returns their places and sites; the outcomes of
    /// those without one are known.
    fn wrap<'m>(
        &mut self,
        members: &'m [Neighborhood],
        outcomes: &mut [Option<Outcome>; TOGETHER],
    ) -> (Vec<usize>, Vec<Site<'m>>) {
        let planes = planes_of(members);
        let mut places = Vec::with_capacity(members.len());
        let mut sites = Vec::with_capacity(members.len());
        for (place, (member, plane)) in members.iter().zip(planes).enumerate() {
            let Some(sums) = member.sums else { continue };
            let fit = Fit::with(plane, sums);
            if !self.widen.is_enough(&fit.plane) {
                continue;
            }
            let near = Nearby {
                ids: bytemuck::cast_slice(&member.ids()[..self.neighbors]),
                differences: member.differences().map(|axis| &axis[..self.neighbors]),
            };
            match self.disk(member.id, &fit, near) {
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
        (places, sites)
    }

    /// True if the points at hand are all that may touch the outline of a member, and none of them does.
    fn is_clear(&self, lane: usize, member: &Neighborhood, group: &Group<'_>) -> bool {
        let reach2 = self.wrapper.outline(lane).reach2();
        let last2 = member.sums.map_or(0, |sums| sums.last2);
        let is_clear = |columns| self.wrapper.is_clear(lane, member.point, last2, columns);
        group.within(reach2).is_some_and(is_clear)
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
