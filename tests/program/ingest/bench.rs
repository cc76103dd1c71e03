//! Makes input files and reads them back.

use outcrop::Error;
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::{MINIMUM_BUDGET, MemoryPool};
use outcrop_disk::workspace::progress::{Cancel, Silent};
use outcrop_formats::ingest;
use outcrop_geom::lattice::Lattice;
use outcrop_points::Spool;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// A folder for input files and a workspace beside them.
pub struct Bench {
    folder: tempfile::TempDir,
    pub workspace: Workspace,
}

impl Bench {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let memory = MemoryPool::new(MINIMUM_BUDGET).unwrap();
        let scratch = folder.path().join("scratch");
        let workspace =
            Workspace::new(&scratch, memory, 2, Arc::new(Silent), Cancel::new()).unwrap();
        Self { folder, workspace }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }

    pub fn read(&self, paths: &[PathBuf]) -> Result<Spool, Error> {
        let spool = ingest(paths, &self.workspace);
        let memory = &self.workspace.memory;
        assert_eq!(
            memory.available(),
            memory.capacity(),
            "memory is given back"
        );
        spool
    }

    pub fn error(&self, path: PathBuf) -> String {
        let error = self.read(&[path]).map(|_| ()).unwrap_err();
        assert!(matches!(error, Error::Input { .. }), "{error:?}");
        error.to_string()
    }
}

/// The numbers of all frames of the spool.
pub fn frames(spool: &Spool) -> Vec<u32> {
    spool.frames().into_iter().map(|frame| frame.0).collect()
}

/// The points of the spool on a lattice, sorted.
pub fn positions(bench: &Bench, spool: &Spool, lattice: &Lattice) -> Vec<[i32; 3]> {
    let mut all = Vec::new();
    spool
        .for_each(&bench.workspace, lattice, |points| {
            all.extend_from_slice(points);
            Ok(())
        })
        .unwrap();
    all.sort_unstable();
    let parallel = Mutex::new(Vec::new());
    spool
        .par_for_frames(&bench.workspace, 3, lattice, &frames(spool), |points| {
            parallel.lock().unwrap().extend_from_slice(points);
            Ok(())
        })
        .unwrap();
    let mut parallel = parallel.into_inner().unwrap();
    parallel.sort_unstable();
    assert_eq!(all, parallel);
    all
}

/// Pseudo-random integers in a box of 200 × 200 × 20 thousand.
pub fn cloud(count: usize, seed: u64) -> Vec<[i32; 3]> {
    let mut state = seed;
    let mut next = |limit: u64| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 33) % limit
    };
    (0..count)
        .map(|_| [200_000, 200_000, 20_000].map(|limit| next(limit) as i32 - 1000))
        .collect()
}

/// Integers minus the lowest of each axis, sorted: positions on a lattice with their step.
pub fn based(points: &[[i32; 3]]) -> Vec<[i32; 3]> {
    let low: [i32; 3] = std::array::from_fn(|a| points.iter().map(|p| p[a]).min().unwrap());
    let mut based: Vec<_> = points
        .iter()
        .map(|p| std::array::from_fn(|a| p[a] - low[a]))
        .collect();
    based.sort_unstable();
    based
}

/// Writes a LAS or LAZ file, by its extension; every hundredth point is flagged if `withheld`.
pub fn write_las(
    path: &Path,
    version: (u8, u8),
    format: u8,
    grid: (f64, [f64; 3]),
    points: &[[i32; 3]],
    withheld: bool,
) {
    let mut builder = las::Builder::from(version);
    builder.point_format = las::point::Format::new(format).unwrap();
    let axis = |offset| las::Transform {
        scale: grid.0,
        offset,
    };
    builder.transforms = las::Vector {
        x: axis(grid.1[0]),
        y: axis(grid.1[1]),
        z: axis(grid.1[2]),
    };
    let header = builder.into_header().unwrap();
    let format = *header.point_format();
    let mut writer = las::Writer::from_path(path, header).unwrap();
    for (i, p) in points.iter().enumerate() {
        let [x, y, z] = std::array::from_fn(|a| f64::from(p[a]) * grid.0 + grid.1[a]);
        // Times of three scanners in turn, with pauses: all branches of the compression of times.
        let time = 1e5 + (i % 3) as f64 * 1e4 + (i / 7) as f64 * 1e-5 + (i / 5000) as f64 * 1e7;
        let point = las::Point {
            x,
            y,
            z,
            intensity: (i % 911) as u16,
            return_number: 1 + (i % 3) as u8,
            number_of_returns: 3,
            is_withheld: withheld && i % 100 == 0,
            gps_time: format.has_gps_time.then_some(time),
            color: format.has_color.then(|| las::Color::new(i as u16, 2, 3)),
            nir: format.has_nir.then_some(i as u16),
            waveform: format.has_waveform.then(Default::default),
            ..Default::default()
        };
        writer.write_point(point).unwrap();
    }
    writer.close().unwrap();
}

/// A PLY file with a list element first, coordinates among other properties, and a face at the end.
pub fn ply(body: &str, kind: &str, list: bool, points: &[[f64; 3]]) -> Vec<u8> {
    let extra = if list {
        "property list uchar short extra\n"
    } else {
        ""
    };
    let mut out = format!(
        "ply\r\nformat {body} 1.0\ncomment x\nelement camera 2\nproperty list uchar int ids\n\
         property uchar tag\nelement vertex {}\nproperty uchar red\nproperty {kind} z\n{extra}\
         property {kind} x\nproperty {kind} y\nelement face 1\n\
         property list uchar int vertex_indices\nend_header\n",
        points.len()
    )
    .into_bytes();
    if body == "ascii" {
        let mut text = String::from("3 1 2 3 9\n0 9\n");
        for [x, y, z] in points {
            let extra = if list { "2 7 8 " } else { "" };
            writeln!(text, "255 {z} {extra}{x} {y}").unwrap();
        }
        out.extend_from_slice(text.as_bytes());
        return out;
    }
    let big = body.ends_with("big_endian");
    let mut put = |bytes: &[u8]| {
        let mut bytes = bytes.to_vec();
        if big {
            bytes.reverse();
        }
        out.extend_from_slice(&bytes);
    };
    let scalar = |put: &mut dyn FnMut(&[u8]), v: f64| match kind {
        "float" => put(&(v as f32).to_le_bytes()),
        "double" => put(&v.to_le_bytes()),
        _ => put(&(v as i32).to_le_bytes()),
    };
    put(&[1]);
    put(&7i32.to_le_bytes());
    put(&[9]);
    put(&[0]);
    put(&[9]);
    for [x, y, z] in points {
        put(&[255]);
        scalar(&mut put, *z);
        if list {
            put(&[2]);
            put(&7i16.to_le_bytes());
            put(&8i16.to_le_bytes());
        }
        scalar(&mut put, *x);
        scalar(&mut put, *y);
    }
    put(&[0]);
    out
}
