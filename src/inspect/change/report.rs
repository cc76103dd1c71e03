//! The sums over all vertices and areas, and their text.

use super::areas::Area;
use crate::compare::Side;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Areas and volumes of change between two surfaces, in square and cubic units of the files.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// The old surface.
    pub old: Side,
    /// The new surface.
    pub new: Side,
    /// Radius of the cylinder.
    pub radius: f64,
    /// The largest change that was looked for.
    pub farthest: f64,
    /// The error of the registration that was given.
    pub registration: f64,
    /// Vertices of the new mesh that were compared.
    pub compared: u64,
    /// Those among them with a significant change.
    pub significant: u64,
    /// Area of the new surface that was compared.
    pub compared_area: f64,
    /// Area with a significant change.
    pub significant_area: f64,
    /// Area of the new surface where the old one is not.
    pub only_new_area: f64,
    /// Area of the old surface where the new one is not; none for a cloud.
    pub only_old_area: Option<f64>,
    /// Volume gained where the change is significant, in cubic units: z is up.
    pub gained: f64,
    /// Volume lost there.
    pub lost: f64,
    /// Connected areas of change, the largest volume first.
    pub areas: Vec<Area>,
    /// Changed vertices in areas of fewer than 30, which are no areas of their own.
    pub small_vertices: u64,
    /// Their surface.
    pub small_area: f64,
    /// The volume gained there.
    pub small_gained: f64,
    /// The volume lost there.
    pub small_lost: f64,
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let share = |part: f64, all: f64| if all > 0.0 { 100.0 * part / all } else { 0.0 };
        writeln!(f, "old          {}", self.old)?;
        writeln!(f, "new          {}", self.new)?;
        writeln!(
            f,
            "cylinder     radius {:.4}, up to {:.4} away; registration error {}",
            self.radius, self.farthest, self.registration
        )?;
        writeln!(
            f,
            "compared     {} vertices, area {:.3}; only new {:.3}, only old {}",
            self.compared,
            self.compared_area,
            self.only_new_area,
            self.only_old_area
                .map_or("not known".to_owned(), |area| format!("{area:.3}"))
        )?;
        writeln!(
            f,
            "significant  {} vertices, area {:.3}, {:.2} %",
            self.significant,
            self.significant_area,
            share(self.significant_area, self.compared_area)
        )?;
        writeln!(
            f,
            "volume       gained {:.4}, lost {:.4}",
            self.gained, self.lost
        )?;
        write!(
            f,
            "areas        {}, and {} vertices in smaller ones",
            self.areas.len(),
            self.small_vertices
        )?;
        for area in self.areas.iter().take(10) {
            let [x, y, z] = area.largest_at;
            let largest = area
                .largest
                .map_or("only new".to_owned(), |l| format!("largest {l:.4}"));
            write!(
                f,
                "\n             area {:.3}, gained {:.4}, lost {:.4}, {largest} at {x} {y} {z}",
                area.area, area.gained, area.lost
            )?;
        }
        Ok(())
    }
}
