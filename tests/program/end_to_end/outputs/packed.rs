//! GLB with meshopt compression: what is read back is the mesh, position by position.

use super::cloud;
use crate::end_to_end::util::{self, Bench};
use outcrop::Error;
use outcrop::Start;
use outcrop::params::Params;
use outcrop_cloudgen::{Cloud, Kind};
use outcrop_codecs::meshopt;
use outcrop_disk::workspace::memory::MINIMUM_BUDGET;
use outcrop_ply::{Header, Property, Scalar};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// A corner: bits of its numbers of steps as floats, its colour in sRGB, and its normal in steps of 2^-12.
type Corner = ([u32; 3], [u8; 3], [i32; 3]);

/// Linear light as a component of sRGB in 8 bits.
fn srgb(light: u32) -> u8 {
    let x = f64::from(light) / 65535.0;
    let encoded = match x <= 0.003_130_8 {
        true => x * 12.92,
        false => 1.055 * x.powf(1.0 / 2.4) - 0.055,
    };
    (encoded * 255.0).round() as u8
}

/// A compressed GLB as it is read.
struct Packed {
    /// All triangles, each from its smallest corner on; sorted.
    triangles: Vec<[Corner; 3]>,
    translation: [f64; 3],
    step: f64,
    pieces: usize,
}

fn from_smallest(mut triangle: [Corner; 3]) -> [Corner; 3] {
    let first = (0..3).min_by_key(|n| triangle[*n]).unwrap();
    triangle.rotate_left(first);
    triangle
}

fn number(value: &Value) -> usize {
    value.as_u64().unwrap() as usize
}

/// The bytes of an accessor, decoded by its view.
fn decoded(document: &Value, buffer: &[u8], accessor: &Value) -> Vec<u8> {
    let accessor = &document["accessors"][number(accessor)];
    let view = &document["bufferViews"][number(&accessor["bufferView"])];
    let packed = &view["extensions"]["EXT_meshopt_compression"];
    assert_eq!((number(&view["buffer"]), number(&packed["buffer"])), (1, 0));
    let [at, length, count, stride] =
        ["byteOffset", "byteLength", "count", "byteStride"].map(|k| number(&packed[k]));
    assert!(at.is_multiple_of(4));
    assert_eq!(number(&view["byteLength"]), count * stride);
    assert_eq!(number(&accessor["count"]), count);
    let source = &buffer[at..at + length];
    let names = (packed["mode"].as_str().unwrap(), packed["filter"].as_str());
    if names.0 == "ATTRIBUTES" {
        // Versions other than 0 need an extension that fewer readers have.
        assert_eq!(source[0], 0xa0);
        assert!([None, Some("EXPONENTIAL")].contains(&names.1));
    } else {
        assert_eq!(names, ("TRIANGLES", None));
    }
    meshopt::decode(names, (count, stride), source).unwrap()
}

fn read(path: &Path) -> Packed {
    let bytes = std::fs::read(path).unwrap();
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!(&bytes[..4], b"glTF");
    assert_eq!((word(4), word(8)), (2, bytes.len()));
    let (json, binary) = bytes[20..].split_at(word(12));
    let document: Value = serde_json::from_slice(json).unwrap();
    assert_eq!(word(20 + json.len()), binary.len() - 8);
    let buffer = &binary[8..];
    assert_eq!(number(&document["buffers"][0]["byteLength"]), buffer.len());
    let node = &document["nodes"][1];
    let three = |value: &Value| [0, 1, 2].map(|k: usize| value[k].as_f64().unwrap());
    let scale = three(&node["scale"]);
    assert!(scale[0] == scale[1] && scale[1] == scale[2]);
    let primitives = document["meshes"][0]["primitives"].as_array().unwrap();
    let mut triangles = Vec::new();
    for primitive in primitives {
        let attributes = &primitive["attributes"];
        let positions = decoded(&document, buffer, &attributes["POSITION"]);
        let words = words_of(&positions);
        bounds(
            &document["accessors"][number(&attributes["POSITION"])],
            &words,
        );
        let colours = attributes
            .get("COLOR_0")
            .map(|c| decoded(&document, buffer, c));
        let normals = attributes.get("NORMAL");
        let normals = normals.map(|n| words_of(&decoded(&document, buffer, n)));
        let indices = words_of(&decoded(&document, buffer, &primitive["indices"]));
        // None is unused.
        let vertices = words.len() / 3;
        let mut used = vec![false; vertices];
        let mut corner = |v: u32| {
            let v = v as usize;
            used[v] = true;
            let colour = colours.as_ref().map_or([0; 3], |c| {
                let light = |k: usize| u16::from_le_bytes([c[8 * v + 2 * k], c[8 * v + 2 * k + 1]]);
                assert_eq!(light(3), u16::MAX);
                [0, 1, 2].map(|k| srgb(light(k).into()))
            });
            let normal = normals.as_ref().map_or([0; 3], |n| {
                [0, 1, 2].map(|k| {
                    let steps = f32::from_bits(n[3 * v + k]) * 4096.0;
                    assert_eq!(steps, steps.round());
                    steps as i32
                })
            });
            (
                [words[3 * v], words[3 * v + 1], words[3 * v + 2]],
                colour,
                normal,
            )
        };
        for t in indices.as_chunks::<3>().0 {
            triangles.push(from_smallest(t.map(&mut corner)));
        }
        assert!(used.iter().all(|used| *used));
    }
    triangles.sort_unstable();
    Packed {
        triangles,
        translation: three(&node["translation"]),
        step: scale[0],
        pieces: primitives.len(),
    }
}

fn words_of(bytes: &[u8]) -> Vec<u32> {
    let words = bytes.as_chunks::<4>().0.iter();
    words.map(|word| u32::from_le_bytes(*word)).collect()
}

/// The bounds of an accessor are those of its numbers.
fn bounds(accessor: &Value, words: &[u32]) {
    for k in 0..3 {
        let all = || words.iter().skip(k).step_by(3).map(|w| f32::from_bits(*w));
        let found = [all().reduce(f32::min), all().reduce(f32::max)];
        for (name, found) in ["min", "max"].iter().zip(found) {
            assert_eq!(accessor[name][k].as_f64(), found.map(f64::from));
        }
    }
}

/// The triangles of a PLY mesh in the steps of the other mesh.
fn expected(path: &Path, packed: &Packed) -> Vec<[Corner; 3]> {
    let bytes = std::fs::read(path).unwrap();
    let header = Header::read(&mut &bytes[..]).unwrap();
    let vertex = &header.elements[0];
    let has_colours = vertex.properties.last().unwrap().0 == "blue";
    if has_colours {
        let last = vertex.properties.last().unwrap();
        assert_eq!(last.1, Property::One(Scalar::U8));
    }
    let width = match vertex.properties[0].1 {
        Property::One(Scalar::F64) => 8,
        _ => 4,
    };
    let has_normals = vertex.properties[3..].iter().any(|p| p.0 == "nx");
    let size = vertex.record_bytes().unwrap();
    let start = bytes
        .windows(11)
        .position(|w| w == b"end_header\n")
        .unwrap()
        + 11;
    let mesh = outcrop_ply::Mesh::read(&bytes[..], bytes.len() as u64).unwrap();
    let corner = |v: u32| {
        let place = mesh.vertices[v as usize];
        let steps = [0, 1, 2].map(|k: usize| {
            let steps = (place[k] - packed.translation[k]) / packed.step;
            assert!((steps - steps.round()).abs() < 0.2, "{steps}");
            (steps.round() as f32 + 0.0).to_bits()
        });
        let end = start + (v as usize + 1) * size;
        let colour = match has_colours {
            true => bytes[end - 3..end].try_into().unwrap(),
            false => [0; 3],
        };
        let normal = match has_normals {
            true => [0, 1, 2].map(|k| {
                let at = start + v as usize * size + 3 * width + 4 * k;
                let x = f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
                (x * 4096.0).round() as i32
            }),
            false => [0; 3],
        };
        (steps, colour, normal)
    };
    let mut all: Vec<_> = mesh
        .triangles
        .iter()
        .map(|t| from_smallest(t.map(corner)))
        .collect();
    all.sort_unstable();
    all
}

/// A far cloud with coordinates of three decimals, and colours.
fn coloured(bench: &Bench, points: u64) -> PathBuf {
    let cloud = Cloud::new(Kind::Bumpy).points(points).noise(1.5).seed(4);
    let cloud = cloud.offset([500_000.0, 5_400_000.0, 300.0]);
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {points}\nproperty double x\nproperty double y\nproperty double z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
    );
    for (n, [x, y, z]) in cloud.generator().unwrap().iter().enumerate() {
        let colour = [n % 256, n / 256 % 256, n % 7];
        let [r, g, b] = colour;
        writeln!(text, "{x:.3} {y:.3} {z:.3} {r} {g} {b}").unwrap();
    }
    bench.write("coloured.ply", text)
}

fn params(compress: bool) -> Params {
    with_normals(compress, false)
}

fn with_normals(compress: bool, normals: bool) -> Params {
    Params {
        block: 1500,
        normals,
        compress_glb: compress,
        attributes: "auto".parse().unwrap(),
        ..Params::default()
    }
}

#[test]
fn the_mesh_is_exact_in_one_file_and_in_squares() {
    let bench = Bench::new();
    let far = cloud(20_000).offset([500_000.0, 5_400_000.0, 300.0]);
    let inputs = [
        (coloured(&bench, 20_000), true),
        (bench.cloud("far.laz", &far), false),
        // Numbers of steps have more bits than floats.
        (bench.cloud("doubles.ply", &cloud(20_000)), false),
    ];
    for ((input, colours), normals) in inputs.into_iter().zip([true, true, false]) {
        println!("{}", input.display());
        let (ply, glb) = (bench.path("mesh.ply"), bench.path("mesh.glb"));
        let report = util::reconstruct(&input, &ply, &with_normals(false, normals));
        let again = util::reconstruct(&input, &glb, &with_normals(true, normals));
        assert_eq!(report.mesh, again.mesh);
        let packed = read(&glb);
        assert!(packed.pieces > 5);
        let whole = expected(&ply, &packed);
        assert_eq!(whole.iter().flatten().any(|c| c.1 != [0; 3]), colours);
        let is_turned = |c: &Corner| c.2.iter().map(|x| x * x).sum::<i32>() > 4000 * 4000;
        assert!(whole.iter().flatten().all(|c| is_turned(c) == normals));
        assert!(packed.triangles == whole);

        // One file for each square: the same triangles, from origins of their own.
        let side = Params {
            split: Some(300.0),
            ..with_normals(true, normals)
        };
        let squares = bench.subfolder("squares");
        let report = util::reconstruct(&input, &squares.join("mesh.glb"), &side);
        let names = util::listing(&squares);
        let names: Vec<_> = names.iter().filter(|n| n.ends_with(".glb")).collect();
        assert!(names.len() > 3 && names.len() as u64 == report.cut.squares);
        let mut all = 0;
        let own = Params {
            compress_glb: false,
            ..side
        };
        util::reconstruct(&input, &squares.join("mesh.ply"), &own);
        for name in names {
            let packed = read(&squares.join(name));
            let ply = squares.join(name.replace(".glb", ".ply"));
            assert!(packed.triangles == expected(&ply, &packed), "{name}");
            all += packed.triangles.len();
        }
        assert_eq!(all, whole.len());
        std::fs::remove_dir_all(squares).unwrap();
    }
}

#[test]
fn the_bytes_do_not_depend_on_threads_memory_and_parts() {
    let bench = Bench::new();
    let input = coloured(&bench, 30_000);
    let glb = bench.path("mesh.glb");
    let params = with_normals(true, true);
    util::reconstruct(&input, &glb, &params);
    let expected = std::fs::read(&glb).unwrap();
    for (threads, memory, tile, page) in [(1, MINIMUM_BUDGET, 97, 7), (3, 4 << 30, 500, 64)] {
        let builder = util::builder(std::slice::from_ref(&input), &glb, &params)
            .threads(threads)
            .memory(memory)
            .tile_points(tile)
            .page_points(page)
            .start(Start::Restart);
        builder.build().unwrap().run().unwrap();
        assert!(
            std::fs::read(&glb).unwrap() == expected,
            "{threads} threads"
        );
    }
}

#[test]
fn only_glb_can_be_compressed_so() {
    let bench = Bench::new();
    let input = bench.cloud("cloud.xyz", &cloud(500));
    for name in ["mesh.ply", "mesh.glb.zst"] {
        let output = bench.path(name);
        let arguments = ["reconstruct", "--compress-glb", "-o"].map(std::ffi::OsStr::new);
        let rest = [output.as_os_str(), input.as_os_str()];
        let said = util::run(arguments.into_iter().chain(rest));
        assert_eq!(said.code, Some(2), "{said:?}");
        assert!(said.err.contains("--compress-glb"), "{said:?}");
        assert_eq!(said.err.lines().count(), 1, "{said:?}");
    }
    let built = outcrop::Reconstruction::builder()
        .input(&input)
        .output(bench.path("mesh.stl"))
        .params(params(true))
        .build();
    assert!(matches!(built.err(), Some(Error::Parameter { .. })));
}
