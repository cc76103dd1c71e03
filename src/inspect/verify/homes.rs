//! Division of a mesh into pieces that can be examined on their own.
//!
//! A piece is a run of consecutive faces. A group of consecutive vertices belongs to the piece that most
//! faces of a sample have there: its home. A vertex is shared if a face of another piece than its home has
//! it. The triangles of all other vertices are in one piece.

use outcrop_codecs::ply_mesh::AnyPlace;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::{Workspace, lock};
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Sizes of pieces and groups.
#[derive(Debug, Clone, Copy)]
pub(super) struct Division {
    /// Vertices of the mesh.
    pub(super) vertices: u32,
    /// Faces of the mesh.
    pub(super) faces: u64,
    /// Faces of a piece.
    pub(super) piece: usize,
    /// Vertex `v` belongs to group `v >> shift`.
    pub(super) shift: u32,
    /// Most groups with the same home.
    pub(super) most_groups: usize,
    /// Least part of the sample that is at home, in quarters.
    pub(super) at_home: u64,
}

/// The home of a group that has none.
pub(super) const NOWHERE: u32 = u32::MAX;

/// Runs of faces in the sample of a piece, and faces of a run.
const SAMPLE: (u64, usize) = (16, 32);

/// Faces read at a time.
pub(super) const AT_A_TIME: usize = 8192;

impl Division {
    /// The number of pieces.
    pub(super) fn pieces(&self) -> usize {
        self.faces.div_ceil(self.piece as u64) as usize
    }

    /// The faces of a piece.
    pub(super) fn faces_of(&self, piece: usize) -> Range<u64> {
        let first = piece as u64 * self.piece as u64;
        first..(first + self.piece as u64).min(self.faces)
    }

    /// The number of groups.
    pub(super) fn groups(&self) -> usize {
        (u64::from(self.vertices)).div_ceil(1 << self.shift) as usize
    }

    /// The vertices of some consecutive groups.
    pub(super) fn vertices_of(&self, groups: Range<usize>) -> Range<u64> {
        let end = (groups.end as u64) << self.shift;
        (groups.start as u64) << self.shift..end.min(self.vertices.into())
    }

    /// Bytes of [`Homes`].
    pub(super) fn bytes(&self) -> u64 {
        u64::from(self.vertices) / 8 + 32 * (self.groups() as u64 + self.pieces() as u64) + 64
    }

    /// Groups that come after one another, as ranges.
    pub(super) fn runs(groups: &[u32]) -> impl Iterator<Item = Range<usize>> {
        let runs = groups.chunk_by(|a, b| a + 1 == *b);
        runs.map(|run| run[0] as usize..run[0] as usize + run.len())
    }
}

/// Vertices that are shared.
#[derive(Debug)]
pub(super) struct Shared(Vec<AtomicU64>);

impl Shared {
    pub(super) fn has(&self, vertex: u32) -> bool {
        let word = self.0[vertex as usize / 64].load(Ordering::Relaxed);
        word >> (vertex % 64) & 1 != 0
    }

    fn set(&self, vertex: u32) {
        self.0[vertex as usize / 64].fetch_or(1 << (vertex % 64), Ordering::Relaxed);
    }
}

/// The homes of all groups.
#[derive(Debug)]
pub(super) struct Homes {
    pub(super) division: Division,
    /// For each group its home, and the number of its first vertex among those of the home.
    places: Vec<[u32; 2]>,
    /// The groups of each piece, ascending, piece by piece; last those of none.
    groups: Vec<u32>,
    /// Where those of each piece end.
    ends: Vec<usize>,
}

/// The number of a vertex of another piece.
pub(super) const AWAY: u32 = u32::MAX;

impl Homes {
    /// The homes of all groups; none if most vertices of faces would not be at home.
    pub(super) fn new(
        mesh: &AnyPlace,
        division: Division,
        workspace: &Workspace,
    ) -> Result<Option<Self>> {
        // For each group the piece with the most corners in the sample, and their number.
        let best = Mutex::new(vec![(0u32, NOWHERE); division.groups()]);
        let all = AtomicU64::new(0);
        let bytes = |_| 64 << 10;
        workspace.for_each_unit("verify: sample", division.pieces(), bytes, |unit| {
            let mut groups = sample(mesh, division, unit.number())?;
            all.fetch_add(groups.len() as u64, Ordering::Relaxed);
            groups.sort_unstable();
            let mut best = lock(&best);
            for run in groups.chunk_by(|a, b| a == b) {
                let own = (run.len() as u32, unit.number() as u32);
                let best = &mut best[run[0] as usize];
                if (own.0, best.1) > (best.0, own.1) {
                    *best = own;
                }
            }
            Ok(())
        })?;
        let best = lock(&best);
        let at_home: u64 = best.iter().map(|(count, _)| u64::from(*count)).sum();
        if 4 * at_home < division.at_home * all.into_inner() {
            return Ok(None);
        }
        Ok(Some(Self::of(division, &best)))
    }

    fn of(division: Division, best: &[(u32, u32)]) -> Self {
        let pieces = division.pieces();
        let mut counts = vec![0usize; pieces + 1];
        let (mut places, mut before) = (Vec::with_capacity(best.len()), NOWHERE);
        for &(_, home) in best {
            // A group that is not in the sample goes with the one before it.
            let home = if home == NOWHERE { before } else { home };
            before = home;
            let full = home != NOWHERE && counts[home as usize] == division.most_groups;
            let home = if full { NOWHERE } else { home };
            let count = &mut counts[(home as usize).min(pieces)];
            places.push([home, (*count as u32) << division.shift]);
            *count += 1;
        }
        let mut sum = 0;
        for count in &mut counts {
            sum += *count;
            *count = sum - *count;
        }
        let mut groups = vec![0; places.len()];
        for (group, [home, _]) in (0..).zip(&places) {
            let next = &mut counts[(*home as usize).min(pieces)];
            groups[*next] = group;
            *next += 1;
        }
        Self {
            division,
            places,
            groups,
            ends: counts,
        }
    }

    /// The groups of a piece; those of none for the number of pieces.
    pub(super) fn groups_of(&self, piece: usize) -> &[u32] {
        let start = piece.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.groups[start..self.ends[piece]]
    }

    /// The number of a vertex among those of `piece`, [`AWAY`] if it belongs to another. The vertex is one of
    /// the mesh.
    #[inline]
    pub(super) fn local(&self, vertex: u32, piece: u32) -> u32 {
        let [home, first] = self.places[(vertex >> self.division.shift) as usize];
        match home == piece {
            true => first + (vertex & ((1 << self.division.shift) - 1)),
            false => AWAY,
        }
    }

    /// All shared vertices; none if a face is no triangle.
    pub(super) fn shared(&self, mesh: &AnyPlace, workspace: &Workspace) -> Result<Option<Shared>> {
        let words = self.division.vertices.div_ceil(64);
        let shared = Shared((0..words).map(|_| AtomicU64::new(0)).collect());
        let (odd, buffers) = (AtomicBool::new(false), Mutex::new(Vec::new()));
        let bytes = |_| (AT_A_TIME * (12 + mesh.entries()[1])) as u64;
        workspace.for_each_unit("verify: faces", self.division.pieces(), bytes, |unit| {
            let _held = unit.hold(bytes(0));
            let mut faces = self.division.faces_of(unit.number());
            let (mut raw, mut triangles) = lock(&buffers).pop().unwrap_or_default();
            while !faces.is_empty() && !odd.load(Ordering::Relaxed) {
                let now = (faces.end - faces.start).min(AT_A_TIME as u64) as usize;
                if !mesh.triangles((faces.start, now), &mut raw, &mut triangles)? {
                    odd.store(true, Ordering::Relaxed);
                    break;
                }
                self.share(&triangles, unit.number() as u32, &shared);
                unit.advance(now as u64);
                faces.start += now as u64;
            }
            lock(&buffers).push((raw, triangles));
            Ok(())
        })?;
        Ok((!odd.into_inner()).then_some(shared))
    }

    fn share(&self, triangles: &[[u32; 3]], piece: u32, shared: &Shared) {
        for &vertex in triangles.as_flattened() {
            if vertex < self.division.vertices && self.local(vertex, piece) == AWAY {
                shared.set(vertex);
            }
        }
    }
}

/// The group of each corner of a sample of a piece.
fn sample(mesh: &AnyPlace, division: Division, piece: usize) -> Result<Vec<u32>> {
    let faces = division.faces_of(piece);
    let length = faces.end - faces.start;
    let run = length.min(SAMPLE.1 as u64);
    let runs = if length > run { SAMPLE.0 } else { 1 };
    let (mut bytes, mut triangles, mut groups) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..runs {
        let first = faces.start + (length - run) * k / (runs - 1).max(1);
        mesh.triangles((first, run as usize), &mut bytes, &mut triangles)?;
        let corners = triangles.as_flattened().iter();
        let corners = corners.filter(|vertex| **vertex < division.vertices);
        groups.extend(corners.map(|vertex| vertex >> division.shift));
    }
    Ok(groups)
}
