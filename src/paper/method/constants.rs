//! Defines the constants by one list, from which a macro makes the struct, its values, and the data of an
//! ablation study: names, units, reasons, and other values to try.

/// Defines `Constants` with a struct for each group, `VALUES`, and, for tests and ablation studies, a list of
/// all entries. A constant is written as `name: type = value, "unit";`. The two other values to try are half
/// and double; others can be given as `name: type = value, "unit", [less, more];`.
macro_rules! constants {
    ($(
        $(#[doc = $about:literal])+
        $group:ident: $Group:ident {$(
            $(#[doc = $why:literal])+
            $name:ident: $type:ty = $value:expr, $unit:literal $(, [$less:expr, $more:expr])?;
        )+}
    )+) => {
        /// All constants of the method, in groups by step.
        #[derive(Debug, Clone, Copy)]
        pub struct Constants {$(
            $(#[doc = $about])+
            pub $group: $Group,
        )+}
        $(
            $(#[doc = $about])+
            #[derive(Debug, Clone, Copy)]
            pub struct $Group {$(
                $(#[doc = $why])+
                pub $name: $type,
            )+}
        )+
        const VALUES: Constants = Constants {
            $($group: $Group { $($name: $value,)+ },)+
        };

        #[cfg(any(test, feature = "ablation"))]
        impl Constants {
            /// A description of each constant.
            #[must_use]
            pub fn list() -> Vec<constants::Entry> {
                vec![$($(constants::Entry {
                    name: concat!(stringify!($group), ".", stringify!($name)),
                    value: constants::text(VALUES.$group.$name),
                    unit: $unit,
                    why: concat!($($why),+).trim(),
                    tried: {
                        let given: &[[$type; 2]] = &[$([$less, $more])?];
                        let usual = || constants::Halved::half_and_double(VALUES.$group.$name);
                        given.first().copied().unwrap_or_else(usual).map(constants::text)
                    },
                },)+)+]
            }
        }

        #[cfg(feature = "ablation")]
        impl Constants {
            /// Sets the constant with that name.
            ///
            /// # Errors
            /// A name that is none, or a value of another type.
            pub fn set(&mut self, name: &str, value: &str) -> Result<(), String> {
                match name {
                    $($(concat!(stringify!($group), ".", stringify!($name)) => {
                        self.$group.$name = value
                            .parse()
                            .map_err(|e| format!("{name}={value}: {e}"))?;
                    })+)+
                    _ => return Err(format!("{name:?} is no constant of the method")),
                }
                Ok(())
            }
        }
    };
}
pub(super) use constants;

#[cfg(any(test, feature = "ablation"))]
pub use list::Entry;
#[cfg(any(test, feature = "ablation"))]
pub(crate) use list::{Halved, text};

#[cfg(any(test, feature = "ablation"))]
mod list {
    /// A constant as a row of a table.
    #[derive(Debug, Clone)]
    pub struct Entry {
        /// Group and name, separated by a dot.
        pub name: &'static str,
        /// The value.
        pub value: String,
        /// Its unit.
        pub unit: &'static str,
        /// Its reason.
        pub why: &'static str,
        /// Two other values to try.
        pub tried: [String; 2],
    }

    /// A short text that parses to the same number.
    pub(crate) fn text(value: impl std::fmt::Debug) -> String {
        let text = format!("{value:?}");
        text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
    }

    /// A number that can be halved and doubled.
    pub(crate) trait Halved: Sized {
        /// Half of it, rounded up for integers, and double.
        fn half_and_double(self) -> [Self; 2];
    }

    macro_rules! halved {
        ($($type:ty: $half:expr;)+) => {
            $(impl Halved for $type {
                fn half_and_double(self) -> [Self; 2] {
                    let half: fn(Self) -> Self = $half;
                    [half(self), self + self]
                }
            })+
        };
    }

    halved! {
        f32: |x| x / 2.0;
        f64: |x| x / 2.0;
        i64: |x| (x + 1) / 2;
        u32: |x| x.div_ceil(2);
        u64: |x| x.div_ceil(2);
        u128: |x| x.div_ceil(2);
        usize: |x| x.div_ceil(2);
    }
}
