//! The last stage: the mesh file, the origin of its coordinates, and what is beside it.

use super::super::origin::Steps;
use super::super::{beside, levels, made};
use super::Stages;
use crate::params::Origin;
use outcrop_disk::error::{Error, Result, Setting};
use outcrop_geom::aabb::Aabb;
use outcrop_geom::lattice::{Lattice, Shift};
use outcrop_mesh::repair::Repaired;
use outcrop_mesh_files::cut::StoredPieces;
use outcrop_mesh_files::export::{
    CoordinateType, ExportOptions, SplitOptions, export, export_cut, export_split,
};
use outcrop_ply::Place;
use outcrop_stages::attributes::StoredColumns;
use outcrop_stages::blocks::Blocks;
use outcrop_stages::order::PointStore;

/// The type of coordinates in the mesh.
pub(super) fn written(precision: outcrop_points::CoordinateType) -> CoordinateType {
    match precision {
        outcrop_points::CoordinateType::F32 => CoordinateType::Float,
        outcrop_points::CoordinateType::F64 => CoordinateType::Double,
    }
}

impl Stages<'_> {
    /// Checks a given origin, and says if it is rounded.
    pub(super) fn check_origin(&mut self, lattice: &Lattice) -> Result<()> {
        let Origin::At(to) = self.job.params.origin else {
            return Ok(());
        };
        let coarse = self.coarse;
        let [x, y, z] = Steps { lattice, coarse }.given(to)?.origin;
        if [x, y, z] != to {
            let option = self.job.observer.spell(&Setting::Option("origin"));
            self.warn(format!(
                "{option}: {x},{y},{z} is used, the nearest position on the lattice of steps of {coarse}"
            ));
        }
        Ok(())
    }

    /// The origin of the coordinates in a mesh of points with these bounds, if it is not that of the cloud, and
    /// their type.
    pub(super) fn shift(
        &self,
        bounds: Aabb,
        lattice: &Lattice,
    ) -> Result<(Option<Shift>, CoordinateType)> {
        let coarse = self.coarse;
        let steps = Steps { lattice, coarse };
        let of_cloud = self.report.coordinates;
        let shift = match self.job.params.origin {
            Origin::Auto if of_cloud == CoordinateType::Double => steps.automatic(bounds),
            Origin::Auto | Origin::None => None,
            Origin::At(to) => Some(steps.given(to)?),
        };
        let of_mesh = shift.map(|shift| written(steps.precision(&shift, bounds)));
        Ok((shift, of_mesh.unwrap_or(of_cloud)))
    }

    /// The comments of the mesh.
    fn comments(&self) -> Vec<String> {
        let step = (!self.is_smoothed()).then_some(self.coarse);
        let place = self.report.origin.map(|origin| Place::new(origin, step));
        let mut comments = place.map_or_else(Vec::new, |place| place.comments());
        if let Some(crs) = &self.report.input.crs {
            comments.extend(crs.comments().comments());
        }
        comments
    }

    /// Writes the mesh.
    pub fn export(
        &mut self,
        store: &PointStore,
        columns: Option<&StoredColumns>,
        repaired: &Repaired,
        pieces: Option<&StoredPieces>,
        blocks: Blocks,
        lattice: &Lattice,
    ) -> Result<()> {
        let (job, workspace) = (self.job, self.workspace);
        let (shift, coordinates) = self.shift(store.bounds(), lattice)?;
        self.report.coordinates = coordinates;
        self.report.origin = shift.map(|shift| shift.origin);
        let options = ExportOptions {
            output: &job.mesh,
            coordinates: self.report.coordinates,
            comments: self.comments(),
            origin: shift,
            columns,
            normals: job.params.normals,
            decimals: self.known.text.map_or(0, |text| text.decimals),
            compress: job.params.compress_glb,
        };
        let items = match pieces {
            Some(pieces) => pieces.count() as u64,
            None => 2 * blocks.count() as u64,
        };
        let write = || match pieces {
            Some(pieces) => match job.params.split {
                Some(side) => {
                    let split = SplitOptions { side };
                    export_split(store, pieces, lattice, split, options, workspace)
                }
                None => export_cut(store, pieces, lattice, options, workspace),
            },
            None => export(store, repaired, blocks, lattice, options, workspace),
        };
        self.report.mesh = self.clock.stage("export", "blocks", items, write)?;
        columns.map_or(Ok(()), |columns| columns.release(workspace))?;
        let wkt = self.wkt.as_deref();
        let mesh = job.made.as_ref().unwrap_or(&job.mesh);
        let warnings = beside::write(mesh, &job.inputs, &self.report, wkt)?;
        warnings.into_iter().for_each(|warning| self.warn(warning));
        Ok(())
    }

    /// The mesh that is made of the whole one, with fewer triangles or closed, if it is wanted.
    pub fn make_of_whole(&mut self) -> Result<()> {
        let (job, workspace) = (self.job, self.workspace);
        let Some(output) = &job.made else {
            return Ok(());
        };
        workspace.trim();
        let triangles = self.report.mesh.triangles;
        if let Some(wanted) = job.params.triangles {
            let how = (wanted, job.params.close);
            let wrong =
                |e: serde_json::Error| Error::io(&job.folder, "keep the report in", e.into());
            // The journal has no structs within structs without names, so it is kept as JSON.
            let make = || {
                let made = made::simplify(&job.mesh, output, how, workspace)?;
                serde_json::to_string(&made).map_err(wrong)
            };
            let made = self.clock.stage("simplify", "triangles", triangles, make)?;
            self.report.simplified = Some(serde_json::from_str(&made).map_err(wrong)?);
        } else if let Some(kind) = job.params.close {
            let make = || made::close(&job.mesh, output, kind, workspace);
            self.report.closed = Some(self.clock.stage("close", "triangles", triangles, make)?);
        }
        Ok(())
    }

    /// Sends the output to a store, if it is behind a URL.
    pub fn deliver(&mut self) -> Result<()> {
        let (job, workspace) = (self.job, self.workspace);
        let Some(delivery) = &job.delivery else {
            return Ok(());
        };
        workspace.trim();
        let mut warnings = Vec::new();
        let send = || {
            let sent = delivery.send(workspace, &mut |warning| warnings.push(warning))?;
            Ok((sent, std::mem::take(&mut warnings)))
        };
        let bytes = delivery.bytes()?;
        let (sent, warnings) = self.clock.stage("upload", "bytes", bytes, send)?;
        self.report.uploaded = Some(sent);
        warnings.into_iter().for_each(|warning| self.warn(warning));
        Ok(())
    }

    /// Levels of detail of the mesh, if they are wanted.
    pub fn levels(&mut self) -> Result<()> {
        let (job, workspace) = (self.job, self.workspace);
        let Some(folder) = &job.tiles else {
            return Ok(());
        };
        workspace.trim();
        let source = job.inputs.first().and_then(|input| input.file_name());
        let source = source.unwrap_or_default().to_string_lossy();
        let lossy = job.params.lossy;
        let make = || levels::make(&job.mesh, &source, folder, lossy, workspace);
        let triangles = self.report.mesh.triangles;
        self.report.tiles = Some(self.clock.stage("tiles", "triangles", triangles, make)?);
        Ok(())
    }
}
