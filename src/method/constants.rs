//! One list of constants makes the struct, its values, and what an ablation study needs: names, units,
//! reasons, and other values to try.

/// Makes `Constants` with a struct for each group, `VALUES`, and for tests and ablation studies the list
/// of all of them. A constant is given as `name: type = value, "unit";`, or with two other values that are
/// worth trying, if these are not half and double, as `name: type = value, "unit", [less, more];`.
macro_rules! constants {
    ($(
        $(#[doc = $about:literal])+
        $group:ident: $Group:ident {$(
            $(#[doc = $why:literal])+
            $name:ident: $type:ty = $value:expr, $unit:literal $(, [$less:expr, $more:expr])?;
        )+}
    )+) => {
        /// All constants of the method, by its steps.
        #[derive(Debug, Clone, Copy)]
        pub(crate) struct Constants {$(
            $(#[doc = $about])+
            pub $group: $Group,
        )+}
        $(
            $(#[doc = $about])+
            #[derive(Debug, Clone, Copy)]
            pub(crate) struct $Group {$(
                $(#[doc = $why])+
                pub $name: $type,
            )+}
        )+
        const VALUES: Constants = Constants {
            $($group: $Group { $($name: $value,)+ },)+
        };

        #[cfg(any(test, feature = "ablation"))]
        impl Constants {
            /// What there is to say of each constant.
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
            /// Sets the constant of that name.
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
pub(crate) use list::{Entry, Halved, text};

#[cfg(any(test, feature = "ablation"))]
mod list {
    /// A constant as tables have it.
    #[derive(Debug, Clone)]
    pub(crate) struct Entry {
        /// Group and name, with a dot between them.
        pub name: &'static str,
        pub value: String,
        pub unit: &'static str,
        pub why: &'static str,
        /// Two values worth trying instead.
        pub tried: [String; 2],
    }

    /// A number that parses to the same one.
    pub(crate) fn text(value: impl std::fmt::Debug) -> String {
        let text = format!("{value:?}");
        text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
    }

    /// A number that can be halved and doubled.
    pub(crate) trait Halved: Sized {
        /// Half of it, of whole numbers rounded up, and twice as much.
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
