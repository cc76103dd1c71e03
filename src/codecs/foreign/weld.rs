//! Vertices at the same position become one.

use super::Mesh;
use super::spool::Spool;
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Row, Sorted, Sorter, row};
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::Reservation;

row! {
    /// A vertex of the file; rows sort by position, then by number.
    pub struct Placed {
        /// Its coordinates, each in two words that sort as numbers do.
        position: [u32; 6],
        /// Its number in the file, in two words.
        number: [u32; 2],
        /// Its colour and 1, or 0 if it has none.
        colour: u32,
    }
    unpacked
}

row! {
    /// A vertex of the file, and the first one at its position.
    pub struct Joined {
        /// The number.
        number: [u32; 2],
        /// The number of the first.
        first: [u32; 2],
    }
    packed Above Above Above Above
}

row! {
    /// The first vertex at a position; rows sort by number.
    pub struct First {
        /// The number.
        number: [u32; 2],
        /// See [`Placed::position`].
        position: [u32; 6],
        /// See [`Placed::colour`].
        colour: u32,
    }
    unpacked
}

fn words(x: u64) -> [u32; 2] {
    [(x >> 32) as u32, x as u32]
}

fn number([high, low]: [u32; 2]) -> u64 {
    u64::from(high) << 32 | u64::from(low)
}

const SIGN: u64 = 1 << 63;

/// Words that sort as coordinates do. Zeros are one position, whatever their sign.
fn sortable(x: f64) -> [u32; 2] {
    let bits = (x + 0.0).to_bits();
    words(if bits & SIGN == 0 { bits | SIGN } else { !bits })
}

fn coordinate(sorted: [u32; 2]) -> f64 {
    let bits = number(sorted);
    f64::from_bits(if bits & SIGN == 0 {
        !bits
    } else {
        bits & !SIGN
    })
}

fn packed(colour: Option<[u8; 3]>) -> u32 {
    colour.map_or(0, |[r, g, b]| u32::from_be_bytes([r, g, b, 1]))
}

fn unpacked(colour: u32) -> Option<[u8; 3]> {
    let [r, g, b, is_some] = colour.to_be_bytes();
    (is_some > 0).then_some([r, g, b])
}

/// Collects vertices.
pub(super) struct Weld<'a> {
    workspace: &'a Workspace,
    name: String,
    sorter: Sorter<Placed>,
    buffer: Vec<Placed>,
    count: u64,
}

/// Vertices that are passed to a sorter at a time.
const BATCH: usize = 1 << 12;

/// A sorter for `most` rows, in a share of the memory.
fn sorter<R: Row>(workspace: &Workspace, name: &str, most: u64) -> Result<Sorter<R>> {
    let all = most.saturating_mul(size_of::<R>() as u64);
    let buffer = (workspace.memory.available() / 8).min(all) + (1 << 20);
    let held = workspace.reserve("mesh: sort buffers", buffer + buffer / 2)?;
    Ok(Sorter::new(workspace, name, buffer).reporting(held))
}

impl<'a> Weld<'a> {
    /// For at most `most` vertices of a mesh.
    pub fn new(mesh: &'a Mesh<'a>, spool: &Spool<'_>, most: u64) -> Result<Self> {
        let name = &spool.name;
        let workspace = mesh.workspace;
        Ok(Self {
            workspace,
            name: name.to_owned(),
            sorter: sorter(workspace, &format!("{name} placed"), most)?,
            buffer: Vec::with_capacity(BATCH),
            count: 0,
        })
    }

    /// Takes the next vertex.
    pub fn push(&mut self, position: [f64; 3], colour: Option<[u8; 3]>) -> Result<()> {
        let [x, y, z] = position.map(sortable);
        self.buffer.push(Placed {
            position: [x[0], x[1], y[0], y[1], z[0], z[1]],
            number: words(self.count),
            colour: packed(colour),
        });
        self.count += 1;
        if self.buffer.len() == BATCH {
            self.sorter.push(&self.buffer)?;
            self.buffer.clear();
        }
        Ok(())
    }

    /// Writes one vertex for each position, in the order in which they came first, and passes on the number of
    /// each vertex that was pushed.
    pub fn finish<'s>(
        self,
        spool: &mut Spool<'s>,
        mut each: impl FnMut(&mut Spool<'s>, u32) -> Result<()>,
    ) -> Result<()> {
        let Self {
            workspace,
            name,
            sorter: placed,
            buffer,
            count,
        } = self;
        placed.push(&buffer)?;
        let placed = placed.finish(workspace)?;
        let joined = sorter::<Joined>(workspace, &format!("{name} joined"), count)?;
        let firsts = sorter::<First>(workspace, &format!("{name} firsts"), count)?;
        join(placed, &joined, &firsts)?;
        let mut ranks = Ranks::new(count, workspace)?;
        firsts.finish(workspace)?.for_each(|row| {
            ranks.insert(number(row.number));
            let [a, b, c, d, e, f] = row.position;
            let position = [[a, b], [c, d], [e, f]].map(coordinate);
            spool.vertex(position, unpacked(row.colour))
        })?;
        ranks.count();
        joined
            .finish(workspace)?
            .for_each(|row| each(spool, ranks.of(number(row.first))))
    }
}

fn join(placed: Sorted<Placed>, joined: &Sorter<Joined>, firsts: &Sorter<First>) -> Result<()> {
    let mut last: Option<First> = None;
    let mut batch = Vec::with_capacity(BATCH);
    placed.for_each(|row| {
        let first = match last {
            Some(first) if first.position == row.position => first,
            _ => {
                let first = First {
                    number: row.number,
                    position: row.position,
                    colour: row.colour,
                };
                firsts.push(&[first])?;
                first
            }
        };
        last = Some(first);
        batch.push(Joined {
            number: row.number,
            first: first.number,
        });
        if batch.len() == BATCH {
            joined.push(&batch)?;
            batch.clear();
        }
        Ok(())
    })?;
    joined.push(&batch)
}

/// A set of numbers that knows how many of them are smaller than one.
struct Ranks {
    bits: Vec<u64>,
    /// Members before each word.
    before: Vec<u32>,
    _held: Reservation,
}

impl Ranks {
    /// For numbers below `count`.
    fn new(count: u64, workspace: &Workspace) -> Result<Self> {
        let words = count.div_ceil(64);
        let _held = workspace.reserve("mesh: first vertices", 12 * words)?;
        Ok(Self {
            bits: vec![0; words as usize],
            before: Vec::with_capacity(words as usize),
            _held,
        })
    }

    fn insert(&mut self, number: u64) {
        self.bits[(number / 64) as usize] |= 1 << (number % 64);
    }

    fn count(&mut self) {
        let mut sum = 0;
        for word in &self.bits {
            self.before.push(sum);
            sum += word.count_ones();
        }
    }

    fn of(&self, number: u64) -> u32 {
        let word = (number / 64) as usize;
        let below = self.bits[word] & ((1 << (number % 64)) - 1);
        self.before[word] + below.count_ones()
    }
}
