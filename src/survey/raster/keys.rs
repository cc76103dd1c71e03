//! The reference system of a raster as GeoTIFF keys.

use outcrop_points::{Crs, CrsKind};
use serde::{Deserialize, Serialize};

/// Numbers and texts of the keys.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Keys {
    pub numbers: Vec<u16>,
    pub texts: String,
    /// False if the file has no more than the name of the system.
    pub is_known: bool,
}

/// A code of EPSG, or that for a system without one.
const USER_DEFINED: u16 = 32767;

impl Keys {
    pub fn of(system: Option<&Crs>) -> Self {
        let code = |code: Option<u32>| code.and_then(|code| u16::try_from(code).ok());
        let horizontal = code(system.and_then(|system| system.horizontal));
        let vertical = code(system.and_then(|system| system.vertical));
        let kind = system.and_then(|system| system.kind);
        let is_geographic = kind == Some(CrsKind::Geographic);
        let mut keys: Vec<[u16; 4]> = Vec::new();
        let model = match (horizontal, is_geographic) {
            (Some(_), true) => Some(2),
            (Some(_), false) => Some(1),
            (None, _) => system.map(|_| USER_DEFINED),
        };
        keys.extend(model.map(|model| [1024, 0, 1, model]));
        // A sample is the height of its cell.
        keys.push([1025, 0, 1, 1]);
        let texts = system.map_or_else(String::new, |system| {
            let name: String = system.label().chars().filter(char::is_ascii).collect();
            name.replace('|', " ") + "|"
        });
        if let Ok(length @ 1..) = u16::try_from(texts.len()) {
            keys.push([1026, 34737, length, 0]);
        }
        keys.extend(horizontal.map(|code| match is_geographic {
            true => [2048, 0, 1, code],
            false => [3072, 0, 1, code],
        }));
        keys.extend(vertical.map(|code| [4096, 0, 1, code]));
        let head = [1, 1, 1, keys.len() as u16];
        Self {
            numbers: std::iter::once(head).chain(keys).flatten().collect(),
            texts: if texts.len() > usize::from(u16::MAX) {
                String::new()
            } else {
                texts
            },
            is_known: horizontal.is_some() || system.is_none(),
        }
    }
}
