//! Command line of the cloud generator.

use std::{
    io::{self, Write},
    path::{Path, PathBuf},
    process::ExitCode,
};

use clap::{Parser, ValueEnum};
use outcrop_cloudgen::{
    Cloud, Error, Format, Kind, LasOptions, Measuring, NoiseMode, Objects, Order, PointFormat,
    Result, Sampling,
};

/// Writes a point cloud with known ground truth. Equal arguments give equal files.
#[derive(Debug, Parser)]
#[command(name = "cloudgen", version, allow_negative_numbers = true)]
struct Args {
    /// Surface: sphere, torus, bumpy (genus 5), terrain, room (genus 4), plane, grid, corner (three
    /// orthogonal plates) or mesh (a file); many surfaces: outdoor (ground with houses, trees and
    /// walls, from 0 to 400 along x and y); without a surface: two-clusters, line-grid, cube-grid,
    /// one-place, few-places, icosahedron, line, volume, powers, dense-in-sparse, scan-line, wheel,
    /// shell or patches; scenes as virtual scanners measure them: body-scan, edged-scan, fins-scan, room-scan,
    /// street-scan, mobile-scan, air-scan or photo; samples whose mesh is known: edged, density-jump,
    /// thin-plate, voxel-slab, voxel-cube, sparse-cap, two-squares or strewn
    kind: Kind,

    /// The mesh to sample, OBJ or PLY, for the kind mesh, and for body-scan and edged if it is given; it is
    /// moved to the origin and scaled to the size
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,

    /// Distribution of the points on the surface; regular and adaptive hold all points in memory (400 bytes
    /// each) and are limited to 10 million
    #[arg(long, value_enum, value_name = "PATTERN", default_value = "uniform")]
    sampling: SamplingArg,

    /// Also write the true surface, as a PLY mesh in the coordinates of the points
    #[arg(long, value_name = "FILE.ply")]
    reference: Option<PathBuf>,

    /// Distance of that mesh from curved surfaces, in units of the size; a millionth takes a million
    /// triangles for a sphere
    #[arg(long, value_name = "FRACTION", default_value_t = 1e-6)]
    reference_tolerance: f64,

    /// Also write the places of the true surface that were measured, without any error, as a PLY cloud with
    /// the normals of the surface
    #[arg(long, value_name = "FILE.ply")]
    seen: Option<PathBuf>,

    /// Number of points; scenes of scanners have about as many, e.g. 1e6, 100k or 10M
    #[arg(short, long, value_name = "N", default_value = "100k", value_parser = parse_count)]
    points: u64,

    /// Output file; its extension selects the format: .las, .laz, .ply, .xyz
    #[arg(
        short,
        long,
        value_name = "FILE",
        required_unless_present = "check_mesh"
    )]
    output: Option<PathBuf>,

    /// Write no cloud, but measure a mesh of the outdoor world with the same seed, trees and offset, a binary
    /// PLY file, and print one line of JSON: the share of the near-horizontal area that faces down, in all
    /// and on open ground (away from houses, trees, walls and the border), boundary edges there, and the area
    /// of triangles there that are more than 1 off the ground
    #[arg(
        long,
        value_name = "FILE.ply",
        conflicts_with_all = ["output", "split", "reference", "seen", "format"]
    )]
    check_mesh: Option<PathBuf>,

    /// Format: las, laz, ply-{le,be,ascii}-{f32,f64} or xyz [default: by extension; .ply is
    /// ply-le-f64]
    #[arg(long, value_name = "NAME")]
    format: Option<Format>,

    /// Seed of all random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,

    /// Diagonal of the bounding box; a grid grows beyond it if unit steps need more
    #[arg(long, value_name = "UNITS", default_value_t = 1000.0)]
    size: f64,

    /// Standard deviation of gaussian noise, in the units of the coordinates
    #[arg(long, value_name = "SIGMA", default_value_t = 0.0)]
    noise: f64,

    /// Direction of the noise
    #[arg(long, value_enum, value_name = "MODE", default_value = "normal")]
    noise_mode: NoiseModeArg,

    /// Fraction of random points in an enlarged box; outdoors in the air, up to 30 above ground
    #[arg(long, value_name = "FRACTION", default_value_t = 0.0)]
    outliers: f64,

    /// Fraction of points that are exact copies of others
    #[arg(long, value_name = "FRACTION", default_value_t = 0.0)]
    duplicates: f64,

    /// Distribute the points among N layers, each shifted along the normal
    #[arg(long, value_name = "N", default_value_t = 1)]
    layers: u32,

    /// Distance between successive layers
    #[arg(long, value_name = "UNITS", default_value_t = 0.0)]
    layer_offset: f64,

    /// Trees of the outdoor world [default: 400]
    #[arg(long, value_name = "N")]
    trees: Option<u32>,

    /// Power lines of the outdoor world
    #[arg(long, value_name = "N", default_value_t = 0)]
    wires: u32,

    /// Height of the free-standing walls of the outdoor world [default: from 1 to 3]
    #[arg(long, value_name = "UNITS")]
    wall_height: Option<f64>,

    /// A second survey of the outdoor world, of other points: a pit of 310 and a heap of 231 cubic units were made, and a
    /// house of 12 x 9 x 6; ten trees were felled
    #[arg(long)]
    epoch: bool,

    /// Noise of a scene, in spacings: along the ray at the mean range, growing with the range; in all
    /// directions where there is no scanner
    #[arg(long, value_name = "SPACINGS", default_value_t = 0.0)]
    range_noise: f64,

    /// How far the scans of a scene are from fitting together, in spacings
    #[arg(long, value_name = "SPACINGS", default_value_t = 0.0)]
    registration: f64,

    /// Fraction of the points of a scene that lie between near and far at depth edges
    #[arg(long, value_name = "FRACTION", default_value_t = 0.0)]
    flying: f64,

    /// Density ratio of density-jump [default: 7] and sparse-cap [default: 5], thickness of thin-plate in
    /// spacings [default: 2.5] and of voxel-slab in steps [default: 2], distance of two-squares in spacings
    /// [default: 3], per cent of outliers of strewn [default: 1]
    #[arg(long, value_name = "RATIO")]
    ratio: Option<f64>,

    /// Let density fall with the squared distance from a scanner
    #[arg(long)]
    falloff: bool,

    /// Position of that scanner in fractions of the bounding box, e.g. 0.5,0.5,2
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_triple, allow_hyphen_values = true)]
    scanner: Option<Triple>,

    /// Put the points on scan lines, RATIO times closer along than across
    #[arg(long, value_name = "RATIO")]
    scanlines: Option<f64>,

    /// Rotate by the frame (2 1 2)/3, (-2 2 1)/3, (-1 -2 2)/3; a grid stays integer
    #[arg(long)]
    rotated: bool,

    /// Added to every coordinate, e.g. 500000,5400000,300
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_triple, allow_hyphen_values = true)]
    offset: Option<Triple>,

    /// Order of the points; `lines` is `sorted` for scan lines
    #[arg(long, value_enum, value_name = "ORDER", default_value = "random")]
    order: OrderArg,

    /// Write N files NAME-0.EXT, NAME-1.EXT, ..., a random partition
    #[arg(long, value_name = "N")]
    split: Option<u32>,

    /// LAS point format: 0 or 6, or with colours that depend on the position 2 or 7
    #[arg(long, value_name = "N", default_value = "0", value_parser = parse_point_format)]
    point_format: PointFormat,

    /// Step of LAS coordinates [default: 0.001; 1/1024 for a grid]
    #[arg(long, value_name = "STEP")]
    scale: Option<f64>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum NoiseModeArg {
    /// Along the surface normal
    Normal,
    /// The same in every direction
    Isotropic,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum SamplingArg {
    /// Each point independent of the others
    Uniform,
    /// Evenly spaced, without a preferred direction (blue noise)
    Regular,
    /// Evenly spaced, closer where curvature is high
    Adaptive,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum OrderArg {
    /// No order
    Random,
    /// Along a sweep over the surface
    #[value(alias = "lines")]
    Sorted,
}

/// Three coordinates; a type of its own because clap reads a bare array as repeated values.
#[derive(Clone, Copy, Debug)]
struct Triple([f64; 3]);

/// Reads 1000000, 1_000_000, 1e6, 2.5M, 100k or 1G.
fn parse_count(text: &str) -> Result<u64, String> {
    let plain = text.replace('_', "");
    let (digits, unit) = match plain.char_indices().last() {
        Some((at, 'k' | 'K')) => (&plain[..at], 1e3),
        Some((at, 'm' | 'M')) => (&plain[..at], 1e6),
        Some((at, 'g' | 'G')) => (&plain[..at], 1e9),
        _ => (plain.as_str(), 1.0),
    };
    let count = digits
        .parse::<f64>()
        .map_or(f64::NAN, |number| number * unit);
    // Forms such as 4.1M are not exact in binary.
    let whole = count.round();
    if (0.0..9e15).contains(&whole) && (count - whole).abs() < 1e-6 * count.max(1.0) {
        Ok(whole as u64)
    } else {
        Err("expected a whole number such as 250000, 1e6, 100k or 10M".to_owned())
    }
}

fn parse_triple(text: &str) -> Result<Triple, String> {
    let numbers: Vec<f64> = text
        .split(',')
        .filter_map(|part| part.trim().parse().ok())
        .collect();
    match (text.split(',').count(), numbers.as_slice()) {
        (3, &[x, y, z]) => Ok(Triple([x, y, z])),
        _ => Err("expected three numbers separated by commas".to_owned()),
    }
}

fn parse_point_format(text: &str) -> Result<PointFormat, String> {
    match text {
        "0" => Ok(PointFormat::Legacy),
        "2" => Ok(PointFormat::Colored),
        "6" => Ok(PointFormat::Extended),
        "7" => Ok(PointFormat::ExtendedColored),
        _ => Err("expected 0, 2, 6 or 7".to_owned()),
    }
}

/// The cloud that the arguments describe.
fn cloud(args: &Args) -> Cloud {
    let mut cloud = Cloud::new(args.kind)
        .points(args.points)
        .seed(args.seed)
        .size(args.size)
        .noise(args.noise)
        .noise_mode(match args.noise_mode {
            NoiseModeArg::Normal => NoiseMode::Normal,
            NoiseModeArg::Isotropic => NoiseMode::Isotropic,
        })
        .outliers(args.outliers)
        .duplicates(args.duplicates)
        .layers(args.layers, args.layer_offset)
        .sampling(match args.sampling {
            SamplingArg::Uniform => Sampling::Uniform,
            SamplingArg::Regular => Sampling::Regular,
            SamplingArg::Adaptive => Sampling::Adaptive,
        })
        .objects(Objects {
            trees: args.trees.unwrap_or(Objects::default().trees),
            wires: args.wires,
            wall_height: args.wall_height,
            epoch: args.epoch,
        })
        .measuring(Measuring {
            noise: args.range_noise,
            registration: args.registration,
            flying: args.flying,
            ratio: args.ratio,
        })
        .falloff(args.falloff)
        .rotated(args.rotated)
        .order(match args.order {
            OrderArg::Random => Order::Random,
            OrderArg::Sorted => Order::Sorted,
        });
    cloud.mesh.clone_from(&args.mesh);
    cloud.scanner = args.scanner.map(|Triple(place)| place);
    cloud.scanlines = args.scanlines;
    cloud.offset = args.offset.map_or([0.0; 3], |Triple(offset)| offset);
    cloud
}

fn run(args: &Args) -> Result<()> {
    let cloud = cloud(args);
    if let Some(mesh) = &args.check_mesh {
        let json = cloud.measure_mesh(mesh)?.to_json();
        writeln!(io::stdout(), "{json}").map_err(|source| Error::Io {
            path: PathBuf::from("standard output"),
            action: "write",
            source,
        })?;
    }
    match &args.output {
        Some(output) => write(args, &cloud, output),
        None => Ok(()),
    }
}

fn write(args: &Args, cloud: &Cloud, output: &Path) -> Result<()> {
    let format = match args.format {
        Some(format) => format,
        None => Format::from_path(output)?,
    };
    let options = LasOptions {
        point_format: args.point_format,
        scale: args.scale,
    };
    let format = format.with_las_options(options);
    let generator = cloud.generator()?;
    if let Some(reference) = &args.reference {
        if reference == output {
            return Err(Error::Conflict {
                first: "reference",
                second: "output",
                why: "both would go to the same file",
            });
        }
        generator.write_reference(reference, args.reference_tolerance)?;
    }
    if let Some(seen) = &args.seen {
        if seen == output || args.reference.as_ref() == Some(seen) {
            return Err(Error::Conflict {
                first: "seen",
                second: "output or reference",
                why: "both would go to the same file",
            });
        }
        generator.write_seen(seen)?;
    }
    match args.split {
        Some(parts) => cloud.write_split(output, format, parts).map(drop),
        None => generator.write(output, format),
    }
}

fn main() -> ExitCode {
    outcrop_command::main(run)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts() {
        for (text, count) in [
            ("0", 0),
            ("1234567", 1_234_567),
            ("1_000", 1000),
            ("1e6", 1_000_000),
            ("2.5e3", 2500),
            ("100k", 100_000),
            ("10M", 10_000_000),
            ("4.1M", 4_100_000),
            ("1G", 1_000_000_000),
        ] {
            assert_eq!(parse_count(text), Ok(count), "{text}");
        }
        for text in ["", "k", "-1", "1.5", "1e30", "nan", "ten", "1kk"] {
            assert!(parse_count(text).is_err(), "{text}");
        }
    }

    #[test]
    fn triples() {
        assert_eq!(
            parse_triple("1, -2.5,3e2").map(|t| t.0),
            Ok([1.0, -2.5, 300.0])
        );
        for text in ["", "1,2", "1,2,3,4", "1,x,2,3", "1,2,"] {
            assert!(parse_triple(text).is_err(), "{text}");
        }
    }
}
