//! Heights of a cloud: those of its points, in the cells in which they are.

use super::mesh::{Columns, GROUND};
use super::samples::{BATCH, BATCH_BYTES, Sample, Samples};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_geom::lattice::Lattice;
use outcrop_geom::region::Region;
use outcrop_points::{
    Attributes, Carried, Classes, Crop, Ingest, IngestStats, Selection, Spool, VALUE_BUFFERS,
};
use std::path::Path;

/// A cloud that was read.
pub(super) struct Cloud {
    spool: Spool,
    lattice: Lattice,
    carried: Carried,
    /// Lowest and highest coordinates.
    pub bounds: [[f64; 3]; 2],
}

impl Cloud {
    /// Reads a file, or the files of a folder.
    pub fn read(
        path: &Path,
        columns: Columns,
        region: Option<(&Region, f64)>,
        ingest: Ingest,
        workspace: &Workspace,
    ) -> Result<Self> {
        let names = columns.names().iter().map(|name| (*name).to_owned());
        let attributes = match columns {
            Columns::None => Attributes::None,
            _ => Attributes::List(names.collect()),
        };
        let classes = match columns {
            Columns::Ground => Classes::Keep(vec![GROUND]),
            _ => Classes::All,
        };
        let selection = Selection {
            classes,
            crop: region.map(|(region, margin)| Crop {
                region: region.clone(),
                margin,
            }),
            attributes: attributes.clone(),
            ..Selection::default()
        };
        let observer = &workspace.observer;
        observer.begin("read cloud", "points", 0);
        let spool = ingest(&[path.to_path_buf()], &selection, workspace)?;
        observer.end();
        let stats = spool.stats();
        stats.warnings.iter().for_each(|line| observer.warn(line));
        if stats.kept == 0 {
            let (found, expected) = match (stats.read, stats.dropped_by_class) {
                (0, _) => ("none".to_owned(), "one or more"),
                (n, 1..) => (format!("none of {n} of class 2, ground"), "another surface"),
                (n, 0) => (format!("none of {n} usable"), "one or more"),
            };
            return Err(Error::input(path, "points", found, expected));
        }
        let lattice = spool.choose_lattice(0)?;
        let carried = match columns {
            Columns::Colours => spool.carried(&attributes, false),
            _ => Carried::default(),
        };
        let mut cloud = Self {
            bounds: [[0.0; 3]; 2],
            spool,
            lattice,
            carried,
        };
        cloud.bounds = cloud.measure(workspace)?;
        Ok(cloud)
    }

    /// The file of the points, which is to be deleted when they are sampled.
    pub fn into_spool(self) -> Spool {
        self.spool
    }

    pub fn stats(&self) -> &IngestStats {
        self.spool.stats()
    }

    /// The box around all points.
    fn measure(&self, workspace: &Workspace) -> Result<[[f64; 3]; 2]> {
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        let _held = workspace.reserve("raster: points", VALUE_BUFFERS)?;
        self.spool.for_each(workspace, &self.lattice, |points| {
            for point in points {
                let at = self.lattice.position(*point);
                bounds[0] = [0, 1, 2].map(|k| bounds[0][k].min(at[k]));
                bounds[1] = [0, 1, 2].map(|k| bounds[1][k].max(at[k]));
            }
            Ok(())
        })?;
        Ok(bounds)
    }

    /// Samples all points.
    pub fn sample(&self, samples: &Samples<'_>, workspace: &Workspace) -> Result<()> {
        let frames = self.spool.frames();
        let total = frames.iter().map(|(_, points)| points).sum();
        let size = VALUE_BUFFERS + 2 * BATCH_BYTES;
        workspace.observer.begin("sample points", "points", total);
        workspace.for_each_unit(
            "raster: points",
            frames.len(),
            |_| size,
            |unit| {
                let _held = unit.hold(size);
                let (frame, points) = frames[unit.number()];
                self.sample_frame(frame, samples, workspace)?;
                unit.advance(points);
                Ok(())
            },
        )?;
        workspace.observer.end();
        Ok(())
    }

    fn sample_frame(&self, frame: u32, samples: &Samples<'_>, workspace: &Workspace) -> Result<()> {
        let mut batch = Vec::with_capacity(BATCH);
        let width = self.carried.bytes();
        let each = |points: &[_], rows: &[u8]| {
            for (number, point) in points.iter().enumerate() {
                let [x, y, z] = self.lattice.position(*point);
                let colour = match rows.get(number * width..(number + 1) * width) {
                    Some([red, green, blue]) => Sample::colour([*red, *green, *blue]),
                    _ => 0,
                };
                batch.extend(samples.of(samples.grid.place([x, y]), z, colour));
                if batch.len() >= BATCH {
                    samples.take(&mut batch)?;
                }
            }
            Ok(())
        };
        let lattice = &self.lattice;
        match width {
            0 => self
                .spool
                .par_for_frames(workspace, 1, lattice, &[frame], {
                    let each = std::sync::Mutex::new(each);
                    move |points| outcrop_disk::workspace::lock(&each)(points, &[])
                })?,
            _ => self
                .spool
                .for_values(workspace, lattice, &[frame], &self.carried, each)?,
        }
        samples.take(&mut batch)
    }
}
