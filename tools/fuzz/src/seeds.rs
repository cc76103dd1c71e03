//! The initial files for fuzzing.

mod scans;

use crate::{folder, foreign, resume, scratch};
use outcrop_cloudgen::{Cloud, Encoding, Format, Kind, LasOptions, PointFormat, Precision};
use std::error::Error;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Errors are passed to the caller of the program.
pub type Result<T = ()> = std::result::Result<T, Box<dyn Error>>;

/// The folder of the seeds.
struct Seeds(PathBuf);

impl Seeds {
    fn path(&self, target: &str, name: &str) -> Result<PathBuf> {
        let folder = self.0.join(target);
        std::fs::create_dir_all(&folder)?;
        Ok(folder.join(name))
    }

    fn put(&self, target: &str, name: &str, bytes: impl AsRef<[u8]>) -> Result {
        Ok(std::fs::write(self.path(target, name)?, bytes)?)
    }
}

/// Writes a folder of seeds for each target into `folder`.
pub fn write(folder: &Path) -> Result {
    let seeds = Seeds(folder.to_path_buf());
    las_files(&seeds)?;
    clouds(&seeds)?;
    ply_files(&seeds)?;
    scans::pcd_files(&seeds)?;
    scans::ptx_files(&seeds)?;
    scans::e57_files(&seeds)?;
    texts(&seeds)?;
    for number in 0..60u8 {
        let bytes: Vec<u8> = (0..40u8)
            .map(|at| {
                number
                    .wrapping_mul(41)
                    .wrapping_add(at.wrapping_mul(number | 7))
            })
            .collect();
        seeds.put("dialect", &number.to_string(), bytes)?;
    }
    for (number, text) in REGIONS.iter().enumerate() {
        seeds.put("region", &number.to_string(), text)?;
    }
    folders(&seeds)?;
    meshes(&seeds)?;
    foreign_meshes(&seeds)?;
    scans::tiles(&seeds)?;
    scratch_files(&seeds)?;
    for stage in 0..6u8 {
        for (number, edits) in EDITS.iter().enumerate() {
            let bytes = [&[stage], *edits].concat();
            seeds.put("resume", &format!("{stage}-{number}"), bytes)?;
        }
    }
    Ok(())
}

/// Regions of every kind.
const REGIONS: [&str; 5] = [
    "0,0,10,20",
    "-1,-2,-3,4,5,6.5e1",
    "MULTIPOLYGON Z(((0 0 1,4 0 1,0 4 1,0 0 1),(1 1 1,2 1 1,1 2 1)),((9 9 1,8 9 1,9 8 1)))",
    r#"{"type":"FeatureCollection","features":[{"type":"Feature","properties":{},"geometry":null}]}"#,
    r#"{"type":"MultiPolygon","coordinates":[[[[0,0],[4,0],[0,4],[0,0]]]]}"#,
];

/// Damage: file, kind, three bytes of the place, value.
const EDITS: [&[u8]; 5] = [
    &[],
    &[0, 0, 9, 0, 0, 0],
    &[1, 1, 40, 0, 0, 255],
    &[3, 3, 0, 0, 0, 0, 2, 2, 99, 0, 0, 7],
    &[4, 4, 16, 0, 0, 60, 5, 5, 0, 0, 0, 1],
];

/// Every version, point format and number of extra bytes, with a few points.
fn las_files(seeds: &Seeds) -> Result {
    for (minor, formats) in [(0, 0..=1), (2, 0..=3), (3, 4..=5), (4, 0..=10)] {
        for format in formats {
            for kind in ["las", "laz"] {
                for (points, extra) in [(0, 0), (3, 0), (60, 4), (700, 0)] {
                    let name = format!("1.{minor}-{format}-{points}.{kind}");
                    let path = seeds.path(kind, &name)?;
                    las_file(&path, (1, minor), format, points, extra)?;
                }
            }
        }
    }
    Ok(())
}

fn las_file(path: &Path, version: (u8, u8), format: u8, points: u32, extra: u16) -> Result {
    let mut builder = las::Builder::from(version);
    builder.point_format = las::point::Format::new(format)?;
    builder.point_format.extra_bytes = extra;
    builder.vlrs.push(las::Vlr {
        user_id: "LASF_Projection".into(),
        record_id: 34735,
        description: String::new(),
        data: [1u16, 1, 0, 1, 3072, 0, 1, 26917]
            .map(u16::to_le_bytes)
            .concat(),
    });
    let header = builder.into_header()?;
    let format = *header.point_format();
    let mut writer = las::Writer::from_path(path, header)?;
    for i in 0..points {
        let t = f64::from(i);
        writer.write_point(las::Point {
            x: (t * 0.37).sin() * 10.0,
            y: (t * 0.61).cos() * 10.0,
            z: t * 0.01,
            intensity: i as u16,
            return_number: 1 + (i % 3) as u8,
            number_of_returns: 3,
            is_withheld: i % 50 == 7,
            gps_time: format
                .has_gps_time
                .then_some(f64::from(i % 3) * 1e4 + t * 1e-5),
            color: format.has_color.then(|| las::Color::new(i as u16, 2, 3)),
            nir: format.has_nir.then_some(i as u16),
            waveform: format.has_waveform.then(Default::default),
            extra_bytes: vec![i as u8; extra.into()],
            ..Default::default()
        })?;
    }
    Ok(writer.close()?)
}

/// Clouds of the generator in all its formats.
fn clouds(seeds: &Seeds) -> Result {
    let extended = LasOptions {
        point_format: PointFormat::Extended,
        ..LasOptions::default()
    };
    let ply = |encoding, precision| Format::Ply(encoding, precision);
    for (target, name, format) in [
        ("las", "torus.las", Format::Las(extended)),
        ("laz", "torus.laz", Format::Laz(extended)),
        (
            "laz",
            "torus-legacy.laz",
            Format::Laz(LasOptions::default()),
        ),
        (
            "ply",
            "le32.ply",
            ply(Encoding::LittleEndian, Precision::Single),
        ),
        (
            "ply",
            "be64.ply",
            ply(Encoding::BigEndian, Precision::Double),
        ),
        ("ply", "ascii.ply", ply(Encoding::Ascii, Precision::Double)),
        ("text", "torus.xyz", Format::Xyz),
    ] {
        for points in [7, 300, 3000] {
            let cloud = Cloud::new(Kind::Torus).points(points).duplicates(0.1);
            cloud.write(seeds.path(target, &format!("{points}-{name}"))?, format)?;
        }
    }
    // Several chunks: more points than one holds.
    let cloud = Cloud::new(Kind::Grid).points(60_000);
    cloud.write(seeds.path("laz", "chunks.laz")?, Format::Laz(extended))?;
    Ok(())
}

/// PLY with lists, elements before and after, all scalar types, and line ends of all kinds.
fn ply_files(seeds: &Seeds) -> Result {
    let header = "ply\nformat ascii 1.0\ncomment a\nobj_info b\nelement camera 2\n\
                  property list uchar int ids\nproperty uchar tag\nelement vertex 3\n\
                  property uchar red\nproperty double z\nproperty list ushort short extra\n\
                  property float x\nproperty int8 y\nelement face 1\n\
                  property list uchar int vertex_indices\nend_header\n";
    let text = format!(
        "{header}3 1 2 3 9\n0 9\n1 1e3 2 7 8 -0.5 2\n2 nan 0 3 4\n3 -inf 1 9 5 6\n3 0 1 2\n"
    );
    seeds.put("ply", "lists.ply", &text)?;
    seeds.put("ply", "crlf.ply", text.replace('\n', "\r\n"))?;
    seeds.put("ply", "cr.ply", text.replace('\n', "\r"))?;
    for (name, order) in [
        ("little", "binary_little_endian"),
        ("big", "binary_big_endian"),
    ] {
        let mut bytes = header.replace("ascii", order).into_bytes();
        bytes.extend((0..200u8).map(|i| i % 5));
        seeds.put("ply", &format!("lists-{name}.ply"), bytes)?;
    }
    seeds.put("ply", "points.ply", "1 2 3\n4 5 6\n")
}

/// Lists of points as programs write them, and text that only resembles one.
const TEXTS: [&str; 13] = [
    "1.5 2 -3.25\n4 5 6\n",
    "1.5\t2\t-3.25\r\n4\t5\t6",
    "1.5,2,-3.25\r4,5,6\r",
    "1.5;2;-3.25\n4;5;6\n",
    "1,5;2;-3,25\n4;5;6\n",
    "1,5 2 -3,25\n4 5 6\n",
    "# note\n\nX Y Z\n1.5 2 -3.25\n4 5 6\n",
    "\u{feff}//X,Y,Z\n1e999,nan,-0\n4,5e-300,6\n",
    "2\n1.5 2 -3.25 -100 1 2 3\n4 5 6 -100 1 2 3\n1\n1 2 3\n",
    "\"z\",\"x\",\"y\"\n-3.25,1.5,2\n6,4,5\n",
    "1.#QNAN -1.#IND inf\n1 2 3\n",
    "v 1 2 3\nvn 4 5 6\nf 1 2 3\n",
    "solid a\nfacet normal 0 0 1\n",
];

fn texts(seeds: &Seeds) -> Result {
    for (number, text) in TEXTS.iter().enumerate() {
        seeds.put("text", &format!("text-{number}"), text)?;
    }
    let digits = "7".repeat(10_000);
    seeds.put(
        "text",
        "digits",
        format!("{digits} 1.{digits} -2e{digits}\n1 2 3\n"),
    )?;
    seeds.put("text", "columns", format!("{}\n", "1 ".repeat(30_000)))?;
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    gzip.write_all(TEXTS[0].as_bytes())?;
    let gzip = gzip.finish()?;
    seeds.put("text", "two.gz", [&gzip[..], &gzip[..]].concat())?;
    let zstd = zstd::encode_all(TEXTS[0].as_bytes(), 3)?;
    seeds.put("text", "two.zst", [&zstd[..], &zstd[..]].concat())
}

/// Files of several formats in one folder.
fn folders(seeds: &Seeds) -> Result {
    let read = |target: &str, name: &str| {
        std::fs::read(seeds.path(target, name)?).map_err(Box::<dyn Error>::from)
    };
    let las = read("las", "1.2-0-60.las")?;
    let laz = read("laz", "1.4-6-60.laz")?;
    let ply = read("ply", "7-le32.ply")?;
    let e57 = read("e57", "1-false.e57")?;
    let pcd = read("pcd", "packed.pcd")?;
    let ptx = read("ptx", "two.ptx")?;
    let text = TEXTS[0].as_bytes().to_vec();
    for (number, files) in [
        vec![(0, &las), (1, &laz)],
        vec![(0, &las), (2, &ply), (3, &text)],
        vec![(8, &laz), (9, &text), (2, &text)],
        vec![(5, &text), (6, &text), (0, &text)],
        vec![(10, &e57), (11, &pcd), (12, &ptx)],
    ]
    .into_iter()
    .enumerate()
    {
        let parts: Vec<Vec<u8>> = files
            .into_iter()
            .map(|(kind, bytes)| [&[kind], &bytes[..]].concat())
            .collect();
        seeds.put("folder", &number.to_string(), parts.join(folder::BETWEEN))?;
    }
    Ok(())
}

fn meshes(seeds: &Seeds) -> Result {
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty double y\n\
                property float z\nproperty uchar red\nelement face 4\n\
                property list uchar int vertex_indices\nproperty float quality\nend_header\n\
                0 0 0 9\n1 0 0 9\n0 1 0 9\n0 0 1 9\n\
                3 0 2 1 .5\n3 0 1 3 .5\n3 1 2 3 .5\n3 2 0 3 .5\n";
    seeds.put("mesh", "tetrahedron.ply", text)?;
    seeds.put(
        "mesh",
        "quad.ply",
        text.replace("3 2 0 3 .5", "4 2 0 3 1 .5"),
    )?;
    seeds.put(
        "mesh",
        "out-of-range.ply",
        text.replace("3 2 0 3 .5", "3 2 0 -7 .5"),
    )?;
    let sphere = Cloud::new(Kind::Sphere);
    for (number, tolerance) in [0.2, 0.02, 0.005].into_iter().enumerate() {
        sphere.write_reference(
            seeds.path("mesh", &format!("sphere-{number}.ply"))?,
            tolerance,
        )?;
    }
    for (name, order) in [
        ("little", "binary_little_endian"),
        ("big", "binary_big_endian"),
    ] {
        let header = text.split_inclusive("end_header\n").next().unwrap_or(text);
        let mut bytes = header.replace("ascii", order).into_bytes();
        let big = name == "big";
        let mut put = |value: &[u8]| {
            let mut value = value.to_vec();
            if big {
                value.reverse();
            }
            bytes.extend(value);
        };
        for [x, y, z] in [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
            put(&(x as f32).to_le_bytes());
            put(&f64::to_le_bytes(y));
            put(&(z as f32).to_le_bytes());
            put(&[9]);
        }
        for face in [[0i32, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]] {
            put(&[3]);
            face.iter().for_each(|corner| put(&corner.to_le_bytes()));
            put(&0.5f32.to_le_bytes());
        }
        seeds.put("mesh", &format!("{name}.ply"), bytes)?;
    }
    Ok(())
}

/// Meshes in other formats, as the program writes them, and some lines of other programs.
fn foreign_meshes(seeds: &Seeds) -> Result {
    let lines = "mtllib a.mtl\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0\nv 1 1 .5e0\nvt 0 0\nvn 0 0 1\nusemtl a\n\
                 f 1/1/1 2//1 4 3/1\nf -1 -2 \\\n-3\nl 1 2\n";
    seeds.put("foreign", "lines.obj", ["\0", lines].concat())?;
    let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1e0 0\nendloop\nendfacet\n";
    let text = format!("\u{1}solid a\n{facet}{facet}endsolid a\n");
    seeds.put("foreign", "text.stl", text)?;
    let header = "element vertex 4\nproperty uchar red\nproperty double z\nproperty float x\nproperty float y\n\
                  property list uchar int more\nelement face 2\nproperty list uchar short vertex_index\n\
                  property list uchar float texcoord\nelement edge 1\nproperty int vertex1\nend_header\n";
    let vertices = "1 0 0 0 0\n2 0 1 0 1 7\n3 .5 1 1 0\n4 0 0 1 0\n";
    let text =
        format!("\u{3}ply\nformat ascii 1.0\n{header}{vertices}4 0 1 2 3 0\n2 1 2 1 .5\n9\n");
    seeds.put("foreign", "quads.ply", text)?;
    let triangle = header
        .replace("vertex 4", "vertex 1")
        .replace("face 2", "face 1");
    let text = format!("\u{3}ply\nformat binary_big_endian 1.0\n{triangle}");
    let body = [&[7][..], &[0; 17], &[4, 0, 0, 0, 0, 0, 0, 0, 0, 0], &[0; 4]].concat();
    seeds.put("foreign", "quad.ply", [text.into_bytes(), body].concat())?;
    let folder = tempfile::tempdir()?;
    let cloud = folder.path().join("cloud.las");
    let las = Format::Las(LasOptions::default());
    Cloud::new(Kind::Sphere).points(300).write(&cloud, las)?;
    for (number, ending) in (0u8..).zip(foreign::ENDINGS) {
        let mesh = folder.path().join(format!("mesh.{ending}"));
        let run = outcrop::Reconstruction::builder()
            .input(&cloud)
            .output(&mesh);
        run.build()?.run()?;
        let bytes = [vec![number], std::fs::read(&mesh)?].concat();
        seeds.put("foreign", &format!("sphere.{ending}"), bytes)?;
    }
    Ok(())
}

/// Bodies of the records of a journal.
fn bodies(journal: &[u8]) -> Vec<&[u8]> {
    let mut bodies = Vec::new();
    let mut rest = journal.get(8..).unwrap_or_default();
    while let Some((length, after)) = rest.split_first_chunk::<4>() {
        let length = u32::from_le_bytes(*length) as usize;
        let Some(body) = after.get(4..4 + length) else {
            break;
        };
        bodies.push(body);
        rest = &after[4 + length..];
    }
    bodies
}

/// Journals of stopped runs, with the content of their last records, and their files.
fn scratch_files(seeds: &Seeds) -> Result {
    for (number, snapshot) in resume::snapshots().iter().enumerate() {
        let file = |wanted: &str| {
            let segment = |name: &String| name.rsplit_once('.').is_some_and(|(n, _)| n == wanted);
            let found = snapshot.iter().find(|(name, _)| segment(name));
            found.map_or(&[][..], |(_, bytes)| bytes)
        };
        let journals = snapshot
            .iter()
            .filter(|(name, _)| name.starts_with("journal"));
        let all: Vec<&[u8]> = journals.flat_map(|(_, bytes)| bodies(bytes)).collect();
        let records = |count: usize| -> Vec<u8> {
            let some = all.iter().skip(1).take(count);
            let some = some.filter(|body| body.len() < usize::from(u16::MAX));
            some.flat_map(|body| [&(body.len() as u16).to_le_bytes(), *body].concat())
                .filter(|byte| *byte != scratch::BETWEEN)
                .collect()
        };
        for (part, name) in scratch::FILES.iter().enumerate() {
            let saved = all[(part + 1) * all.len() / 8];
            // The saved value follows the name of the step, the number of the unit and the parts.
            let from = saved.len().saturating_sub(60);
            let between = [scratch::BETWEEN];
            let journal = records(3 + 10 * part);
            let seed = [&journal, &between[..], &saved[from..], &between, file(name)].concat();
            seeds.put("scratch", &format!("{number}-{part}"), seed)?;
        }
    }
    Ok(())
}
