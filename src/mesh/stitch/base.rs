//! The base: T3 triangles without non-manifold edges and vertices by excess (paper, section 3.5,
//! first part).

use super::BaseStats;
use super::StitchOptions;
use crate::surface::evidence::{Division, Evidence, UP, Witness};
use crate::surface::orient::{BlockTriangles, Oriented, orient_inside};
use crate::surface::rows::TriangleTo;
use crate::surface::star::{Link, Star, Triangle, has, others};
use crate::triples::{Triples, VisitingTriple};
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Inbox, Shuffle, Table, release};
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_paper::kernels::{Level, MOST_EDGES, is_one_fan};
use outcrop_stages::blocks::Blocks;
use outcrop_stages::cells::CountedTriple;
use outcrop_stages::columns::{Direction, extreme};
use outcrop_stages::ids::{Block, Id, TriangleIndex};
use outcrop_stages::located::{Located, Places};
use serde::{Deserialize, Serialize};

/// The base, and the candidates for insertion.
#[derive(Debug)]
pub(super) struct Base {
    /// Triangles of the base, oriented.
    pub surface: Oriented,
    /// Interior candidates by block; a count of 3 means a T3 triangle that was flagged.
    pub candidates: Table<CountedTriple>,
    /// All crossing triples by the block of their smallest vertex.
    pub crossing: Table<CountedTriple>,
    /// Crossing triples by the blocks of their other vertices.
    pub visiting: Inbox<VisitingTriple>,
    /// Crossing T3 triangles that are flagged, by the block of their smallest vertex.
    pub flags: Inbox<TriangleTo>,
    sent_flags: Shuffle<TriangleTo>,
    /// For each block, the first and the last block touched by a triple of it.
    pub spans: Vec<(Block, Block)>,
    /// Interior candidates left out because their points are collinear in the file.
    pub flat_candidates: u64,
}

release!(Base: surface, candidates, crossing, sent_flags);

/// Computes the base. The triples are read once; the part needed later is written to separate tables, and
/// `triples.own` is deleted.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`],
/// [`outcrop_disk::error::Error::Cancelled`].
pub(super) fn base(
    places: Places<'_>,
    triples: &Triples,
    blocks: Blocks,
    options: StitchOptions,
    workspace: &Workspace,
) -> Result<(Base, BaseStats)> {
    let count = blocks.count();
    let visiting = triples.visiting.open(workspace, count)?;
    let highest = |unit: &Unit<'_>| extreme(places.shape, Direction::UP, blocks, unit);
    let up = !places.outside.is_some_and(|outside| outside.is_for_all());
    let by_evidence = match options.weigh {
        Some(division) if up => Some((division, Some(workspace.once("columns", highest)?))),
        Some(division) => Some((division, None)),
        None => None,
    };
    let look = Look {
        candidates: Table::new("stitch.candidates", count),
        crossing: Table::new("stitch.crossing", count),
        flags: Shuffle::new("stitch.flags"),
        own: &triples.own,
        visiting: &visiting,
        places,
        by_evidence,
        blocks,
    };
    let bytes = |block: usize| {
        let records = triples.own.expected_rows(workspace, block) + visiting.rows(block);
        let outside = places.outside.filter(|_| options.weigh.is_some());
        let known = outside.map_or(0, |o| o.bytes(blocks.ids(block).len()));
        100 * records as u64 + known + (3 << 20)
    };
    let around = |unit: &Unit<'_>| look.block(unit);
    let name = "stitch.base";
    let mut all = Found::default();
    let mut spans = vec![<(Block, Block)>::default(); count];
    let each = |block: usize, found: Found| {
        spans[block] = found.span;
        all.flagged += found.flagged;
        all.flat += found.flat;
        all.flat_candidates += found.flat_candidates;
    };
    let inside = workspace.part("base", || {
        orient_inside(name, around, each, bytes, blocks, options.weigh, workspace)
    })?;
    let start = std::time::Instant::now();
    let flags = look.flags.open(workspace, count)?.unique();
    if !options.keep_triples {
        triples.own.release(workspace)?;
    }
    let (surface, flagged) = workspace.once("join", |unit| {
        let counts = (0..count).map(|block| Ok(flags.get(unit, block)?.len() as u64));
        let flagged: u64 = counts.sum::<Result<_>>()?;
        Ok((inside.join(name, &flags, blocks, unit)?, flagged))
    })?;
    inside.release(workspace)?;
    if let Some((_, Some(highest))) = &look.by_evidence {
        highest.release(workspace)?;
    }
    workspace.note_part("orient", start.elapsed().as_secs_f64());
    let stats = BaseStats {
        flagged: all.flagged + flagged,
        unfit: all.flat,
        mobius: surface.mobius,
        triangles: surface.triangles,
    };
    let base = Base {
        surface: surface.open(workspace, blocks)?,
        candidates: look.candidates,
        crossing: look.crossing,
        flags,
        sent_flags: look.flags,
        visiting,
        spans,
        flat_candidates: all.flat_candidates,
    };
    Ok((base, stats))
}

/// The single pass over the triples.
struct Look<'a> {
    own: &'a Table<CountedTriple>,
    visiting: &'a Inbox<VisitingTriple>,
    places: Places<'a>,
    /// The division of blocks and the highest points of columns, as far as they count, if the base is oriented by
    /// evidence.
    by_evidence: Option<(Division, Option<Table<Id>>)>,
    blocks: Blocks,
    candidates: Table<CountedTriple>,
    crossing: Table<CountedTriple>,
    flags: Shuffle<TriangleTo>,
}

/// Counts of a block.
#[derive(Default, Serialize, Deserialize)]
struct Found {
    /// Interior triangles that were flagged.
    flagged: u64,
    /// Unfit T3 triangles and interior candidates.
    flat: u64,
    flat_candidates: u64,
    /// The first and the last block touched by a triple of the block.
    span: (Block, Block),
}

impl Look<'_> {
    /// The T3 triangles that touch the block of a unit and are not flagged by a vertex of it, ascending.
    fn block(&self, unit: &Unit<'_>) -> Result<BlockTriangles<Found>> {
        let (block, mut found) = (unit.number(), Found::default());
        let (mut triangles, mut candidates) = self.part(unit, &mut found)?;
        let lists = bytes_of(&triangles) + bytes_of(&candidates);
        let mut held = unit.hold(lists);
        let file = self.drop_unfit(block, &mut triangles, &mut candidates, &mut found)?;
        held.set(lists + file.as_ref().map_or(0, Located::bytes));
        // If no point was relaxed, the positions in the file are also those of the shape.
        let located = file.filter(|_| self.by_evidence.is_some() && !self.places.differ());
        let of_located = located.as_ref().map_or(0, Located::bytes);
        let star = Star::of(self.blocks.ids(block), &triangles);
        held.set(lists + of_located + star.bytes());
        let mut flagged = Vec::new();
        let mut refusing = Refusing::default();
        for v in self.blocks.ids(block).iter() {
            refusing.at(v, &star, &triangles, &mut flagged);
        }
        drop(star);
        let mut sent = Vec::new();
        if !flagged.is_empty() {
            flagged.sort_unstable();
            flagged.dedup();
            let interior = candidates.len();
            for &number in &flagged {
                let triangle = triangles[number.index()];
                if self.blocks.crossing(triangle) {
                    let to = self.blocks.of(triangle[0]);
                    sent.push(TriangleTo { to, triangle });
                } else {
                    let (triple, count) = (triangle, 3);
                    candidates.push(CountedTriple { triple, count });
                }
            }
            found.flagged = (candidates.len() - interior) as u64;
            candidates.sort_unstable();
            let numbers = (0..).map(TriangleIndex::new);
            let (mut numbers, mut gone) = (numbers, flagged.iter().peekable());
            triangles.retain(|_| {
                let number = numbers.next();
                gone.next_if(|gone| number == Some(**gone)).is_none()
            });
        }
        let lists = bytes_of(&triangles) + bytes_of(&candidates) + bytes_of(&flagged);
        held.set(lists + of_located);
        self.flags.send(unit, block, sent)?;
        self.candidates.put(unit, block, &candidates)?;
        let evidence = match &self.by_evidence {
            Some(by) => Some(self.evidence(unit, located, &triangles, &candidates, by)?),
            None => None,
        };
        held.set(lists + evidence.as_ref().map_or(0, Evidence::bytes));
        Ok(BlockTriangles {
            triangles,
            evidence,
            found,
        })
    }

    /// The evidence for the triangles around a block and its candidates; `located` has their positions if
    /// they are known.
    fn evidence(
        &self,
        unit: &Unit<'_>,
        located: Option<Located>,
        triangles: &[Triangle],
        candidates: &[CountedTriple],
        (division, highest): &(Division, Option<Table<Id>>),
    ) -> Result<Evidence> {
        let block = unit.number();
        let vertices = self.foreign(block, triangles);
        let load = || Located::load(self.places.shape, self.blocks, block, vertices);
        let places = located.map_or_else(load, Ok)?;
        let candidates: Vec<Triangle> = candidates.iter().map(|c| c.triple).collect();
        let highest = highest.as_ref().map(|table| table.get(unit, block));
        let highest = highest.transpose()?.unwrap_or_default();
        Ok(Evidence {
            division: *division,
            witnesses: self.witnesses(unit, &highest, &places)?,
            places,
            candidates,
        })
    }

    /// The vertices of the block at which it is known to which side the surface faces: up at those of the `highest`
    /// of columns of which nothing else is known.
    fn witnesses(&self, unit: &Unit<'_>, highest: &[Id], places: &Located) -> Result<Vec<Witness>> {
        let up = |&vertex: &Id| Witness { vertex, toward: UP };
        let Some(outside) = self.places.outside else {
            return Ok(highest.iter().map(up).collect());
        };
        let ids = self.blocks.ids(unit.number());
        let known = outside.open(unit, self.blocks, unit.number())?;
        let _held = unit.hold(outside.bytes(ids.len()));
        let facing = |vertex: Id| {
            let toward = known.witness(vertex, |id| places.at(id))?;
            Some(Witness { vertex, toward })
        };
        let unseen = highest.iter().filter(|v| !known.has(**v));
        let mut all: Vec<Witness> = unseen.map(up).collect();
        all.extend(ids.iter().filter_map(facing));
        all.sort_unstable_by_key(|w| w.vertex);
        Ok(all)
    }

    /// The vertices of the triangles that are not interior to the block.
    fn foreign(&self, block: usize, triangles: &[Triangle]) -> impl Iterator<Item = Id> {
        let ids = self.blocks.ids(block);
        let crosses = move |t: &&Triangle| t[0] < ids.start || t[2] >= ids.end;
        triangles.iter().filter(crosses).flatten().copied()
    }

    /// Removes triangles and candidates that are unfit in the file; returns the positions used.
    fn drop_unfit(
        &self,
        block: usize,
        triangles: &mut Vec<Triangle>,
        candidates: &mut Vec<CountedTriple>,
        found: &mut Found,
    ) -> Result<Option<Located>> {
        if self.places.limit_triangles() {
            let vertices = self.foreign(block, triangles);
            let file = Located::load(self.places.file, self.blocks, block, vertices)?;
            let unfit = self.places.unfit();
            let mut t3 = 0;
            triangles.retain(|t| {
                let flat = unfit(*t, file.corners(*t));
                t3 += u64::from(flat && self.blocks.of(t[0]) == Block::at(block));
                !flat
            });
            found.flat = t3;
            found.flat_candidates = self.places.drop_unfit(candidates, &file);
            return Ok(Some(file));
        }
        Ok(None)
    }

    /// The T3 triangles that touch the block of a unit, ascending, and its interior candidates so far. The
    /// crossing triples are written to separate tables.
    fn part(
        &self,
        unit: &Unit<'_>,
        found: &mut Found,
    ) -> Result<(Vec<Triangle>, Vec<CountedTriple>)> {
        let block = unit.number();
        let visiting = self.visiting.get(unit, block)?;
        let own = self.own.get(unit, block)?;
        let t3 = visiting.iter().filter(|t| t.count == 3).count()
            + own.iter().filter(|t| t.count == 3).count();
        let mut triangles = Vec::with_capacity(t3);
        let mut candidates = Vec::new();
        let mut crossing = Vec::new();
        let mut span = (Block::at(block), Block::at(block));
        // Visiting triples have their smallest vertex in a lower block, so they come first.
        for visitor in &visiting {
            let [first, _, last] = visitor.triple.map(|v| self.blocks.of(v));
            span = (span.0.min(first), span.1.max(last));
            if visitor.count == 3 {
                triangles.push(visitor.triple);
            }
        }
        // Ids ascend, so a triple is interior if its last vertex is in the block.
        let end = self.blocks.ids(block).end;
        for &counted in &own {
            if counted.count == 3 {
                triangles.push(counted.triple);
            }
            let last = counted.triple[2];
            if last >= end {
                span.1 = span.1.max(self.blocks.of(last));
                crossing.push(counted);
            } else if counted.count < 3 {
                candidates.push(counted);
            }
        }
        let read = bytes_of(&visiting) + bytes_of(&own) + bytes_of(&crossing);
        let _held = unit.hold(read + bytes_of(&triangles) + bytes_of(&candidates));
        self.crossing.put(unit, block, &crossing)?;
        found.span = span;
        Ok((triangles, candidates))
    }
}

/// Buffers for finding the triangles that a vertex flags.
#[derive(Default)]
struct Refusing {
    level: Level,
    link: Link,
    kept: Vec<TriangleIndex>,
}

impl Refusing {
    /// Appends the triangles around `v` that it flags: at edges with more than two triangles, and beside a
    /// closed fan.
    fn at(&mut self, v: Id, star: &Star, triangles: &[Triangle], flagged: &mut Vec<TriangleIndex>) {
        let around = star.at(v);
        if one_fan(self.level, v, around, triangles) {
            return;
        }
        let triangle = |n: &TriangleIndex| triangles[n.index()];
        let degree = |node: Id| around.iter().filter(|n| has(triangle(n), node)).count();
        let crowded = |n: &TriangleIndex| others(triangle(n), v).map(degree).iter().any(|d| *d > 2);
        self.kept.clear();
        for n in around {
            if crowded(n) {
                flagged.push(*n);
            } else {
                self.kept.push(*n);
            }
        }
        let (link, kept) = (&mut self.link, &self.kept);
        link.set(v, kept.iter().map(triangle));
        if link.groups() < 2 {
            return;
        }
        // Triangles are numbered in ascending order, so the first in a cycle is the smallest in any cycle.
        let Some(first) = (0..kept.len()).find(|&i| link.is_closed(link.group(i))) else {
            return;
        };
        let keep = link.group(first);
        let beside = (0..kept.len()).filter(|&i| link.group(i) != keep);
        flagged.extend(beside.map(|i| kept[i]));
    }
}

/// True if the link of `v` is one path, one cycle, or empty: then nothing is flagged. False if this could not
/// be established by the fast test.
fn one_fan(level: Level, v: Id, around: &[TriangleIndex], triangles: &[Triangle]) -> bool {
    if around.len() > MOST_EDGES {
        return false;
    }
    // No edge ends at `v` itself.
    let mut ends = [[v.get(); MOST_EDGES]; 2];
    let [low, high] = &mut ends;
    for ((low, high), &n) in low.iter_mut().zip(high).zip(around) {
        [*low, *high] = others(triangles[n.index()], v).map(Id::get);
    }
    is_one_fan(level, &ends, around.len())
}
