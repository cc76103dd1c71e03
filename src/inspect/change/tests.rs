use super::*;
use outcrop_formats::ingest_selected;
use outcrop_geom::vector::V3;
use std::io::Write;
use std::path::PathBuf;

/// A grid of heights over a square of this side, with `n` vertices along it.
fn surface(path: &Path, side: f64, n: usize, height: impl Fn(f64, f64) -> f64) -> PathBuf {
    let mut file = Vec::new();
    let faces = 2 * (n - 1) * (n - 1);
    write!(
        file,
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\n\
         property double z\nelement face {faces}\nproperty list uchar int vertex_indices\nend_header\n",
        n * n
    )
    .unwrap();
    let step = side / (n - 1) as f64;
    for k in 0..n * n {
        let (x, y) = ((k % n) as f64 * step, (k / n) as f64 * step);
        let position: V3 = [x, y, height(x, y)];
        file.extend(position.iter().flat_map(|c| c.to_le_bytes()));
    }
    let mut face = |corners: [usize; 3]| {
        file.push(3);
        file.extend(corners.iter().flat_map(|c| (*c as u32).to_le_bytes()));
    };
    for k in (0..n * (n - 1)).filter(|k| k % n < n - 1) {
        face([k, k + 1, k + n + 1]);
        face([k, k + n + 1, k + n]);
    }
    std::fs::write(path, file).unwrap();
    path.to_path_buf()
}

/// The points of a cloud, in the order of their ids.
fn clouds(
    path: &Path,
    keep: bool,
    workspace: &Workspace,
    each: &mut dyn FnMut(u64, &[V3]) -> Result<()>,
) -> Result<bool> {
    outcrop_stages::cloud::positions(path, ingest_selected, keep, workspace, each)
}

/// The change between two surfaces, and the rows.
fn changed(
    old: &Path,
    new: &Path,
    options: &Options,
    workspace: &Workspace,
) -> (Change, Vec<ChangeRow>) {
    let (found, changes) = change(old, new, options, clouds, workspace).unwrap();
    let rows = (0..changes.count()).flat_map(|section| changes.get(section).unwrap());
    (found, rows.collect())
}

/// A number that looks random, of about this size, by place.
fn noise(x: f64, y: f64, size: f64, seed: f64) -> f64 {
    let wave = libm::sin(x * 127.1 + y * 311.7 + seed * 74.7) * 43758.5453;
    2.0 * size * (wave - wave.floor() - 0.5)
}

#[test]
fn a_pit_and_a_heap_have_their_volumes() {
    let folder = tempfile::tempdir().unwrap();
    let workspace = Workspace::for_tests(2).unwrap();
    let ground = |x: f64, y: f64| libm::sin(x / 9.0) + 0.05 * y;
    let old = surface(&folder.path().join("old.ply"), 60.0, 121, ground);
    let new = surface(&folder.path().join("new.ply"), 60.0, 151, |x, y| {
        let pit = (8.0 - libm::hypot(x - 15.0, y - 20.0)).clamp(0.0, 2.0);
        let heap = 3.0 * (1.0 - ((x - 42.0).powi(2) + (y - 40.0).powi(2)) / 49.0).max(0.0);
        ground(x, y) - pit + heap
    });
    let (found, rows) = changed(&old, &new, &Options::default(), &workspace);
    let pi = std::f64::consts::PI;
    let [pit, heap] = [pi * 2.0 / 3.0 * (36.0 + 48.0 + 64.0), pi * 49.0 * 3.0 / 2.0];
    assert!(
        (found.lost / pit - 1.0).abs() < 0.01,
        "{} {pit}",
        found.lost
    );
    assert!(
        (found.gained / heap - 1.0).abs() < 0.01,
        "{} {heap}",
        found.gained
    );
    let areas = &found.areas;
    assert_eq!(areas.len(), 2, "{areas:?}");
    let largest = |k: usize| areas[k].largest.unwrap();
    assert!((largest(0) + 2.0).abs() < 0.1, "{areas:?}");
    assert!((largest(1) - 2.95).abs() < 0.15, "{areas:?}");
    assert_eq!(rows.len(), 151 * 151);
    // The normal of the slope is not vertical, so distances are a little shorter than heights.
    let middle = rows[100 * 151 + 105].changes()[0];
    assert!(middle > 2.7 && middle < 3.0, "{middle}");
    assert_eq!(found.only_new_area, 0.0);
    assert_eq!(found.only_old_area, Some(0.0));
}

#[test]
fn nothing_changes_in_noise() {
    let folder = tempfile::tempdir().unwrap();
    let workspace = Workspace::for_tests(2).unwrap();
    let ground = |seed: f64| move |x: f64, y: f64| 0.1 * x + noise(x, y, 0.1, seed);
    let old = surface(&folder.path().join("old.ply"), 60.0, 141, ground(1.0));
    let new = surface(&folder.path().join("new.ply"), 60.0, 151, ground(2.0));
    let (found, _) = changed(&old, &new, &Options::default(), &workspace);
    let share = found.significant as f64 / found.compared as f64;
    assert!(share > 0.005 && share < 0.07, "{share}");
    let options = Options {
        registration: 0.02,
        ..Options::default()
    };
    let (found, _) = changed(&old, &new, &options, &workspace);
    assert!(found.significant == 0, "{}", found.significant);
}

#[test]
fn a_cloud_can_be_the_old_surface() {
    let folder = tempfile::tempdir().unwrap();
    let workspace = Workspace::for_tests(1).unwrap();
    let new = surface(&folder.path().join("new.ply"), 10.0, 41, |_, _| 0.5);
    let old = folder.path().join("old.xyz");
    let points = (0..1600).map(|k| {
        format!(
            "{} {} 0\n",
            0.25 * f64::from(k % 40),
            0.25 * f64::from(k / 40)
        )
    });
    std::fs::write(&old, points.collect::<String>()).unwrap();
    let (found, rows) = changed(&old, &new, &Options::default(), &workspace);
    assert_eq!(found.only_old_area, None);
    let [middle, _] = rows[20 * 41 + 20].changes();
    assert!((middle - 0.5).abs() < 1e-6, "{middle}");
    assert!((found.gained / 50.0 - 1.0).abs() < 0.05, "{}", found.gained);
    // A new surface has to have normals.
    let refused = change(&new, &old, &Options::default(), clouds, &workspace).unwrap_err();
    assert!(refused.to_string().contains("a mesh"), "{refused}");
}

#[test]
fn what_only_one_has_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let workspace = Workspace::for_tests(2).unwrap();
    let small = surface(&folder.path().join("small.ply"), 20.0, 41, |_, _| 0.0);
    let large = surface(&folder.path().join("large.ply"), 30.0, 61, |_, _| 0.0);
    let options = Options {
        radius: Some(1.0),
        ..Options::default()
    };
    let (found, rows) = changed(&small, &large, &options, &workspace);
    assert!(
        (found.only_new_area - 500.0).abs() < 60.0,
        "{}",
        found.only_new_area
    );
    assert_eq!(found.only_old_area, Some(0.0));
    assert!(rows[60 * 61 + 60].changes()[0].is_nan());
    let (found, _) = changed(&large, &small, &options, &workspace);
    let old = found.only_old_area.unwrap();
    assert!((old - 500.0).abs() < 60.0, "{old}");
    assert_eq!(found.significant, 0);
}

#[test]
fn a_new_house_is_its_volume() {
    let folder = tempfile::tempdir().unwrap();
    let workspace = Workspace::for_tests(2).unwrap();
    // Another house, 12 away, is there at both times: no wall has moved from one to the other.
    let house = |x: f64, from: f64| if x > from && x < from + 8.0 { 1.0 } else { 0.0 };
    let at = |y: f64| if y > 10.0 && y < 20.0 { 1.0 } else { 0.0 };
    let old = surface(&folder.path().join("old.ply"), 40.0, 161, |x, y| {
        6.0 * house(x, 5.0) * at(y)
    });
    let new = surface(&folder.path().join("new.ply"), 40.0, 201, |x, y| {
        6.0 * (house(x, 5.0) + house(x, 25.0)) * at(y)
    });
    let (found, rows) = changed(&old, &new, &Options::default(), &workspace);
    // The grid makes a wall half a step thick.
    assert!(
        (found.gained / 480.0 - 1.0).abs() < 0.05,
        "{}",
        found.gained
    );
    assert!(found.lost < 1.0, "{}", found.lost);
    // The walls of the other house lie a part of a step elsewhere, which is significant without noise.
    let house = found.areas[0];
    assert!(
        (house.gained / found.gained - 1.0).abs() < 0.01,
        "{house:?}"
    );
    let roof = rows[75 * 201 + 145].changes()[0];
    assert!((roof - 6.0).abs() < 1e-6, "{roof}");
    // No wall has moved farther than to the ground below an edge of the roof.
    let largest = rows.iter().map(|row| row.changes()[0]).fold(0.0, f32::max);
    assert!(largest < 12.0, "{largest}");
    assert!(found.only_new_area > 50.0, "{}", found.only_new_area);
}

#[test]
fn threads_and_memory_do_not_matter() {
    let folder = tempfile::tempdir().unwrap();
    let ground = |seed: f64| move |x: f64, y: f64| seed * 0.1 + noise(x, y, 0.2, seed);
    let old = surface(&folder.path().join("old.ply"), 30.0, 121, ground(1.0));
    let new = surface(&folder.path().join("new.ply"), 30.0, 101, ground(2.0));
    let one = |threads| {
        let workspace = Workspace::for_tests(threads).unwrap();
        changed(&old, &new, &Options::default(), &workspace)
    };
    let (found, rows) = one(1);
    let (other, others) = one(3);
    assert_eq!(format!("{found:?}"), format!("{other:?}"));
    let bytes = |rows: &[ChangeRow]| bytemuck::cast_slice::<_, u8>(rows).to_vec();
    assert!(bytes(&rows) == bytes(&others));
    assert!(found.significant > 0);
}
