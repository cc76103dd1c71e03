//! What was made, as data and as text.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::PathBuf;

/// Which height a cell has.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Surface {
    /// The highest.
    #[default]
    Highest,
    /// The lowest.
    Lowest,
    /// That of what is classified as ground: of a mesh the highest of the triangles whose corners all are, of a cloud
    /// the mean of the points that are.
    GroundClass,
}

/// What a raster was made of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// The file, or the folder.
    pub path: PathBuf,
    /// Triangles of a mesh.
    pub triangles: Option<u64>,
    /// Points of a cloud that were read.
    pub points: Option<u64>,
    /// The reference system, by its codes or its name; none if the file tells none.
    pub system: Option<String>,
}

/// Contours that were written.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Contours {
    /// The file.
    pub path: PathBuf,
    /// Height between two levels; a multiple of it is the height of each line.
    pub interval: f64,
    /// Number of lines.
    pub lines: u64,
    /// Positions of all lines.
    pub positions: u64,
    /// Size of the file.
    pub bytes: u64,
}

/// A raster that was written. Lengths are in the units of the coordinates.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Raster {
    /// What it was made of.
    pub source: Source,
    /// The file.
    pub path: PathBuf,
    /// Its size.
    pub bytes: u64,
    /// Which heights the cells have.
    pub surface: Surface,
    /// Length of the sides of a cell.
    pub cell: f64,
    /// Cells from west to east.
    pub columns: u32,
    /// Cells from north to south.
    pub rows: u32,
    /// The south-western corner.
    pub min: [f64; 2],
    /// The north-eastern corner.
    pub max: [f64; 2],
    /// Cells with a height.
    pub cells: u64,
    /// The lowest height.
    pub lowest: f32,
    /// The highest height.
    pub highest: f32,
    /// The number that stands for no height.
    pub nothing: f32,
    /// Rasters of fewer cells in the file.
    pub overviews: usize,
    /// The orthophoto.
    pub orthophoto: Option<PathBuf>,
    /// Its size.
    pub orthophoto_bytes: Option<u64>,
    /// The contours.
    pub contours: Option<Contours>,
}

impl fmt::Display for Raster {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all = u64::from(self.columns) * u64::from(self.rows);
        let share = self.cells as f64 / all as f64 * 100.0;
        writeln!(
            f,
            "{}: {} × {} cells of {}, heights from {} to {}",
            self.path.display(),
            self.columns,
            self.rows,
            self.cell,
            self.lowest,
            self.highest
        )?;
        write!(
            f,
            "{share:.1} % of the cells have a height; {} stands for none",
            self.nothing
        )?;
        if self.source.system.is_none() {
            write!(
                f,
                "\nno reference system is known: coordinates are those of {}",
                self.source.path.display()
            )?;
        }
        if let Some(path) = &self.orthophoto {
            write!(f, "\n{}: colours of the same cells", path.display())?;
        }
        if let Some(contours) = &self.contours {
            let [path, interval] = [
                contours.path.display().to_string(),
                contours.interval.to_string(),
            ];
            write!(f, "\n{path}: {} contours, every {interval}", contours.lines)?;
        }
        Ok(())
    }
}
