//! The stages of a reconstruction, one folder each, in the order of the data flow.

/// Implements `add` for counts: each of the named fields is added.
macro_rules! adds {
    ($name:ty: $($field:ident),*) => {
        impl $name {
            /// Adds other counts.
            pub(super) fn add(&mut self, more: &Self) {
                $(self.$field += more.$field;)*
            }
        }
    };
}

pub mod ids;

pub mod order;

pub mod tiles;

pub mod thin;

pub mod outliers;

pub mod attributes;
pub mod normals;

pub mod smooth;
pub mod spacing;

pub mod cells;

pub mod triples;

pub mod stitch;

pub mod repair;

pub mod blocks;
pub mod columns;
pub mod levels;
pub mod located;
pub mod outside;
pub mod scanners;
pub mod surface;
