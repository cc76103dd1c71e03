//! Where a tileset lies beside another one.

use super::tileset::Facts;
use outcrop_disk::error::{Error, Remedy, Result};

/// A map by the columns of its matrix.
pub type Matrix = [f64; 16];

impl Facts {
    /// The map from the coordinates in this tileset to those in `first`; none for the same ones.
    ///
    /// Two tilesets of one reference system, or of which one does not tell any, differ by their origins, in all
    /// digits. Those of different ones, or of other programs, meet on the globe, if both are placed there.
    ///
    /// # Errors
    /// [`Error::Input`] if nothing tells how they lie.
    pub fn beside(&self, first: &Self) -> Result<Option<Matrix>> {
        let differ = self.epsg.zip(first.epsg).is_some_and(|(a, b)| a != b);
        let placed = self.transform.as_deref().zip(first.transform.as_deref());
        match placed {
            Some((own, other)) if differ || !(self.is_ours && first.is_ours) => {
                let inverse = inverse(other).ok_or_else(|| {
                    let found = "one that cannot be inverted".to_owned();
                    Error::input(
                        &first.path,
                        "root.transform",
                        found,
                        "a frame of three axes",
                    )
                })?;
                Ok(Some(product(&inverse, own)))
            }
            None if differ => Err(self.refused(first)),
            // One of another program, that only has a place on the globe.
            None if [self, first].iter().any(|facts| facts.is_elsewhere()) => {
                Err(self.refused(first))
            }
            _ => {
                let shift: [f64; 3] = std::array::from_fn(|k| self.origin[k] - first.origin[k]);
                Ok((shift != [0.0; 3]).then(|| moved(shift)))
            }
        }
    }

    /// True if the coordinates are no others than those on the globe.
    fn is_elsewhere(&self) -> bool {
        !self.is_ours && self.transform.is_some()
    }

    /// The system in words.
    fn system(&self) -> String {
        match self.epsg {
            Some(code) => format!("EPSG:{code}"),
            None if self.is_elsewhere() => "a place on the globe only".to_owned(),
            None => "none".to_owned(),
        }
    }

    fn refused(&self, first: &Self) -> Error {
        let (system, path) = (first.system(), first.path.display());
        let expected = format!("{system}, that of {path}");
        let refused = Error::input(&self.path, "reference system", self.system(), expected);
        match self.is_cloud {
            true => refused,
            false => refused.with(Remedy::Command(
                "tiles --geo",
                "on both, which places them on the globe",
            )),
        }
    }
}

fn moved([x, y, z]: [f64; 3]) -> Matrix {
    let columns = [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
        [x, y, z, 1.0],
    ];
    std::array::from_fn(|n| columns[n / 4][n % 4])
}

/// First `b`, then `a`.
fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|n| (0..4).map(|k| a[4 * k + n % 4] * b[n / 4 * 4 + k]).sum())
}

/// The inverse of a map that keeps the last row `0 0 0 1`; none if it has none.
fn inverse(m: &Matrix) -> Option<Matrix> {
    let axes: [[f64; 3]; 3] = std::array::from_fn(|k| [m[4 * k], m[4 * k + 1], m[4 * k + 2]]);
    let cross = |a: [f64; 3], b: [f64; 3]| {
        std::array::from_fn(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3])
    };
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let volume = dot(axes[0], cross(axes[1], axes[2]));
    // Row k of the inverse is orthogonal to the other two axes.
    let rows: [[f64; 3]; 3] =
        std::array::from_fn(|k| cross(axes[(k + 1) % 3], axes[(k + 2) % 3]).map(|x| x / volume));
    let place = [m[12], m[13], m[14]];
    let inverse: Matrix = std::array::from_fn(|n| match (n / 4, n % 4) {
        (3, 3) => 1.0,
        (_, 3) => 0.0,
        (3, row) => -dot(rows[row], place),
        (column, row) => rows[row][column],
    });
    inverse.iter().all(|x| x.is_finite()).then_some(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn facts(epsg: Option<u64>, origin: [f64; 3]) -> Facts {
        Facts {
            path: "b/tileset.json".into(),
            is_cloud: false,
            is_ours: true,
            origin,
            epsg,
            transform: None,
        }
    }

    fn applied(m: &Matrix, [x, y, z]: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|k| m[k] * x + m[4 + k] * y + m[8 + k] * z + m[12 + k])
    }

    /// A frame somewhere on the globe, with axes that are not quite at right angles.
    fn somewhere(at: f64) -> Matrix {
        let (sin, cos) = (at.sin(), at.cos());
        let columns = [
            [-sin, cos, 1e-5, 0.0],
            [-0.7 * cos, -0.7 * sin, 0.714, 0.0],
            [0.714 * cos, 0.714 * sin, 0.7, 0.0],
            [4.5e6 * cos, 4.5e6 * sin, 4.5e6, 1.0],
        ];
        std::array::from_fn(|n| columns[n / 4][n % 4])
    }

    #[test]
    fn tilesets_of_one_system_differ_by_their_origins() {
        let a = facts(Some(25832), [500_000.25, 5_000_000.0, 100.0]);
        for epsg in [Some(25832), None] {
            let b = facts(epsg, [500_010.5, 4_999_999.0, 100.0]);
            let matrix = b.beside(&a).unwrap().unwrap();
            assert_eq!(applied(&matrix, [1.0, 2.0, 3.0]), [11.25, 1.0, 3.0]);
        }
        assert_eq!(a.beside(&a).unwrap(), None);
        // Digits are not lost on the way over the globe if they need not go there.
        let placed = |facts: Facts, at| Facts {
            transform: Some(Box::new(somewhere(at))),
            ..facts
        };
        let b = placed(facts(Some(25832), [500_000.5, 5_000_000.0, 100.0]), 0.3);
        let matrix = b.beside(&placed(a, 0.2)).unwrap().unwrap();
        assert_eq!(matrix[12..15], [0.25, 0.0, 0.0]);
    }

    #[test]
    fn those_of_different_systems_meet_on_the_globe_or_not_at_all() {
        let (mut a, mut b) = (
            facts(Some(25832), [5e5, 5e6, 0.0]),
            facts(Some(25833), [1e5, 5e6, 0.0]),
        );
        let said = b.beside(&a).unwrap_err();
        assert_eq!(said.remedies().len(), 1);
        let said = said.to_string();
        assert!(
            said.contains("EPSG:25833") && said.contains("EPSG:25832"),
            "{said}"
        );
        a.transform = Some(Box::new(somewhere(0.2)));
        assert!(b.beside(&a).is_err());
        b.transform = Some(Box::new(somewhere(0.2001)));
        let matrix = b.beside(&a).unwrap().unwrap();
        let (here, there) = ([10.0, 20.0, 30.0], applied(&matrix, [10.0, 20.0, 30.0]));
        let (on_a, on_b) = (
            applied(&somewhere(0.2), there),
            applied(&somewhere(0.2001), here),
        );
        for k in 0..3 {
            assert!((on_a[k] - on_b[k]).abs() < 1e-6, "{on_a:?} {on_b:?}");
        }
        a.transform = Some(Box::new([0.0; 16]));
        assert!(b.beside(&a).is_err());
    }

    #[test]
    fn one_that_is_only_on_the_globe_has_no_place_beside_coordinates() {
        let mut foreign = facts(None, [0.0; 3]);
        foreign.is_ours = false;
        let ours = facts(None, [7.0, 0.0, 0.0]);
        assert_eq!(foreign.beside(&ours).unwrap().unwrap()[12], -7.0);
        foreign.transform = Some(Box::new(somewhere(1.0)));
        assert!(foreign.beside(&ours).is_err() && ours.beside(&foreign).is_err());
        assert!(foreign.beside(&foreign).unwrap().is_some());
    }
}
