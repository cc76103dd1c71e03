//! Normals that points have in their files: the columns, and a short form of their values.

use super::Spool;
use super::carry::Carried;
use super::columns::{Column, row_bytes};
use super::source::Source;
use outcrop_ply::{Scalar, real};

/// Names of the columns of a normal, as they are known in all formats: of PLY and CloudCompare, of PCD, of the
/// extension of E57, and of LAS, the last of three numbers in one.
const NAMES: [[&str; 3]; 5] = [
    ["nx", "ny", "nz"],
    ["normal_x", "normal_y", "normal_z"],
    ["nor_normalx", "nor_normaly", "nor_normalz"],
    ["normalx", "normaly", "normalz"],
    ["normal0", "normal1", "normal2"],
];

/// Length of a normal in its short form.
const LENGTH: f64 = i16::MAX as f64;

/// What is added to its components, so that they are not negative.
const ADDED: i32 = i16::MAX as i32;

/// Bytes of a normal in its short form: two words.
pub const NORMAL_BYTES: usize = 8;

/// A component of a point without a normal.
const NONE: u32 = u16::MAX as u32;

/// Numbers of the columns of a normal; of several with the same name the first counts.
pub(super) fn normal_columns(columns: &[Column]) -> Option<[usize; 3]> {
    let number = |name: &str| columns.iter().position(|c| c.name == name);
    NAMES.iter().find_map(|names| {
        let [x, y, z] = names.map(number);
        Some([x?, y?, z?])
    })
}

/// The short form of a direction, in words that compare like its components; none is larger than all.
pub(super) fn short(direction: [f64; 3]) -> [u32; 2] {
    let largest = direction.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let finite = direction.iter().all(|x| x.is_finite());
    let [x, y, z] = match finite && largest > 0.0 {
        true => {
            let scaled = direction.map(|x| x / largest);
            let [x, y, z] = scaled;
            let length = (x * x + y * y + z * z).sqrt();
            scaled.map(|x| ((x / length * LENGTH).round() as i32 + ADDED) as u32)
        }
        false => [NONE; 3],
    };
    [x << 16 | y, z << 16]
}

/// The direction with this short form, about 2^15 long.
#[must_use]
pub fn direction([first, second]: [u32; 2]) -> Option<[i32; 3]> {
    let parts = [first >> 16, first & 0xffff, second >> 16];
    let known = parts.iter().all(|part| *part < NONE);
    known.then(|| parts.map(|part| part as i32 - ADDED))
}

/// Places and types of the components of a normal in the rows of a source.
pub(super) type Parts = [(usize, Scalar); 3];

/// The short form of the normal of a point whose values in the spool are `values`.
pub(super) fn normal_of(parts: Option<&Parts>, values: &[u8]) -> [u32; 2] {
    let value = |(at, scalar): (usize, Scalar)| real(scalar, &values[at..], false);
    short(parts.map_or([0.0; 3], |parts| parts.map(value)))
}

impl Spool {
    /// The names of the columns of the normals, if they were read and a file has any: those of the first such file.
    #[must_use]
    pub fn normal_names(&self) -> Option<[String; 3]> {
        let kept = self.sources.iter().filter(|s| s.stats.kept > 0);
        let names = |source: &Source| {
            let numbers = normal_columns(&source.columns)?;
            Some(numbers.map(|number| source.columns[number].name.clone()))
        };
        let mut all: Vec<_> = kept.filter_map(names).collect();
        all.sort_unstable();
        all.into_iter().next()
    }

    /// The same columns, and the normals of the points if they were read and a file has any.
    #[must_use]
    pub fn with_normals(&self, mut carried: Carried) -> Carried {
        if self.normal_names().is_some() {
            let parts = |source: &Source| {
                let numbers = normal_columns(&source.columns)?;
                let at = |number: usize| row_bytes(&source.columns[..number]);
                Some(numbers.map(|number| (at(number), source.columns[number].scalar)))
            };
            carried.normals = Some(self.sources.iter().map(parts).collect());
        }
        carried
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_have_many_names() {
        let columns = |names: &[&str]| -> Vec<Column> {
            let columns = names.iter().map(|name| Column::new(name, Scalar::F32));
            columns.collect()
        };
        for (names, expected) in [
            (&["red", "NX", "Ny", "nz"][..], Some([1, 2, 3])),
            (&["normal_z", "normal_x", "normal_y"], Some([1, 2, 0])),
            (
                &["nor_normalX", "nor_normalY", "nor_normalZ"],
                Some([0, 1, 2]),
            ),
            (&["NormalX", "NormalY", "NormalZ", "nx"], Some([0, 1, 2])),
            (&["scalar_Nx", "scalar_Ny", "scalar_Nz"], Some([0, 1, 2])),
            (&["nx", "ny", "normalz"], None),
            (&[], None),
        ] {
            assert_eq!(normal_columns(&columns(names)), expected, "{names:?}");
        }
    }

    #[test]
    fn short_forms_are_directions_and_compare_like_them() {
        for (v, expected) in [
            ([0.0, 0.0, 1.0], Some([0, 0, 32767])),
            ([0.0, -7e200, 0.0], Some([0, -32767, 0])),
            ([3e-200, 0.0, -4e-200], Some([19660, 0, -26214])),
            ([0.0, -0.0, 0.0], None),
            ([f64::NAN, 0.0, 1.0], None),
            ([0.0, 1.0, f64::INFINITY], None),
        ] {
            assert_eq!(direction(short(v)), expected, "{v:?}");
        }
        let ascending = [
            [-1.0, 0.0, 0.0],
            [-0.6, 0.0, 0.8],
            [0.0, -1.0, 0.0],
            [0.0, 0.0, -1.0],
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 0.0],
            [0.0; 3],
        ];
        assert!(ascending.map(short).is_sorted());
    }
}
