//! The components of a block's triangles during insertion in the block.
//!
//! A component of the base with a crossing triangle is *global*: other blocks contain triangles of it too. If
//! an inserted triangle connects two global components, this is a *tentative merge*: it is valid in this
//! block, and in the whole mesh only if the pass across blocks confirms it. A *local* component lies in this
//! block alone, so merging it with another one is final.

use crate::surface::orient::OrientedSurface;
use crate::surface::parity::{OrientationConstraint, ParitySets, Turned, constraint, word};
use crate::surface::star::Triangle;
use outcrop_disk::spill::row;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_stages::ids::{Component, GlobalLabel, Label, TriangleIndex};
use rustc_hash::FxHashMap;

row! {
    /// An inserted triangle that connects global components.
    pub struct Merge {
        /// Ids, ascending.
        triangle: Triangle,
        /// `label << 1 | flip` of the components, or [`Turned::NONE`].
        constraints: [Turned<GlobalLabel>; 3],
    }
    packed Above Above Above Above Above Above
}

/// The component of a triangle for other blocks, in a word: `number << 2 | local << 1 | flip`.
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, bytemuck::Pod, bytemuck::Zeroable,
)]
#[repr(transparent)]
pub struct Reference(u32);

/// Whose component a [`Reference`] names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Whose {
    /// A component of the block alone.
    Local(Component),
    /// A component that may lie in several blocks.
    Global(GlobalLabel),
}

impl Reference {
    fn new(number: u32, local: bool, flip: bool) -> Self {
        Self(number << 2 | u32::from(local) << 1 | u32::from(flip))
    }

    /// The component, and true if the triangle is turned against it.
    pub fn parts(self) -> (Whose, bool) {
        let number = self.0 >> 2;
        let whose = match self.0 >> 1 & 1 {
            1 => Whose::Local(Component::new(number)),
            _ => Whose::Global(GlobalLabel::new(number)),
        };
        (whose, self.0 & 1 == 1)
    }
}

/// The components of the base in a block, numbered in the order of first use. All labels of a set with a
/// crossing triangle are one component; every other label is a component of its own.
pub struct BaseComponents<'a> {
    surface: &'a OrientedSurface,
    of_root: FxHashMap<GlobalLabel, Component>,
    of_label: Vec<OrientationConstraint<Component>>,
    /// Global label of each component, or [`GlobalLabel::NONE`].
    global: Vec<GlobalLabel>,
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
        for label in (0..labels).map(Label::new) {
            let component = if label.get() < globals {
                components.of_global(first.of(label))
            } else {
                components.global.push(GlobalLabel::NONE);
                (Component::at(components.global.len() - 1), false)
            };
            components.of_label.push(component);
        }
        components
    }

    fn of_global(&mut self, label: GlobalLabel) -> OrientationConstraint<Component> {
        let (root, flip) = self.surface.sets.look(label);
        let crosses = self.surface.crosses[root.index()];
        let component = *self.of_root.entry(root).or_insert_with(|| {
            self.global
                .push(if crosses { root } else { GlobalLabel::NONE });
            Component::at(self.global.len() - 1)
        });
        (component, flip)
    }

    /// The component of an interior triangle with `label << 1 | flip`, and true if the triangle is turned
    /// against it.
    pub fn interior(&self, label_flip: Turned<Label>) -> OrientationConstraint<Component> {
        let (label, turned) = constraint(label_flip);
        let (component, flip) = self.of_label[label.index()];
        (component, flip ^ turned)
    }

    /// The same for a crossing triangle, whose label is global.
    pub fn crossing(
        &mut self,
        label_flip: Turned<GlobalLabel>,
    ) -> OrientationConstraint<Component> {
        let (label, turned) = constraint(label_flip);
        let (component, flip) = self.of_global(label);
        (component, flip ^ turned)
    }
}

/// The components of a block's triangles during insertion.
#[derive(Default)]
pub struct BlockComponents {
    /// For each triangle, its component when it was added, and true if it is turned against it.
    of: Vec<OrientationConstraint<Component>>,
    /// Final merges of components.
    merged: ParitySets<Component>,
    /// All merges valid in this block, including tentative ones.
    pub joined: ParitySets<Component>,
    /// Global label of each component, or [`GlobalLabel::NONE`].
    global: Vec<GlobalLabel>,
    /// Tentative merges, in the order of insertion.
    pub tentative: Vec<Merge>,
}

impl BlockComponents {
    /// The components of the base; `of` gives that of each triangle.
    pub fn new(base: BaseComponents<'_>, of: Vec<OrientationConstraint<Component>>) -> Self {
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
    pub fn find(&mut self, number: TriangleIndex) -> OrientationConstraint<Component> {
        let (component, flip) = self.of[number.index()];
        let (root, up) = self.merged.find(component);
        (root, flip ^ up)
    }

    /// The same in a form that other blocks understand.
    pub fn reference(&mut self, number: TriangleIndex) -> Reference {
        let (root, flip) = self.find(number);
        match self.global[root.index()] {
            GlobalLabel::NONE => Reference::new(root.get(), true, flip),
            label => Reference::new(label.get(), false, flip),
        }
    }

    /// Adds a triangle at which the components of `constraints` meet. A local component is merged with its
    /// neighbour; global ones are merged tentatively.
    pub fn insert(&mut self, t: Triangle, constraints: &[OrientationConstraint<Component>]) {
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
            if self.global[b.index()] == GlobalLabel::NONE {
                self.merged.join(a, b, turned);
            } else if self.global[a.index()] == GlobalLabel::NONE {
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
    fn note_tentative(&mut self, t: Triangle, constraints: &[OrientationConstraint<Component>]) {
        let mut words = [Turned::NONE; 3];
        let mut count = 0;
        for &(component, flip) in constraints {
            let (root, up) = self.merged.find(component);
            let label = self.global[root.index()];
            let word = word((label, flip ^ up));
            if label != GlobalLabel::NONE && !words[..count].contains(&word) {
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
