//! The stages from the triples of cells to a mesh, one folder each, in the order of the data flow; `surface` is what
//! stitching and repair share. Those from points to triples are in `outcrop-stages`.

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

pub mod triples;

pub mod stitch;

pub mod repair;

pub mod confidence;

pub mod surface;
