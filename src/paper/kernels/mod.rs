//! The inner loops, executed once for every point and candidate, compiled for the vector instructions of the
//! machine.
//!
//! A kernel is written once, as scalar code over columns; this is its definition. The same source is compiled
//! for each [`Level`], and the compiler vectorises it. Integer arithmetic is exact, and floating-point
//! operations keep their order (none is fused or reassociated), so every level gives the same bits. The tests
//! of each kernel compare them.

mod boxes;
mod corners;
mod distances;
pub mod eight;
mod fan;
pub mod numbers;
pub mod pair;
mod pick;
mod ranks;
pub mod sixteen;
mod sums;
mod weighted;

pub use boxes::point_box_body;
pub use boxes::{Boxes, CoveredBoxes, SearchBox, near_boxes, take_boxes};
pub use corners::SLACK;
pub use corners::{
    CornerGroup, Frame, LANES, Line, LineGroup, bisectors, cut_corners, farthest, touching_lines,
};
pub use corners::{
    Place, bisectors_body, cut_body, farthest_body, touching_body, touching_places_body,
};
pub use distances::{count_body, distances_body};
pub use distances::{count_within, distances};
pub use fan::{MOST_EDGES, is_one_fan};
pub use pick::pick_column;
pub use pick::{BLOCK, Pick, RANKED, SHORT_RANKED, first_bits, pick_body};
pub use ranks::{ranks, short_ranks};
pub use ranks::{ranks_body, short_ranks_body};
pub use sums::{MOST_SUMMED, SUMMED_LIMIT2, second_moments_body};
pub use sums::{SecondMoments, second_moments};
pub use weighted::{
    LaneSums, SpreadSums, SurfaceSums, Weighted, drop_beyond, fade, square_weights, take_weighted,
    turn,
};

/// A set of vector instructions that this machine supports.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Level(Width);

/// The width of the registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Width {
    /// The baseline of the architecture.
    Base,
    /// AVX2, 256 bits.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// AVX-512 (F, BW, DQ, VL), 512 bits.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Level {
    /// The baseline: the scalar definition.
    pub const BASE: Self = Self(Width::Base);

    /// The widest level of this machine.
    #[must_use]
    pub fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if avx512() {
                return Self(Width::Avx512);
            }
            if avx2() {
                return Self(Width::Avx2);
            }
        }
        Self::BASE
    }

    /// All levels of this machine, narrowest first.
    #[must_use]
    pub fn all() -> Vec<Self> {
        #[cfg(target_arch = "x86_64")]
        let wide = [
            avx2().then_some(Self(Width::Avx2)),
            avx512().then_some(Self(Width::Avx512)),
        ];
        #[cfg(not(target_arch = "x86_64"))]
        let wide: [Option<Self>; 0] = [];
        std::iter::once(Self::BASE)
            .chain(wide.into_iter().flatten())
            .collect()
    }
}

impl Level {
    #[cfg(target_arch = "x86_64")]
    /// The width of the registers.
    #[must_use]
    pub fn width(self) -> Width {
        self.0
    }
}

impl Default for Level {
    fn default() -> Self {
        Self::best()
    }
}

#[cfg(target_arch = "x86_64")]
fn avx2() -> bool {
    is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("lzcnt")
        && is_x86_feature_detected!("popcnt")
}

#[cfg(target_arch = "x86_64")]
fn avx512() -> bool {
    avx2()
        && is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl")
}

/// Defines `name(level, …)` from the scalar definition `body(…)`. The body must be `inline(always)`, as must
/// the functions it calls that are to be vectorised. With `<Eight>` after its name, the body is generic over
/// the vector type, which is chosen by the level.
#[doc(hidden)]
#[macro_export]
macro_rules! __kernel {
    ($(#[$doc:meta])* $vis:vis fn $name:ident($($arg:ident: $type:ty),* $(,)?) $(-> $out:ty)? = $body:ident<Eight>) => {
        $crate::kernels::kernel! {
            @made $(#[$doc])* $vis fn $name($($arg: $type),*) $(-> $out)?
                = $body::<$crate::kernels::eight::Base>,
                $body::<$crate::kernels::eight::Avx2>,
                $body::<$crate::kernels::eight::Avx512>
        }
    };
    ($(#[$doc:meta])* $vis:vis fn $name:ident($($arg:ident: $type:ty),* $(,)?) $(-> $out:ty)? = $body:path) => {
        $crate::kernels::kernel! {
            @made $(#[$doc])* $vis fn $name($($arg: $type),*) $(-> $out)? = $body, $body, $body
        }
    };
    (@made $(#[$doc:meta])* $vis:vis fn $name:ident($($arg:ident: $type:ty),*) $(-> $out:ty)?
        = $base:expr, $avx2:expr, $avx512:expr) => {
        $(#[$doc])*
        #[allow(unsafe_code, reason = "the wide versions need instructions that were looked for")]
        $vis fn $name(level: $crate::kernels::Level, $($arg: $type),*) $(-> $out)? {
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
                fn avx2($($arg: $type),*) $(-> $out)? {
                    $avx2($($arg),*)
                }
                #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,bmi1,bmi2,lzcnt,popcnt")]
                fn avx512($($arg: $type),*) $(-> $out)? {
                    $avx512($($arg),*)
                }
                match level.width() {
                    $crate::kernels::Width::Base => {}
                    // SAFETY: only `Level::best` and `Level::all` construct this level, after they found
                    // these instructions on the machine.
                    $crate::kernels::Width::Avx2 => return unsafe { avx2($($arg),*) },
                    // SAFETY: as above.
                    $crate::kernels::Width::Avx512 => return unsafe { avx512($($arg),*) },
                }
            }
            let _ = level;
            $base($($arg),*)
        }
    };
}
pub use __kernel as kernel;
