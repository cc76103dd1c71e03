//! Reference systems in the comments of meshes.

use super::crs::{Crs, CrsSource};
use super::given::codes;
use outcrop_ply::System;

impl Crs {
    /// The comments of a mesh that name this system.
    #[must_use]
    pub fn comments(&self) -> System {
        System {
            epsg: self.horizontal,
            crs: Some(self.label()),
            height_unit: self.odd_height_unit(),
        }
    }

    /// The system that comments tell, if they tell one.
    #[must_use]
    pub fn of_comments(system: &System) -> Option<Self> {
        let label = system.crs.as_deref().unwrap_or_default();
        let (plane, heights) = match codes(label) {
            Some((plane, heights)) => (Some(plane), heights),
            None => (None, None),
        };
        let horizontal = system.epsg.or(plane);
        if horizontal.is_none() && label.is_empty() {
            return None;
        }
        let name = if plane.is_some() { "" } else { label };
        let vertical = heights.filter(|_| horizontal == plane);
        let crs = Self {
            height_unit: system.height_unit,
            ..Self::named(name.to_owned(), horizontal, vertical, CrsSource::Comments)
        };
        Some(crs.completed())
    }

    /// True if this is the system, perhaps told otherwise, of which a mesh has these comments.
    #[must_use]
    pub fn agrees(&self, comments: &Self) -> bool {
        match (self.horizontal, comments.horizontal) {
            (Some(_), Some(_)) => !self.differs(comments),
            (None, None) => self.label() == comments.label(),
            _ => false,
        }
    }
}
