//! Types in a header.

/// Encoding of the elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// Numbers as text.
    Ascii,
    /// Binary, least significant byte first.
    Little,
    /// Binary, most significant byte first.
    Big,
}

impl Encoding {
    pub(crate) fn parse(name: &str) -> Option<Self> {
        [Self::Ascii, Self::Little, Self::Big]
            .into_iter()
            .find(|e| e.name() == name)
    }

    /// The name in a header.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Ascii => "ascii",
            Self::Little => "binary_little_endian",
            Self::Big => "binary_big_endian",
        }
    }
}

/// Type of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs)]
pub enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    pub(crate) fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// The name in a header; of two names the one that every reader knows.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::I8 => "char",
            Self::U8 => "uchar",
            Self::I16 => "short",
            Self::U16 => "ushort",
            Self::I32 => "int",
            Self::U32 => "uint",
            Self::F32 => "float",
            Self::F64 => "double",
        }
    }

    /// Bytes of a number in a binary file.
    #[must_use]
    pub fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Appends a number in little-endian order. Integers are truncated, and limited to the range of the type; NaN
    /// is zero for integers, and one and the same NaN for floats.
    #[inline]
    pub fn put(self, value: f64, bytes: &mut Vec<u8>) {
        match self {
            Self::I8 => bytes.extend_from_slice(&(value as i8).to_le_bytes()),
            Self::U8 => bytes.push(value as u8),
            Self::I16 => bytes.extend_from_slice(&(value as i16).to_le_bytes()),
            Self::U16 => bytes.extend_from_slice(&(value as u16).to_le_bytes()),
            Self::I32 => bytes.extend_from_slice(&(value as i32).to_le_bytes()),
            Self::U32 => bytes.extend_from_slice(&(value as u32).to_le_bytes()),
            Self::F32 => {
                let value = if value.is_nan() {
                    f32::NAN
                } else {
                    value as f32
                };
                bytes.extend_from_slice(&value.to_le_bytes());
            }
            Self::F64 => {
                let value = if value.is_nan() { f64::NAN } else { value };
                bytes.extend_from_slice(&value.to_le_bytes());
            }
        }
    }

    /// True for integer types.
    #[must_use]
    pub fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }
}

/// A property of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Property {
    /// One number.
    One(Scalar),
    /// A list: a count, followed by this number of items.
    List {
        /// Type of the count, an integer.
        count: Scalar,
        /// Type of the items.
        item: Scalar,
    },
}

impl Property {
    /// Bytes in a binary file; none for a list.
    #[must_use]
    pub fn bytes(self) -> Option<usize> {
        match self {
            Self::One(scalar) => Some(scalar.bytes()),
            Self::List { .. } => None,
        }
    }
}
