//! Numbers that name things, with a type for each kind, so that none is taken for another.
//!
//! The width of ids stands here once. On disk and in a list each type is the plain number.

use outcrop_disk::spill::{Row, Word};
use serde::{Deserialize, Serialize};
use std::fmt::Debug;
use std::hash::Hash;
use std::ops::Range;

/// The width of ids.
pub type Width = u32;

/// A number that is an index in a list.
pub trait Number: Copy + Ord + Hash + Debug + Default {
    /// With this index.
    fn at(index: usize) -> Self;
    /// The index.
    fn index(self) -> usize;
}

/// Plain numbers, for tests.
impl Number for u32 {
    fn at(index: usize) -> Self {
        index as Self
    }

    fn index(self) -> usize {
        self as usize
    }
}

/// Defines a type of numbers.
macro_rules! number {
    ($(#[$meta:meta])* $name:ident: $width:ty) => {
        $(#[$meta])*
        #[derive(
            Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
            bytemuck::Pod, bytemuck::Zeroable,
        )]
        #[serde(transparent)]
        #[repr(transparent)]
        pub struct $name($width);

        impl $name {
            /// With this number.
            #[must_use]
            #[inline(always)]
            pub const fn new(number: $width) -> Self {
                Self(number)
            }

            /// With an index in a list as number.
            #[must_use]
            #[inline(always)]
            pub const fn at(index: usize) -> Self {
                Self(index as $width)
            }

            /// The number.
            #[must_use]
            #[inline(always)]
            pub const fn get(self) -> $width {
                self.0
            }

            /// The number as an index in a list.
            #[must_use]
            #[inline(always)]
            pub const fn index(self) -> usize {
                self.0 as usize
            }
        }

        impl Number for $name {
            #[inline(always)]
            fn at(index: usize) -> Self {
                Self::at(index)
            }

            #[inline(always)]
            fn index(self) -> usize {
                self.index()
            }
        }
    };
}

number! {
    /// The id of a point: its rank on the curve.
    Id: Width
}

number! {
    /// The number of a block.
    Block: u32
}

number! {
    /// The number of a tile.
    TileNumber: u32
}

number! {
    /// The number of a page of a store.
    PageNumber: u32
}

number! {
    /// The place of a triangle in a list of triangles of a block.
    TriangleIndex: u32
}

number! {
    /// The number of a patch of a block.
    PatchNumber: u32
}

number! {
    /// A label in the numbering of a block.
    Label: u32
}

number! {
    /// A label in the numbering of the whole surface.
    GlobalLabel: u32
}

number! {
    /// The number of a component of a block's triangles during insertion.
    Component: u32
}

number! {
    /// An edge of a triangle, see `sides::side` in `outcrop-mesh`.
    Side: u32
}

impl PatchNumber {
    /// Stands for no patch.
    pub const NONE: Self = Self(u32::MAX);
}

impl Side {
    /// Stands for an edge without a second triangle inside the block.
    pub const NONE: Self = Self(u32::MAX);
}

impl Label {
    /// Stands for no label.
    pub const NONE: Self = Self(u32::MAX);
}

impl GlobalLabel {
    /// Stands for no label.
    pub const NONE: Self = Self(u32::MAX);

    /// The global label of a label of the block whose label 0 has this one.
    #[must_use]
    pub const fn of(self, label: Label) -> Self {
        Self(self.0 + label.0)
    }
}

/// An id in a list of ids.
impl Row for Id {
    const PACKING: Option<&'static [Word]> = Some(&[Word::Above]);
}

/// Three ids; ascending, unless something else is said.
pub type Triangle = [Id; 3];

impl Id {
    /// Most points that have ids.
    pub const MOST: u64 = Width::MAX as u64 - 1;

    /// An id that no point has; larger than all others.
    pub const NONE: Self = Self(Width::MAX);

    /// The id that comes so many places behind, or the largest number.
    #[must_use]
    pub const fn behind(self, places: Width) -> Self {
        Self(self.0.saturating_add(places))
    }

    /// Of two ids, one of which is this, the other.
    #[must_use]
    #[inline(always)]
    pub const fn other(self, [a, b]: [Self; 2]) -> Self {
        Self(self.0 ^ a.0 ^ b.0)
    }
}

/// A triangle or triple of these ids.
#[must_use]
pub fn triangle(ids: [Width; 3]) -> Triangle {
    ids.map(Id)
}

/// True if two triangles are the same. Arrays of types are compared more slowly than arrays of numbers.
#[must_use]
#[inline(always)]
pub fn same(one: Triangle, other: Triangle) -> bool {
    one.map(Id::get) == other.map(Id::get)
}

/// Consecutive ids.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Ids {
    /// The first one.
    pub start: Id,
    /// The one behind the last.
    pub end: Id,
}

impl Ids {
    /// From numbers.
    #[must_use]
    pub const fn of(numbers: Range<Width>) -> Self {
        Self {
            start: Id(numbers.start),
            end: Id(numbers.end),
        }
    }

    /// From indices in a list of all points.
    #[must_use]
    pub const fn at(indices: &Range<usize>) -> Self {
        Self {
            start: Id::at(indices.start),
            end: Id::at(indices.end),
        }
    }

    /// Number of ids.
    #[must_use]
    #[inline(always)]
    pub const fn len(&self) -> usize {
        self.end.0.saturating_sub(self.start.0) as usize
    }

    /// True if there is none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// True if an id is one of them.
    #[must_use]
    #[inline(always)]
    pub fn contains(&self, id: &Id) -> bool {
        self.start <= *id && *id < self.end
    }

    /// The place of one of them, from 0.
    #[must_use]
    #[inline(always)]
    pub const fn place(&self, id: Id) -> usize {
        (id.0 - self.start.0) as usize
    }

    /// The place of one of them, from 0; of any other id a number that is no place.
    #[must_use]
    #[inline(always)]
    pub const fn find(&self, id: Id) -> usize {
        id.0.wrapping_sub(self.start.0) as usize
    }

    /// The id at a place.
    #[must_use]
    #[inline(always)]
    pub const fn id(&self, place: usize) -> Id {
        Id(self.start.0 + place as Width)
    }

    /// All of them, ascending.
    #[inline(always)]
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = Id> + ExactSizeIterator + Clone + use<> {
        (self.start.0..self.end.0).map(Id)
    }

    /// Their indices in a list of all points.
    #[must_use]
    pub const fn indices(&self) -> Range<usize> {
        self.start.index()..self.end.index()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn places_are_those_in_the_range(start in 0u32..50, length in 0u32..50, id in any::<Width>()) {
            let ids = Ids::of(start..start + length);
            let id = if id % 2 == 0 { id % 100 } else { id };
            let place = (start..start + length).position(|x| x == id);
            let id = Id::new(id);
            prop_assert_eq!(ids.contains(&id), place.is_some());
            prop_assert_eq!(Some(ids.find(id)).filter(|place| *place < ids.len()), place);
            if let Some(place) = place {
                prop_assert_eq!((ids.place(id), ids.id(place)), (place, id));
            }
            let all: Vec<usize> = ids.iter().map(Id::index).collect();
            prop_assert_eq!(all, ids.indices().collect::<Vec<_>>());
        }
    }

    #[test]
    fn on_disk_they_are_the_plain_numbers() {
        let ids = [Id::new(7), Id::at(70_000), Id::NONE];
        assert_eq!(
            bytemuck::cast_slice::<Id, u8>(&ids),
            [7, 70_000, Width::MAX]
                .map(Width::to_ne_bytes)
                .as_flattened()
        );
        assert_eq!(ids[1].words(), [70_000]);
    }

    #[test]
    fn the_other_of_two_is_found_from_either() {
        let [a, b] = [3, 70_001].map(Id::new);
        assert_eq!((a.other([a, b]), b.other([a, b])), (b, a));
        assert!(same(triangle([1, 2, 3]), triangle([1, 2, 3])));
        assert!(!same(triangle([1, 2, 3]), triangle([1, 2, 4])));
    }
}
