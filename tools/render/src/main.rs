//! Draws a PLY mesh or cloud into a PNG. Front faces are warm grey and back faces blue, so that
//! turned triangles stand out.

mod edges;
mod error;
mod scene;
mod shade;

use std::{path::PathBuf, process::ExitCode};

use clap::Parser;
use error::{Error, Result};
use outcrop_raster::vec3::{cross, dot, sub};
use outcrop_raster::{Camera, Framing, Mark, Raster, Vec3, View, picture};
use scene::Scene;
use shade::{Shader, value_of};

/// Draws a PLY mesh or cloud into a PNG. Front faces (counter-clockwise) are warm grey, back faces
/// blue; points are coloured by height.
#[derive(Debug, Parser)]
#[command(name = "render", version, allow_negative_numbers = true)]
struct Args {
    /// PLY file, binary or ASCII
    input: PathBuf,

    /// PNG file to write
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    /// Width in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 1200)]
    width: usize,

    /// Height in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 900)]
    height: usize,

    /// iso, top, front, side or AZIMUTH,ELEVATION of the viewer in degrees
    #[arg(
        long,
        value_name = "VIEW",
        default_value = "iso",
        allow_hyphen_values = true
    )]
    view: View,

    /// Magnification
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    zoom: f64,

    /// Point at the centre of the image, X,Y,Z or auto
    #[arg(long, value_name = "POINT", default_value = "auto", allow_hyphen_values = true,
          value_parser = parse_centre)]
    center: Centre,

    /// Draw at this many times the resolution and average
    #[arg(long, value_name = "N", default_value_t = 2)]
    supersample: usize,

    /// Leave out this percentage of coordinates at either end when fitting, so that outliers do not shrink
    /// the object; 0 fits all points
    #[arg(long, value_name = "PERCENT", default_value_t = 1.0)]
    crop_percentile: f64,

    /// Draw boundary edges in red and edges with more than two triangles in magenta
    #[arg(long)]
    edges: bool,

    /// Draw the edges of all triangles
    #[arg(long)]
    wire: bool,

    /// Draw vertices in their own colours, if the file has any: triangles in the mean of their corners
    #[arg(long)]
    colors: bool,

    /// Leave out back faces, e.g. to look into a room
    #[arg(long)]
    cull: bool,

    /// Size of points in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 1.5)]
    point_size: f64,
}

/// Centre of the image; None for the centre of the scene.
#[derive(Clone, Copy, Debug)]
struct Centre(Option<Vec3>);

fn parse_centre(text: &str) -> Result<Centre, String> {
    if text == "auto" {
        return Ok(Centre(None));
    }
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, z]) if [x, y, z].iter().all(|c| c.is_finite()) => Ok(Centre(Some([x, y, z]))),
        _ => Err("expected auto or three numbers separated by commas".to_owned()),
    }
}

/// Largest number of pixels of the raster, at some twelve bytes each.
const PIXEL_LIMIT: usize = 1 << 28;

fn check(args: &Args) -> Result<()> {
    for (name, value) in [
        ("width", args.width),
        ("height", args.height),
        ("supersample", args.supersample),
    ] {
        if !(1..=1 << 16).contains(&value) {
            return Err(Error::parameter(name, value, "1 to 65536"));
        }
    }
    let pixels = (args.width * args.height).saturating_mul(args.supersample * args.supersample);
    if pixels > PIXEL_LIMIT {
        return Err(Error::parameter(
            "width",
            args.width,
            "at most 2^28 pixels in all",
        ));
    }
    if !(1e-9..1e9).contains(&args.zoom) {
        return Err(Error::parameter("zoom", args.zoom, "a positive number"));
    }
    if !(0.0..50.0).contains(&args.crop_percentile) {
        return Err(Error::parameter(
            "crop-percentile",
            args.crop_percentile,
            "0 to below 50",
        ));
    }
    if !(0.1..=1000.0).contains(&args.point_size) {
        return Err(Error::parameter(
            "point-size",
            args.point_size,
            "0.1 to 1000",
        ));
    }
    Ok(())
}

fn run(args: &Args) -> Result<()> {
    check(args)?;
    let mut mesh = scene::read(&args.input)?;
    if !args.colors {
        mesh.colors.clear();
    }
    let factor = args.supersample;
    let framing = Framing {
        size: [args.width * factor, args.height * factor],
        zoom: args.zoom,
        centre: args.center.0.map(|centre| sub(centre, mesh.origin)),
        crop: args.crop_percentile,
    };
    let camera = Camera::new(args.view, framing, &mesh.positions);
    let raster = Raster::new(framing.size[0], framing.size[1]);
    if mesh.triangles.is_empty() {
        let size = (args.point_size * factor as f64).max(1.0);
        for (number, &p) in mesh.positions.iter().enumerate() {
            raster.point(camera.project(p), size, value_of(number as u32));
        }
        println!("{} points", mesh.positions.len());
    } else {
        triangles(&mesh, &camera, &raster, args.cull);
        println!(
            "{} vertices, {} triangles",
            mesh.positions.len(),
            mesh.triangles.len()
        );
        overlay(args, &mesh, &camera, &raster);
    }
    let image = Shader::new(&mesh, &camera, &raster).image(&raster, factor);
    let png = picture::png(args.width as u32, args.height as u32, &image, true);
    let png =
        png.map_err(|why| Error::io(&args.output, "make the PNG", std::io::Error::other(why)))?;
    std::fs::write(&args.output, png).map_err(|e| Error::io(&args.output, "write", e))
}

/// Draws all triangles; with `cull` only those that face the viewer.
fn triangles(mesh: &Scene, camera: &Camera, raster: &Raster, cull: bool) {
    for (number, triangle) in mesh.triangles.iter().enumerate() {
        let corners = triangle.map(|v| mesh.positions[v as usize]);
        let [a, b, c] = corners;
        if cull && dot(cross(sub(b, a), sub(c, a)), camera.towards) <= 0.0 {
            continue;
        }
        raster.triangle(corners.map(|p| camera.project(p)), || {
            value_of(number as u32)
        });
    }
}

/// Draws wires and special edges.
fn overlay(args: &Args, mesh: &Scene, camera: &Camera, raster: &Raster) {
    let factor = args.supersample as f64;
    let line = |[a, b]: [u32; 2], mark: Mark, thickness: f64| {
        let ends = [a, b].map(|v| mesh.positions[v as usize]);
        raster.line(camera, ends, mark, thickness);
    };
    if args.wire {
        for &[a, b, c] in &mesh.triangles {
            for side in [[a, b], [b, c], [c, a]] {
                line(side, Mark::Wire, 1.0);
            }
        }
    }
    if args.edges {
        let edges = edges::find(mesh.positions.len(), &mesh.triangles);
        println!(
            "{} boundary edges, {} non-manifold edges",
            edges.boundary.len(),
            edges.non_manifold.len()
        );
        edges
            .boundary
            .iter()
            .for_each(|&edge| line(edge, Mark::Boundary, 1.5 * factor));
        edges
            .non_manifold
            .iter()
            .for_each(|&edge| line(edge, Mark::NonManifold, 2.5 * factor));
    }
}

fn main() -> ExitCode {
    outcrop_command::main(run)
}
