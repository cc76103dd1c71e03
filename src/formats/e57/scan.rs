//! A scan of an E57 file, as its description says: the parts of a record, and the pose.

use outcrop_ply::Scalar;
use outcrop_points::columns::{CLASSIFICATION, Column, NO_SCANNER, SCANNER, usual_name};

/// The part of a record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Name {
    /// A Cartesian coordinate.
    Cartesian(usize),
    CartesianState,
    /// Range, azimuth and elevation.
    Spherical(usize),
    SphericalState,
    /// Anything else.
    Other(Box<str>),
}

impl Name {
    pub(super) fn of(name: &str) -> Self {
        match name {
            "cartesianX" => Self::Cartesian(0),
            "cartesianY" => Self::Cartesian(1),
            "cartesianZ" => Self::Cartesian(2),
            "cartesianInvalidState" => Self::CartesianState,
            "sphericalRange" => Self::Spherical(0),
            "sphericalAzimuth" => Self::Spherical(1),
            "sphericalElevation" => Self::Spherical(2),
            "sphericalInvalidState" => Self::SphericalState,
            other => Self::Other(other.into()),
        }
    }
}

/// Type of a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Single,
    Double,
    /// Whole numbers of a range, as their difference to the lowest, in as few bits as possible. The number is
    /// `i * scale + offset`.
    Integer {
        lowest: i64,
        highest: i64,
        scale: f64,
        offset: f64,
    },
}

impl Kind {
    /// Bits of a number; none if there is only one.
    pub(super) fn bits(self) -> u32 {
        match self {
            Self::Single => 32,
            Self::Double => 64,
            Self::Integer {
                lowest, highest, ..
            } => u64::BITS - highest.wrapping_sub(lowest).cast_unsigned().leading_zeros(),
        }
    }
}

/// Types of whole numbers, smaller ones first.
const WHOLE: [(Scalar, i64, i64); 6] = [
    (Scalar::U8, 0, u8::MAX as i64),
    (Scalar::I8, i8::MIN as i64, i8::MAX as i64),
    (Scalar::U16, 0, u16::MAX as i64),
    (Scalar::I16, i16::MIN as i64, i16::MAX as i64),
    (Scalar::U32, 0, u32::MAX as i64),
    (Scalar::I32, i32::MIN as i64, i32::MAX as i64),
];

impl Kind {
    /// The type of a column of such numbers.
    pub(super) fn scalar(self) -> Scalar {
        match self {
            Self::Single => Scalar::F32,
            Self::Integer {
                lowest,
                highest,
                scale: 1.0,
                offset: 0.0,
            } => {
                let holds = |(_, min, max): &&(Scalar, i64, i64)| *min <= lowest && highest <= *max;
                let found = WHOLE.iter().find(holds);
                found.map_or(Scalar::F64, |(scalar, ..)| *scalar)
            }
            // Single precision tells all of them apart.
            Self::Integer { offset: 0.0, .. } if self.bits() <= 24 => Scalar::F32,
            _ => Scalar::F64,
        }
    }
}

/// A part of a record.
#[derive(Debug, Clone)]
pub(super) struct Field {
    pub(super) name: Name,
    pub(super) kind: Kind,
}

/// The parts of the standard that have other names as columns.
const COLUMNS: [(&str, &str); 8] = [
    ("colorRed", "red"),
    ("colorGreen", "green"),
    ("colorBlue", "blue"),
    ("rowIndex", "row"),
    ("columnIndex", "column"),
    ("returnIndex", "return_index"),
    ("returnCount", "return_count"),
    ("timeStamp", "time_stamp"),
];

/// The parts that tell if others are valid, and these.
const STATES: [(&str, &[&str]); 3] = [
    ("isIntensityInvalid", &["intensity"]),
    ("isColorInvalid", &["red", "green", "blue"]),
    ("isTimeStampInvalid", &["time_stamp"]),
];

impl Field {
    /// The column of which this has the values; none for coordinates and states, and for what would have the name
    /// of the column of scanners.
    pub(super) fn column(&self) -> Option<Column> {
        let Name::Other(name) = &self.name else {
            return None;
        };
        if STATES.iter().any(|(state, _)| *state == &**name) {
            return None;
        }
        let usual = COLUMNS.iter().find(|(standard, _)| *standard == &**name);
        // Names of extensions have a prefix and a colon.
        let own = name.rsplit(':').next().unwrap_or(name);
        let class = (usual_name(own) == CLASSIFICATION).then_some(CLASSIFICATION);
        let known = usual.map(|(_, usual)| *usual).or(class);
        let name = known.map_or_else(|| name.replace(':', "_"), str::to_owned);
        Some(Column::new(&name, self.kind.scalar())).filter(|column| column.name != SCANNER)
    }
}

/// The place of a scanner.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pose {
    /// Quaternion: w, x, y, z.
    pub(super) rotation: [f64; 4],
    pub(super) translation: [f64; 3],
}

impl Default for Pose {
    fn default() -> Self {
        Self {
            rotation: [1.0, 0.0, 0.0, 0.0],
            translation: [0.0; 3],
        }
    }
}

impl Pose {
    /// The rows of a matrix, and a translation; none if the rotation is none.
    pub(super) fn motion(&self) -> Option<Motion> {
        let [w, x, y, z] = self.rotation;
        let norm2 = w * w + x * x + y * y + z * z;
        if !norm2.is_normal() || !self.translation.iter().all(|t| t.is_finite()) {
            return None;
        }
        // A unit quaternion, but for the rounding of its text.
        let norm = match (norm2 - 1.0).abs() < 1e-14 {
            true => 1.0,
            false => norm2.sqrt(),
        };
        let [w, x, y, z] = [w, x, y, z].map(|part| part / norm);
        Some(Motion {
            rows: [
                [
                    w * w + x * x - y * y - z * z,
                    2.0 * (x * y - w * z),
                    2.0 * (x * z + w * y),
                ],
                [
                    2.0 * (x * y + w * z),
                    w * w + y * y - x * x - z * z,
                    2.0 * (y * z - w * x),
                ],
                [
                    2.0 * (x * z - w * y),
                    2.0 * (y * z + w * x),
                    w * w + z * z - x * x - y * y,
                ],
            ],
            translation: self.translation,
        })
    }
}

/// A rotation and a translation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Motion {
    rows: [[f64; 3]; 3],
    translation: [f64; 3],
}

impl Motion {
    /// True if every point stays where it is.
    pub(super) fn rests(&self) -> bool {
        !self.turns() && self.translation == [0.0; 3]
    }

    /// True if it is not only a translation.
    pub(super) fn turns(&self) -> bool {
        self.rows != [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    }

    /// A direction, turned.
    #[inline]
    pub(super) fn turned(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        self.rows.map(|[a, b, c]| a * x + b * y + c * z)
    }

    #[inline]
    pub(super) fn apply(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| {
            let [a, b, c] = self.rows[axis];
            a * x + b * y + c * z + self.translation[axis]
        })
    }
}

/// Lowest and highest number of each colour.
pub(super) type Limits = [[f64; 2]; 3];

/// A scan.
#[derive(Debug, Clone, Default)]
pub(super) struct Scan {
    /// Number of records.
    pub(super) points: u64,
    /// Offset in the file of its section.
    pub(super) section: u64,
    pub(super) pose: Option<Pose>,
    pub(super) fields: Vec<Field>,
    /// Its number among the scans with a scanner.
    pub(super) number: Option<u16>,
    /// Lowest and highest number of each colour, as the description gives them.
    pub(super) color_limits: [[Option<f64>; 2]; 3],
    /// The same, if colours become numbers from 0 to 65535.
    pub(super) widened: Option<Limits>,
}

impl Scan {
    /// The number of the field with this name.
    pub(super) fn field(&self, name: &Name) -> Option<usize> {
        self.fields.iter().position(|field| field.name == *name)
    }

    /// The number of the field that tells if a column is valid.
    pub(super) fn state(&self, column: &str) -> Option<usize> {
        let state = STATES.iter().find(|(_, columns)| columns.contains(&column));
        state.and_then(|(state, _)| self.field(&Name::of(state)))
    }

    /// The numbers of three fields.
    pub(super) fn three(&self, name: impl Fn(usize) -> Name) -> Option<[usize; 3]> {
        let [a, b, c] = [0, 1, 2].map(|number| self.field(&name(number)));
        Some([a?, b?, c?])
    }

    /// Bits of a record.
    pub(super) fn bits(&self) -> u64 {
        self.fields.iter().map(|f| u64::from(f.kind.bits())).sum()
    }

    /// The position of the scanner, the origin of the scan, if its records are in a grid or are directions, or it
    /// was turned. Else its translation may be that of the origin of coordinates.
    pub(super) fn scanner(&self) -> Option<[f64; 3]> {
        let motion = self.motion()?;
        let grid = ["rowIndex", "columnIndex"].map(Name::of);
        let is_in_grid = grid.iter().any(|index| self.field(index).is_some());
        let is_scan = is_in_grid || self.three(Name::Spherical).is_some() || motion.turns();
        is_scan.then_some(motion.translation)
    }

    /// The value of the column of scanners.
    pub(super) fn scanner_number(&self) -> u16 {
        self.number.unwrap_or(NO_SCANNER)
    }

    /// The motion of the points; none if the rotation is none.
    pub(super) fn motion(&self) -> Option<Motion> {
        self.pose.unwrap_or_default().motion()
    }
}
