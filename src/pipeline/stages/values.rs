//! The stage of values by id: columns of the mesh, the scanners that saw the points, and their normals.

use super::{Divided, Stages};
use crate::params::{InputNormals, Method};
use crate::report::NormalsReport;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_geom::lattice::Lattice;
use outcrop_points::{Carried, Spool};
use outcrop_stages::attributes::{StoredAttributes, StoredColumns, attributes};
use outcrop_stages::blocks::Blocks;
use outcrop_stages::cells::{DiskStats, InputDirections};
use outcrop_stages::normals::{Normals, look};
use outcrop_stages::outside::Told;
use outcrop_stages::scanners::{self, Scanners};

/// The values of the points.
#[derive(Debug, Default)]
pub(in crate::pipeline) struct Values {
    stored: StoredAttributes,
    /// The places of the scanners in the order of their numbers.
    places: Vec<Option<[i64; 3]>>,
    /// The blocks of the ids.
    blocks: Option<Blocks>,
    /// True if the normals tell which side is out.
    oriented: bool,
}

impl Values {
    /// The columns, if the mesh keeps any.
    pub fn columns(&self) -> Option<&StoredColumns> {
        self.stored.columns.as_ref()
    }

    /// Adds columns that are not in the files.
    pub fn append(&mut self, more: StoredColumns) {
        let columns = self.stored.columns.get_or_insert_default();
        columns.append(more);
    }

    /// What tells of single points which side is out.
    pub fn told(&self) -> Told<'_> {
        let scanners = self.stored.scanners.as_ref();
        Told {
            normals: self.normals().filter(|_| self.oriented),
            scanners: scanners.map(|stored| Scanners::new(stored, &self.places)),
        }
    }

    /// The normals that the points bring, if they are used.
    fn normals(&self) -> Option<Normals<'_>> {
        let stored = self.stored.normals.as_ref()?;
        Some(Normals::new(stored, self.blocks?))
    }

    /// The normals that the points bring, and their use for the disks.
    pub fn directions(&self, wanted: InputNormals) -> Option<InputDirections<'_>> {
        let normals = self.normals();
        normals.map(|normals| InputDirections { normals, wanted })
    }

    /// Deletes the files of the scanners and normals.
    pub fn release_told(&self, workspace: &Workspace) -> Result<()> {
        let StoredAttributes {
            scanners, normals, ..
        } = &self.stored;
        scanners.as_ref().map_or(Ok(()), |s| s.release(workspace))?;
        normals.as_ref().map_or(Ok(()), |n| n.release(workspace))
    }
}

impl Stages<'_> {
    /// The values that the points keep.
    pub(super) fn carry(&self, spool: &Spool) -> Carried {
        let params = &self.job.params;
        let mut carried = spool.carried(&params.attributes, params.wide_colors);
        if params.scanners() {
            carried = spool.with_scanners(carried);
        }
        if params.input_normals != InputNormals::Ignore {
            carried = spool.with_normals(carried);
        }
        carried
    }

    /// The values of the points that remain, if any are needed.
    pub fn values(
        &mut self,
        spool: Option<Spool>,
        lattice: &Lattice,
        divided: &Divided,
    ) -> Result<Values> {
        let (store, blocks) = (&divided.points, divided.blocks);
        let Some(spool) = spool else {
            return Ok(Values::default());
        };
        let positions = self.carried.scanners().to_vec();
        let place = |position: &[f64; 3]| scanners::place(*position, lattice, store.bounds());
        let places: Vec<_> = positions.iter().map(place).collect();
        let real = positions.iter().zip(&places);
        let real = real.filter_map(|(position, place)| place.and(Some(*position)));
        self.report.scanners = real.collect();
        let unreal = positions.len() - self.report.scanners.len();
        if unreal > 0 {
            self.warn(format!(
                "{unreal} of {} positions of scanners are not used: they are too far from all points",
                positions.len()
            ));
        }
        if self.report.scanners.is_empty() {
            self.carried.drop_scanners();
        }
        let (workspace, carried) = (self.workspace, &self.carried);
        let names = spool.normal_names().filter(|_| carried.has_normals());
        if carried.is_empty() {
            spool.release(workspace)?;
            return Ok(Values {
                places,
                ..Values::default()
            });
        }
        let points = spool.points();
        let (stored, normals) = self.clock.stage("attributes", "points", points, || {
            let stored = attributes(spool, lattice, carried, store, blocks, workspace)?;
            let normals = match (&stored.normals, names) {
                (Some(of), Some(names)) => {
                    let normals = Normals::new(of, blocks);
                    let store = store.open(workspace)?;
                    Some(look(normals, &store, names.into(), workspace)?)
                }
                _ => None,
            };
            Ok((stored, normals))
        })?;
        let oriented = normals.as_ref().is_some_and(|normals| normals.oriented);
        self.report.normals = normals.map(|input| NormalsReport {
            input,
            disks: DiskStats::default(),
        });
        Ok(Values {
            stored,
            places,
            blocks: Some(blocks),
            oriented: oriented && self.job.params.method == Method::Robust,
        })
    }
}
