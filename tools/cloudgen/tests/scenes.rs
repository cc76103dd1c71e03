//! Scenes: what is seen lies on the true surface, and the same comes out of the same description.

use std::fs;

use outcrop_cloudgen::{Cloud, Kind, Measuring, Scene, Spots, Triangles, median};

fn cloud(scene: Scene) -> Cloud {
    Cloud::new(Kind::Scene(scene)).points(3000).seed(4)
}

/// The true surface.
fn truth(cloud: &Cloud) -> Triangles {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("truth.ply");
    cloud.write_reference(&path, 1e-4).unwrap();
    let bytes = fs::read(path).unwrap();
    let mesh = outcrop_ply::Mesh::read(bytes.as_slice(), bytes.len() as u64).unwrap();
    Triangles::new(&mesh.vertices, &mesh.triangles)
}

#[test]
fn exact_scenes_lie_on_their_surfaces_and_face_as_they_do() {
    for scene in Scene::ALL {
        let cloud = cloud(scene);
        let (truth, points) = (truth(&cloud), cloud.generator().unwrap());
        let (mut off, mut real, mut against) = (0.0_f64, 0, 0);
        for index in 0..points.len() {
            let Some(exact) = points.exact(index) else {
                continue;
            };
            real += 1;
            let found = truth.nearest(exact.position).unwrap();
            off = off.max(found.distance);
            if scene != Scene::Photo {
                assert_eq!(points.sample(index).position, exact.position, "{scene:?}");
            }
            let cosine: f64 = (0..3).map(|k| found.normal[k] * exact.normal[k]).sum();
            against += u64::from(cosine < 0.0);
        }
        assert!(off < 1e-6, "{scene:?}: {off}");
        assert!(against * 100 < real, "{scene:?}: {against} of {real}");
        let wanted = 3000.0;
        let found = points.len() as f64;
        assert!((found / wanted - 1.0).abs() < 0.1, "{scene:?}: {found}");
        let least = if scene == Scene::Photo || scene == Scene::Strewn {
            0.97
        } else {
            1.0
        };
        assert!(real as f64 >= least * found, "{scene:?}: {real} of {found}");
    }
}

#[test]
fn errors_have_the_size_that_was_asked_for() {
    let errors = |scene, measuring| {
        let points = cloud(scene).measuring(measuring).generator().unwrap();
        let exact: Vec<_> = (0..points.len()).filter_map(|i| points.exact(i)).collect();
        let places: Vec<_> = exact.iter().map(|e| e.position).collect();
        let spots = Spots::new(&places);
        let spacing = median(places.iter().map(|p| spots.spacing(*p, 6)).collect());
        let squares = (0..points.len()).filter_map(|i| {
            let (exact, found) = (points.exact(i)?.position, points.sample(i).position);
            Some(
                (0..3)
                    .map(|k| ((found[k] - exact[k]) / spacing).powi(2))
                    .sum::<f64>(),
            )
        });
        (squares.sum::<f64>() / exact.len() as f64).sqrt()
    };
    let noise = Measuring {
        noise: 0.5,
        ..Measuring::EXACT
    };
    let scan = errors(Scene::EdgedScan, noise);
    assert!((0.45..0.6).contains(&scan), "{scan}");
    let all = errors(Scene::Edged, noise);
    assert!((0.75..0.95).contains(&all), "{all}");
    let registration = Measuring {
        registration: 0.5,
        ..Measuring::EXACT
    };
    let moved = errors(Scene::EdgedScan, registration);
    assert!((0.3..0.7).contains(&moved), "{moved}");
}

#[test]
fn flying_points_are_between_near_and_far() {
    let flying = Measuring {
        flying: 0.01,
        ..Measuring::EXACT
    };
    let cloud = cloud(Scene::StreetScan).measuring(flying);
    let (truth, points) = (truth(&cloud), cloud.generator().unwrap());
    let flying: Vec<u64> = (0..points.len())
        .filter(|i| points.exact(*i).is_none())
        .collect();
    let share = flying.len() as f64 / points.len() as f64;
    assert!((0.005..0.02).contains(&share), "{share}");
    let far = |i: &&u64| truth.nearest(points.sample(**i).position).unwrap().distance > 0.01;
    assert!(flying.iter().filter(far).count() * 2 > flying.len());
}

#[test]
fn equal_descriptions_give_equal_bytes() {
    let folder = tempfile::tempdir().unwrap();
    for scene in [Scene::RoomScan, Scene::FinsScan, Scene::Photo] {
        let noisy = Measuring {
            noise: 0.3,
            registration: 0.2,
            flying: 0.01,
            ratio: None,
        };
        let bytes = |seed| {
            let points = cloud(scene)
                .seed(seed)
                .measuring(noisy)
                .generator()
                .unwrap();
            let paths = ["cloud", "truth", "seen"].map(|n| folder.path().join(format!("{n}.ply")));
            points.write(&paths[0], "ply".parse().unwrap()).unwrap();
            points.write_reference(&paths[1], 1e-4).unwrap();
            points.write_seen(&paths[2]).unwrap();
            paths.map(|path| fs::read(path).unwrap())
        };
        let first = bytes(1);
        assert!(first == bytes(1), "{scene:?}");
        assert!(first[0] != bytes(2)[0], "{scene:?}");
    }
}

#[test]
fn settings_without_a_meaning_are_refused() {
    let plain = Measuring {
        noise: 1.0,
        ..Measuring::EXACT
    };
    assert!(
        Cloud::new(Kind::Torus)
            .measuring(plain)
            .generator()
            .is_err()
    );
    let ratio = |ratio| Measuring {
        ratio: Some(ratio),
        ..Measuring::EXACT
    };
    assert!(
        cloud(Scene::RoomScan)
            .measuring(ratio(2.0))
            .generator()
            .is_err()
    );
    assert!(
        cloud(Scene::ThinPlate)
            .measuring(ratio(-1.0))
            .generator()
            .is_err()
    );
    assert!(
        cloud(Scene::ThinPlate)
            .measuring(ratio(f64::NAN))
            .generator()
            .is_err()
    );
    assert!(cloud(Scene::RoomScan).size(3.0).generator().is_err());
    assert!(cloud(Scene::RoomScan).points(0).generator().is_ok());
}

/// FNV-1a.
fn hash(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

/// The bytes do not depend on the machine: whoever finds others has found a difference.
#[test]
fn bytes_are_these() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cloud.ply");
    let noisy = Measuring {
        noise: 0.3,
        registration: 0.2,
        flying: 0.01,
        ratio: None,
    };
    let scenes = [
        Scene::RoomScan,
        Scene::MobileScan,
        Scene::AirScan,
        Scene::EdgedScan,
    ];
    let found = scenes.map(|scene| {
        let points = cloud(scene).measuring(noisy).generator().unwrap();
        points.write(&path, "ply".parse().unwrap()).unwrap();
        hash(&fs::read(&path).unwrap())
    });
    let expected = [
        0x7a0a_2e09_3522_3155,
        0x1311_a135_369b_d6b8,
        0xe3f0_c599_da5e_ed96,
        0x8718_222e_7457_9592,
    ];
    assert_eq!(found, expected);
}
