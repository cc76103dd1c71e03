//! Areas of change as a table, or as polygons for a map: one box around each, in the coordinates of the files.

use super::new_file::NewFile;
use outcrop_disk::error::{Error, Result};
use outcrop_inspect::change::{Area, Change};
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::Path;

/// A file that will be written.
pub struct File<'a> {
    file: NewFile<'a>,
    is_table: bool,
}

impl<'a> File<'a> {
    /// Makes sure that the file can be written.
    pub fn new(path: &'a Path) -> Result<Self> {
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        let is_table = match extension.to_str() {
            Some("csv") => true,
            Some("geojson" | "json") => false,
            _ => {
                return Err(Error::Parameter {
                    name: "areas",
                    found: path.display().to_string(),
                    expected: "a name that ends with .csv or .geojson".into(),
                });
            }
        };
        Ok(Self {
            file: NewFile::open(path)?,
            is_table,
        })
    }

    /// Writes it.
    pub fn write(self, change: &Change) -> Result<()> {
        let areas = &change.areas;
        let text = match self.is_table {
            true => table(areas),
            false => polygons(areas).to_string() + "\n",
        };
        self.file.write(&text)
    }
}

const HEAD: &str = "vertices,area,gained,lost,largest,x,y,z,min_x,min_y,min_z,max_x,max_y,max_z\n";

fn table(areas: &[Area]) -> String {
    let mut text = HEAD.to_owned();
    for area in areas {
        let largest = area.largest.unwrap_or(f64::NAN);
        let sizes = [area.area, area.gained, area.lost, largest];
        let places = [area.largest_at, area.min, area.max];
        let numbers = sizes.iter().chain(places.as_flattened());
        let _ = write!(text, "{}", area.vertices);
        numbers.for_each(|number| _ = write!(text, ",{number}"));
        text.push('\n');
    }
    text
}

fn polygons(areas: &[Area]) -> Value {
    let polygon = |area: &Area| {
        let ([x0, y0, _], [x1, y1, _]) = (area.min, area.max);
        let ring = [[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]];
        json!({
            "type": "Feature",
            "geometry": { "type": "Polygon", "coordinates": [ring] },
            "properties": area,
        })
    };
    let features: Vec<_> = areas.iter().map(polygon).collect();
    json!({ "type": "FeatureCollection", "features": features })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_area_is_a_line_and_a_polygon() {
        let area = Area {
            vertices: 40,
            area: 12.5,
            gained: 3.0,
            lost: 0.0,
            largest: Some(0.5),
            largest_at: [1.0, 2.0, 3.0],
            min: [0.0; 3],
            max: [4.0, 5.0, 6.0],
        };
        let text = table(&[area]);
        assert_eq!(
            text.lines().nth(1),
            Some("40,12.5,3,0,0.5,1,2,3,0,0,0,4,5,6")
        );
        assert_eq!(
            text.lines().next().map(|head| head.split(',').count()),
            Some(14)
        );
        let feature = &polygons(&[area])["features"][0];
        assert_eq!(feature["geometry"]["coordinates"][0][2], json!([4.0, 5.0]));
        assert_eq!(feature["properties"]["gained"], 3.0);
    }
}
