//! The positions from which the surface is made.

use super::Stages;
use crate::params::Method;
use outcrop_disk::error::Result;
use outcrop_geom::lattice::Lattice;
use outcrop_stages::levels::HeldLevels;
use outcrop_stages::located::Places;
use outcrop_stages::order::PointStore;
use outcrop_stages::outside::Outside;
use outcrop_stages::smooth::Relaxed;
use outcrop_stages::spacing::{Density, Spacings};

/// The positions that decide which points are connected, if they are not those of the mesh, the local spacings,
/// and the noise.
#[derive(Debug, Default)]
pub(in crate::pipeline) struct Shape {
    store: Option<PointStore>,
    pub spacings: Option<Spacings>,
    noise: Option<HeldLevels>,
}

impl Shape {
    /// The positions that decide the connectivity: those of the mesh in `store` if there are no others.
    pub fn or<'a>(&'a self, store: &'a PointStore) -> &'a PointStore {
        self.store.as_ref().unwrap_or(store)
    }
}

impl Stages<'_> {
    /// Opens the shape.
    pub fn open_shape(&self, relaxed: Option<Relaxed>) -> Result<Shape> {
        let workspace = self.workspace;
        let Some(relaxed) = relaxed else {
            return Ok(Shape::default());
        };
        let store = relaxed.store.as_ref();
        let noise = Some(relaxed.noise).filter(|noise| !noise.is_empty());
        let noise = noise.map(|noise| HeldLevels::open(noise, "noise", workspace));
        Ok(Shape {
            store: store.map(|store| store.open(workspace)).transpose()?,
            spacings: Some(relaxed.spacings.open(workspace)?),
            noise: noise.transpose()?,
        })
    }

    /// The positions from which the surface is made.
    pub fn places<'p>(
        &self,
        store: &'p PointStore,
        shape: &'p Shape,
        outside: Option<Outside<'p>>,
        lattice: &Lattice,
    ) -> Places<'p> {
        let params = &self.job.params;
        let spacings = shape.spacings.as_ref();
        let robust = spacings.filter(|_| params.method == Method::Robust);
        let density = robust.map(|spacings| Density {
            spacings,
            noise: shape.noise.as_deref(),
            coarse: None,
            neighbors: params.neighbors,
            limits: params.limits(lattice.step),
        });
        Places::new(store, shape.store.as_ref(), density, outside)
    }
}
