//! Values of vertices: from the columns of the file to the attributes of tiles.

use outcrop_codecs::ply_mesh::PlyMesh;
use outcrop_ply::Scalar;
use serde::{Deserialize, Serialize};

/// A column that becomes an attribute of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Column {
    /// Its name in the file.
    pub name: String,
    /// Its type in the file.
    #[serde(rename = "type")]
    pub scalar: Scalar,
    /// The name of the attribute.
    pub attribute: String,
    /// Value of the column = value of the attribute + this.
    pub offset: f64,
}

impl Column {
    /// True if values are stored as doubles until the offset is known.
    fn is_wide(&self) -> bool {
        matches!(self.scalar, Scalar::I32 | Scalar::U32 | Scalar::F64)
    }

    /// The type of the attribute: that of the column, or floats.
    #[must_use]
    pub fn attribute_type(&self) -> Scalar {
        match self.is_wide() {
            true => Scalar::F32,
            false => self.scalar,
        }
    }
}

/// The columns of a mesh that tiles keep.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Columns {
    /// Indices in the file of all columns that are read, with their types, ascending.
    wanted: Vec<(usize, Scalar)>,
    /// The places of `nx`, `ny` and `nz` among them.
    normal: Option<[usize; 3]>,
    /// The places of `red`, `green` and `blue` among them, and the factor to 8 bits.
    color: Option<([usize; 3], f64)>,
    /// The others, with their places.
    others: Vec<(usize, Column)>,
}

/// The name of an attribute: letters, digits and `_`, in upper case, and unlike those in `taken`.
fn attribute_name(name: &str, taken: &[(usize, Column)]) -> String {
    let allowed = |c: char| match c.is_ascii_alphanumeric() {
        true => c.to_ascii_uppercase(),
        false => '_',
    };
    let mut plain: String = name.chars().map(allowed).take(60).collect();
    plain.insert(0, '_');
    // The place of the lowest bits of positions has that name.
    let is_taken = |name: &str| name == "_LOW" || taken.iter().any(|c| c.1.attribute == name);
    let mut unique = plain.clone();
    let mut number = 2;
    while is_taken(&unique) {
        unique = format!("{plain}_{number}");
        number += 1;
    }
    unique
}

/// Most columns that become attributes; a renderer has places for 16 in all.
const MOST: usize = 8;

impl Columns {
    /// The columns of a mesh.
    #[must_use]
    pub fn of(mesh: &PlyMesh) -> Self {
        let all = mesh.columns();
        let index = |name: &str| all.iter().position(|column| column.1 == name);
        let three = |names: [&str; 3]| {
            let [a, b, c] = names.map(index);
            Some([a?, b?, c?])
        };
        let normal = three(["nx", "ny", "nz"]);
        let color = three(["red", "green", "blue"]).and_then(|color| {
            let factor = match all[color[0]].2 {
                Scalar::U8 => 1.0,
                Scalar::U16 => 1.0 / 257.0,
                Scalar::F32 | Scalar::F64 => 255.0,
                _ => return None,
            };
            Some((color, factor))
        });
        let special = normal.iter().chain(color.iter().map(|c| &c.0)).flatten();
        let special: Vec<usize> = special.copied().collect();
        let mut others = Vec::new();
        for (place, (_, name, scalar)) in all.iter().enumerate() {
            if !special.contains(&place) && others.len() < MOST {
                let column = Column {
                    name: (*name).to_owned(),
                    scalar: *scalar,
                    attribute: attribute_name(name, &others),
                    offset: 0.0,
                };
                others.push((place, column));
            }
        }
        Self {
            wanted: all.iter().map(|column| (column.0, column.2)).collect(),
            normal,
            color,
            others,
        }
    }

    /// Indices in the file and types of the columns to be read.
    #[must_use]
    pub fn wanted(&self) -> Vec<(usize, Scalar)> {
        self.wanted.clone()
    }

    /// True if the file has normals.
    #[must_use]
    pub fn has_normals(&self) -> bool {
        self.normal.is_some()
    }

    /// True if the file has colours.
    #[must_use]
    pub fn has_colors(&self) -> bool {
        self.color.is_some()
    }

    /// The columns with attributes of their own.
    pub fn others(&self) -> impl Iterator<Item = &Column> {
        self.others.iter().map(|other| &other.1)
    }

    /// Words of a vertex in the file of vertices.
    #[must_use]
    pub fn stored(&self) -> usize {
        let others = self.others().map(|c| 1 + usize::from(c.is_wide()));
        usize::from(self.has_normals()) + usize::from(self.has_colors()) + others.sum::<usize>()
    }

    /// Words of a vertex in a node: the colour, and a word for each other column.
    #[must_use]
    pub fn words(&self) -> usize {
        usize::from(self.has_colors()) + self.others.len()
    }

    /// Appends the words of a vertex with these values of the wanted columns; finds the offsets.
    pub fn store(&mut self, values: &[f64], mut put: impl FnMut(u32)) {
        if let Some(places) = self.normal {
            let [x, y] = octahedral(places.map(|place| values[place]));
            put(u32::from(x.cast_unsigned()) | u32::from(y.cast_unsigned()) << 8);
        }
        if let Some((places, factor)) = self.color {
            let [r, g, b] = places.map(|place| (values[place] * factor) as u8);
            put(u32::from_le_bytes([r, g, b, 255]));
        }
        for (place, column) in &mut self.others {
            let value = values[*place];
            if column.is_wide() {
                let bits = value.to_bits();
                put(bits as u32);
                put((bits >> 32) as u32);
                // The negation of the smallest value, so that zero is the offset at first.
                if value.is_finite() && (column.offset == 0.0 || value < column.offset) {
                    column.offset = value;
                }
            } else if column.scalar == Scalar::F32 {
                put((value as f32).to_bits());
            } else {
                put((value as i64) as u32);
            }
        }
    }

    /// The normal of the file, and the words of a node, from the stored words of a vertex.
    pub fn load(&self, stored: &[u32], mut put: impl FnMut(u32)) -> Option<[i8; 2]> {
        let mut words = stored.iter().copied();
        let mut next = || words.next().unwrap_or(0);
        let normal = self.normal.map(|_| {
            let word = next();
            [word as u8, (word >> 8) as u8].map(u8::cast_signed)
        });
        if self.has_colors() {
            put(next());
        }
        for column in self.others() {
            if column.is_wide() {
                let bits = u64::from(next()) | u64::from(next()) << 32;
                put(((f64::from_bits(bits) - column.offset) as f32).to_bits());
            } else {
                put(next());
            }
        }
        normal
    }
}

/// A direction in two bytes, as the filter `OCTAHEDRAL` stores it; up for a vector without direction.
#[must_use]
pub fn octahedral(v: [f64; 3]) -> [i8; 2] {
    let sum = v.iter().map(|x| x.abs()).sum::<f64>();
    if !(sum > 0.0 && sum.is_finite()) {
        return [0, 0];
    }
    let [x, y, z] = v.map(|c| c / sum);
    let sign = |x: f64| if x < 0.0 { -1.0 } else { 1.0 };
    let (x, y) = match z < 0.0 {
        true => ((1.0 - y.abs()) * sign(x), (1.0 - x.abs()) * sign(y)),
        false => (x, y),
    };
    [x, y].map(|c| (c * 127.0).round() as i8)
}
