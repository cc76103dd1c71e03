//! The components of a block's triangles during insertion in the block.
//!
//! A component of the base with a crossing triangle is *global*: other blocks contain triangles of it too. If
//! an inserted triangle connects two global components, this is a *tentative merge*: it is valid in this
//! block, and in the whole mesh only if the pass across blocks confirms it. A *local* component lies in this
//! block alone, so merging it with another one is final.

use crate::surface::orient::OrientedSurface;
use crate::surface::parity::{OrientationConstraint, ParitySets, constraint, word};
use crate::surface::star::Triangle;
use outcrop_disk::spill::row;
use outcrop_disk::workspace::memory::bytes_of;
use rustc_hash::FxHashMap;

/// Stands for a missing global label.
pub const NOTHING: u32 = u32::MAX;

row! {
    /// An inserted triangle that connects global components.
    pub struct Merge {
        /// Ids, ascending.
        triangle: Triangle,
        /// `label << 1 | flip` of the components, or [`NOTHING`].
        constraints: [u32; 3],
    }
    packed Above Above Above Above Above Above
}

/// The components of the base in a block, numbered in the order of first use. All labels of a set with a
/// crossing triangle are one component; every other label is a component of its own.
pub struct BaseComponents<'a> {
    surface: &'a OrientedSurface,
    of_root: FxHashMap<u32, u32>,
    of_label: Vec<OrientationConstraint>,
    /// Global label of each component, or [`NOTHING`].
    global: Vec<u32>,
}

impl<'a> BaseComponents<'a> {
    /// The components of the interior triangles of a block.
    pub fn of(surface: &'a OrientedSurface, block: usize) -> Self {
        let (first, globals) = surface.globals[block];
        let mut components = Self {
            surface,
            of_root: FxHashMap::default(),
            of_label: Vec::new(),
            global: Vec::new(),
        };
        let labels = surface.labels[block];
        components.of_label.reserve(labels as usize);
        for label in 0..labels {
            let component = if label < globals {
                components.of_global(first + label)
            } else {
                components.global.push(NOTHING);
                (components.global.len() as u32 - 1, false)
            };
            components.of_label.push(component);
        }
        components
    }

    fn of_global(&mut self, label: u32) -> OrientationConstraint {
        let (root, flip) = self.surface.sets.look(label);
        let crosses = self.surface.crosses[root as usize];
        let component = *self.of_root.entry(root).or_insert_with(|| {
            self.global.push(if crosses { root } else { NOTHING });
            self.global.len() as u32 - 1
        });
        (component, flip)
    }

    /// The component of an interior triangle with `label << 1 | flip`, and true if the triangle is turned
    /// against it.
    pub fn interior(&self, label_flip: u32) -> OrientationConstraint {
        let (label, turned) = constraint(label_flip);
        let (component, flip) = self.of_label[label as usize];
        (component, flip ^ turned)
    }

    /// The same for a crossing triangle, whose label is global.
    pub fn crossing(&mut self, label_flip: u32) -> OrientationConstraint {
        let (label, turned) = constraint(label_flip);
        let (component, flip) = self.of_global(label);
        (component, flip ^ turned)
    }
}

/// The components of a block's triangles during insertion.
#[derive(Default)]
pub struct BlockComponents {
    /// For each triangle, its component when it was added, and true if it is turned against it.
    of: Vec<OrientationConstraint>,
    /// Final merges of components.
    merged: ParitySets,
    /// All merges valid in this block, including tentative ones.
    pub joined: ParitySets,
    /// Global label of each component, or [`NOTHING`].
    global: Vec<u32>,
    /// Tentative merges, in the order of insertion.
    pub tentative: Vec<Merge>,
}

impl BlockComponents {
    /// The components of the base; `of` gives that of each triangle.
    pub fn new(base: BaseComponents<'_>, of: Vec<OrientationConstraint>) -> Self {
        Self {
            of,
            merged: ParitySets::new(base.global.len()),
            joined: ParitySets::new(base.global.len()),
            global: base.global,
            ..Self::default()
        }
    }

    /// Bytes allocated by its lists.
    pub fn bytes(&self) -> u64 {
        bytes_of(&self.of) + 3 * bytes_of(&self.global) + bytes_of(&self.tentative)
    }

    /// The current component of a triangle, and true if the triangle is turned against it.
    pub fn find(&mut self, number: u32) -> OrientationConstraint {
        let (component, flip) = self.of[number as usize];
        let (root, up) = self.merged.find(component);
        (root, flip ^ up)
    }

    /// The same in a form that other blocks understand: the word `number << 2 | local << 1 | flip`, where
    /// `number` is a number within the block if it is local, else the global label.
    pub fn reference(&mut self, number: u32) -> u32 {
        let (root, flip) = self.find(number);
        let component = match self.global[root as usize] {
            NOTHING => word((root, true)),
            label => word((label, false)),
        };
        word((component, flip))
    }

    /// Adds a triangle at which the components of `constraints` meet. A local component is merged with its
    /// neighbour; global ones are merged tentatively.
    pub fn insert(&mut self, t: Triangle, constraints: &[OrientationConstraint]) {
        let mut current = constraints[0];
        for &(next, flip) in constraints {
            let (a, up_a) = self.merged.find(current.0);
            let (b, up_b) = self.merged.find(next);
            current = (a, current.1 ^ up_a);
            if a == b {
                continue;
            }
            let next = (b, flip ^ up_b);
            let turned = current.1 ^ next.1;
            // The global root is kept, or the first one if none is global.
            if self.global[b as usize] == NOTHING {
                self.merged.join(a, b, turned);
            } else if self.global[a as usize] == NOTHING {
                self.merged.join(b, a, turned);
                current = next;
            }
        }
        self.note_tentative(t, constraints);
        let (first, flip) = constraints[0];
        let (root, up) = self.merged.find(first);
        self.of.push((root, flip ^ up));
    }

    /// Records a tentative merge if global components meet at `t`.
    fn note_tentative(&mut self, t: Triangle, constraints: &[OrientationConstraint]) {
        let mut words = [NOTHING; 3];
        let mut count = 0;
        for &(component, flip) in constraints {
            let (root, up) = self.merged.find(component);
            let label = self.global[root as usize];
            let word = word((label, flip ^ up));
            if label != NOTHING && !words[..count].contains(&word) {
                words[count] = word;
                count += 1;
            }
        }
        if count > 1 {
            self.tentative.push(Merge {
                triangle: t,
                constraints: words,
            });
        }
    }
}
