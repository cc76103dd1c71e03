//! Measures of a mesh against the surface of which its points are measurements.
//!
//! A [`Truth`] is the true surface and the places of it that were measured ("seen"), as `cloudgen` writes
//! them with `--reference` and `--seen`. [`Truth::measure`] gives the [`Measures`] of a mesh.
//!
//! # Definitions
//!
//! *Spacing* at a place that was seen: the root of the area for each such place, `d √(π / k)` with `d` the
//! distance of its `k`-th neighbour among them. `h` is the median of all. `u` is `h` everywhere, or, where the
//! density is uneven ([`Options::local`]), the spacing of the nearest seen place, never less than `h`.
//!
//! Samples are uniform in area: as many of the true surface as of the mesh. A sample of the truth is *seen* if
//! one of the eight nearest seen places is within `2 u` of it, by the `u` of that place, and faces as it does:
//! the cosine of their normals is above 0.3. Its `u` is that of the first such place.
//!
//! | measure | definition |
//! |---|---|
//! | `accuracy` | distances of the mesh's samples from the whole truth, in `h`: 50, 90, 99 and 99.9 per cent |
//! | `completeness` | distances of the seen samples of the truth from the mesh, in `h`, likewise |
//! | `f` | harmonic mean of the share of the mesh within `1 u` of the truth and that of the seen truth within `1 u` of the mesh |
//! | `spurious` | share of the mesh farther than `3 u` from the truth |
//! | `complete` | share of the seen truth with mesh within `1.5 u` |
//! | `sided` | share of the seen truth whose nearest place of the mesh is within `1.5 u` and faces as it does |
//! | `angle` | of the mesh within `3 u`: mean angle, without sign, to the normal of the nearest triangle of the truth, in degrees |
//! | `bent` | of the mesh within `3 u`: share with more than 30 degrees |
//! | `wrong` | of the mesh within `3 u` and within 60 degrees, without sign: share that faces the wrong way |
//! | `boundary`, `nonmanifold`, `turned` | edges with one triangle; with more than two; with two that do not agree on a side |
//! | `components`, `euler` | pieces of the mesh that share no vertex; vertices − edges + triangles |

mod edges;
mod error;
mod measures;
mod read;
mod sample;
mod shape;
mod table;

pub use error::{Error, Result};
pub use measures::{Measures, Options, Truth};
pub use read::{Seen, read_mesh, read_seen};
pub use table::{head, row};
