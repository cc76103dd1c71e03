//! Scenes with a known surface as virtual scanners measure them, and other clouds whose meshes are known.
//!
//! A scanner casts rays at the triangles of a scene: what stands behind something is not measured. Range
//! noise grows with the range, scans do not fit together exactly, and at depth edges a share of the points
//! lies between near and far.

mod bodies;
mod boxes;
mod sampled;
mod scanner;
mod views;
mod worlds;

use crate::cloud::Cloud;
use crate::error::{Error, Result};
use crate::kind::Kind;
use crate::mesh_file;
use crate::rng::{Purpose, Rng};
use crate::surface::{Bumpy, Mesh, Surface, Tessellation};
use crate::vec3::{Vec3, scale};

/// Most points of a scene: all are held in memory.
pub const MOST_IN_SCENE: u64 = 20_000_000;

/// Fraction of the size within which a curved body is divided into triangles.
const TOLERANCE: f64 = 2e-4;

/// What is measured, and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Scene {
    /// The smooth body of genus 5, or a mesh, from scanners all around.
    BodyScan,
    /// A body with sharp edges, straight, round and re-entrant, from scanners all around.
    EdgedScan,
    /// A plate with thin fins, from scanners all around.
    FinsScan,
    /// A furnished room, from three stands inside.
    RoomScan,
    /// A street with façades, windows, signs, lamp posts, cars and benches, from three stands.
    StreetScan,
    /// The same street by a scanner on a car: dense lines, far apart.
    MobileScan,
    /// Hills with houses and walls from the air, in two swaths that cross.
    AirScan,
    /// A body on rough ground from photographs: noise that is alike in the neighbourhood, uneven density,
    /// places without points, one outlier in a hundred.
    Photo,
    /// A uniform sample of the body with sharp edges, or of a mesh.
    Edged,
    /// A sheet with a square in the middle that is denser by a ratio.
    DensityJump,
    /// A uniform sample of a plate whose thickness is given in spacings.
    ThinPlate,
    /// Integer places on the faces of a slab, its thickness given in steps.
    VoxelSlab,
    /// Integer places on the faces of a cube.
    VoxelCube,
    /// A round body whose bottom is sparser by a ratio.
    SparseCap,
    /// Two squares, one above the other by a distance in spacings.
    TwoSquares,
    /// The smooth body with outliers, the given per cent of its points; half of them are near it.
    Strewn,
}

/// How a scene is measured. Lengths are in spacings: the median root of the area for each point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measuring {
    /// Standard deviation of noise: along the ray at the mean range, growing with the range; in all
    /// directions where there is no scanner.
    pub noise: f64,
    /// How far scans are from fitting together: the root of the mean square.
    pub registration: f64,
    /// Share of points that lie between near and far at depth edges.
    pub flying: f64,
    /// Ratio, thickness or distance of the scenes that have one; None for the default.
    pub ratio: Option<f64>,
}

impl Measuring {
    /// Exact measurements.
    pub const EXACT: Measuring = Measuring {
        noise: 0.0,
        registration: 0.0,
        flying: 0.0,
        ratio: None,
    };
}

impl Default for Measuring {
    fn default() -> Self {
        Measuring::EXACT
    }
}

impl Scene {
    /// All of them.
    pub const ALL: [Scene; 16] = [
        Scene::BodyScan,
        Scene::EdgedScan,
        Scene::FinsScan,
        Scene::RoomScan,
        Scene::StreetScan,
        Scene::MobileScan,
        Scene::AirScan,
        Scene::Photo,
        Scene::Edged,
        Scene::DensityJump,
        Scene::ThinPlate,
        Scene::VoxelSlab,
        Scene::VoxelCube,
        Scene::SparseCap,
        Scene::TwoSquares,
        Scene::Strewn,
    ];

    /// Name as on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Scene::BodyScan => "body-scan",
            Scene::EdgedScan => "edged-scan",
            Scene::FinsScan => "fins-scan",
            Scene::RoomScan => "room-scan",
            Scene::StreetScan => "street-scan",
            Scene::MobileScan => "mobile-scan",
            Scene::AirScan => "air-scan",
            Scene::Photo => "photo",
            Scene::Edged => "edged",
            Scene::DensityJump => "density-jump",
            Scene::ThinPlate => "thin-plate",
            Scene::VoxelSlab => "voxel-slab",
            Scene::VoxelCube => "voxel-cube",
            Scene::SparseCap => "sparse-cap",
            Scene::TwoSquares => "two-squares",
            Scene::Strewn => "strewn",
        }
    }

    /// Euler characteristic of the surface if it is one that is closed.
    pub fn euler_characteristic(self) -> Option<i64> {
        match self {
            Scene::BodyScan | Scene::Strewn => Some(-8),
            Scene::EdgedScan
            | Scene::FinsScan
            | Scene::Edged
            | Scene::ThinPlate
            | Scene::VoxelSlab
            | Scene::VoxelCube
            | Scene::SparseCap => Some(2),
            _ => None,
        }
    }

    /// True if the density is uneven by the way of measuring: spacings are then local ones.
    pub fn is_uneven(self) -> bool {
        use Scene::{DensityJump, MobileScan, Photo, RoomScan, SparseCap, StreetScan};
        let uneven = [
            DensityJump,
            MobileScan,
            Photo,
            RoomScan,
            SparseCap,
            StreetScan,
        ];
        uneven.contains(&self)
    }

    /// True if a mesh may take the place of the surface.
    pub(crate) fn takes_mesh(self) -> bool {
        matches!(self, Scene::BodyScan | Scene::Edged)
    }

    /// Values that the ratio may have, and the default; none if there is no ratio.
    pub(crate) fn ratio(self) -> Option<(f64, f64, f64)> {
        Some(match self {
            Scene::DensityJump => (1.0, 100.0, 7.0),
            Scene::ThinPlate => (0.1, 1000.0, 2.5),
            Scene::VoxelSlab => (1.0, 1000.0, 2.0),
            Scene::SparseCap => (1.0, 100.0, 5.0),
            Scene::TwoSquares => (0.1, 1000.0, 3.0),
            Scene::Strewn => (0.0, 50.0, 1.0),
            _ => return None,
        })
    }
}

/// A point of a scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Measured {
    /// The place on the surface that was measured.
    pub(crate) place: Vec3,
    /// The normal of the surface there.
    pub(crate) normal: Vec3,
    /// From that place to the point.
    pub(crate) error: Vec3,
    /// False for what is no measurement of the surface: outliers and points between near and far.
    pub(crate) real: bool,
}

/// A scene and its points.
#[derive(Debug)]
pub(crate) struct Made {
    pub(crate) points: Vec<Measured>,
    pub(crate) truth: Tessellation,
}

/// Makes the points of a scene and its surface.
pub(crate) fn make(cloud: &Cloud, scene: Scene) -> Result<Made> {
    if cloud.points > MOST_IN_SCENE {
        let expected = format!("at most {MOST_IN_SCENE} for a scene");
        return Err(Error::parameter("points", cloud.points, expected));
    }
    let task = Task::new(cloud, scene);
    let truth = surface(cloud, scene, &task)?;
    let points = match scene {
        _ if cloud.points == 0 => Vec::new(),
        Scene::BodyScan | Scene::EdgedScan | Scene::FinsScan => views::around(&truth, &task),
        Scene::RoomScan => views::from_stands(&truth, &views::ROOM, &task),
        Scene::StreetScan => views::from_stands(&truth, &views::STREET, &task),
        Scene::MobileScan => views::from_car(&truth, &task),
        Scene::AirScan => views::from_air(&truth, &task),
        Scene::Photo => views::photographed(&truth, &task),
        Scene::VoxelSlab | Scene::VoxelCube => sampled::lattice(&truth, &task),
        Scene::DensityJump => sampled::sample(&truth, &task, sampled::jump(task.ratio)),
        Scene::SparseCap => sampled::sample(&truth, &task, sampled::cap(task.ratio)),
        Scene::Strewn => sampled::strewn(&truth, &task),
        Scene::Edged | Scene::ThinPlate | Scene::TwoSquares => {
            sampled::sample(&truth, &task, |_| 1.0)
        }
    };
    Ok(Made { points, truth })
}

/// The surface of a scene.
pub(crate) fn truth(cloud: &Cloud, scene: Scene) -> Result<Tessellation> {
    surface(cloud, scene, &Task::new(cloud, scene))
}

fn surface(cloud: &Cloud, scene: Scene, task: &Task) -> Result<Tessellation> {
    if let (Some(path), true) = (&cloud.mesh, scene.takes_mesh()) {
        let mesh = Mesh::new(&mesh_file::read(path)?, cloud.size, path)?;
        return Ok(mesh.reference(0.0));
    }
    let bumpy = || Bumpy::new(cloud.size).reference(TOLERANCE * cloud.size);
    Ok(match scene {
        Scene::BodyScan | Scene::Strewn => bumpy(),
        Scene::EdgedScan | Scene::Edged => worlds::edged(),
        Scene::FinsScan => worlds::fins(),
        Scene::RoomScan => worlds::room(),
        Scene::StreetScan => worlds::street(40.0),
        Scene::MobileScan => worlds::street(20.0),
        Scene::AirScan => worlds::land(task.seed),
        Scene::Photo => worlds::statue(),
        Scene::DensityJump => worlds::sheet(),
        Scene::ThinPlate => worlds::plate(task),
        Scene::VoxelSlab => worlds::slab(task, task.ratio.round()),
        Scene::VoxelCube => worlds::cube(task),
        Scene::SparseCap => worlds::bust(),
        Scene::TwoSquares => worlds::squares(task),
    })
}

/// What the makers of scenes need to know.
#[derive(Clone, Copy, Debug)]
struct Task {
    /// Wanted number of points.
    points: usize,
    seed: u64,
    measuring: Measuring,
    ratio: f64,
}

impl Task {
    fn new(cloud: &Cloud, scene: Scene) -> Self {
        let usual = scene.ratio().map_or(1.0, |ratio| ratio.2);
        Task {
            points: cloud.points as usize,
            seed: cloud.seed,
            measuring: cloud.measuring,
            ratio: cloud.measuring.ratio.unwrap_or(usual),
        }
    }

    /// The random numbers of point or ray `index`.
    fn random(&self, purpose: Purpose, index: usize) -> Rng {
        Rng::at(self.seed, purpose, index as u64)
    }

    /// Noise of one point in all directions, of a standard deviation.
    fn shake(&self, index: usize, deviation: f64) -> Vec3 {
        let mut rng = self.random(Purpose::Noise, index);
        scale([(); 3].map(|()| rng.normal()), deviation)
    }
}

impl From<Scene> for Kind {
    fn from(scene: Scene) -> Kind {
        Kind::Scene(scene)
    }
}
