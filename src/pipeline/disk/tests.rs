use super::*;

const MILLION: Known = Known {
    read: 1_000_000,
    spool: 12_000_000,
    decompressed: 0,
    points: 1_000_000,
    values: 0,
    scanner: 0,
    normal: 0,
    double: Some(false),
    moved: None,
    text: None,
};

#[test]
fn more_is_known_later() {
    let params = Params::default();
    let output = Files::of(Path::new("mesh.ply"));
    let first = MILLION.estimate(&params, output);
    let moved = |moved| {
        Known {
            moved: Some(moved),
            ..MILLION
        }
        .estimate(&params, output)
    };
    assert!(moved(false).scratch < first.scratch && first.scratch < moved(true).scratch);
    assert!(first.together >= first.scratch.max(first.output));
    let double = Known {
        double: Some(true),
        ..MILLION
    }
    .estimate(&params, output);
    // "double" is one letter longer than "float", three times.
    assert_eq!(double.output - first.output, 12_000_003);
}

#[test]
fn limits_of_formats_are_refused_if_certain_and_told_if_likely() {
    let params = Params::default();
    let fits = |millions: u64, name: &str| {
        let points = millions * 1_000_000;
        let known = Known { points, ..MILLION };
        known.fits(&params, Path::new(name), 0.5)
    };
    // A point has about 36 bytes in GLB.
    assert!(fits(110, "mesh.glb").unwrap().is_none());
    for millions in [130, 230] {
        let told = fits(millions, "mesh.glb").unwrap().unwrap();
        assert!(matches!(
            told,
            Error::TooLarge {
                finished: false,
                ..
            }
        ));
        assert!(!told.can_resume());
    }
    assert!(matches!(fits(250, "mesh.glb"), Err(Error::TooLarge { .. })));
    assert!(fits(4000, "mesh.ply").unwrap().is_none());
    assert!(fits(3000, "mesh.stl").unwrap().is_some());
}

#[test]
fn a_compressed_mesh_takes_less() {
    let estimate = |name| MILLION.estimate(&Params::default(), Files::of(Path::new(name)));
    let (plain, compressed) = (estimate("mesh.ply"), estimate("mesh.ply.zst"));
    assert_eq!(plain.scratch, compressed.scratch);
    assert!(compressed.output * 2 > plain.output && compressed.output * 5 < plain.output * 3);
    assert!(compressed.together < plain.together);
}

#[test]
fn a_mesh_that_is_cut_takes_more() {
    let scratch = |split, normals, smooth| {
        let params = Params {
            split,
            normals,
            relax: 0,
            smooth,
            ..Params::default()
        };
        let estimate = MILLION.estimate(&params, Files::of(Path::new("mesh.ply")));
        (estimate.scratch, estimate.together - estimate.output)
    };
    let (whole, writing) = scratch(None, false, Smooth::Rounds(0));
    let (cut, of_cut) = scratch(Some(10.0), false, Smooth::Rounds(0));
    let (turned, of_turned) = scratch(Some(10.0), true, Smooth::Rounds(0));
    assert!(whole <= cut && cut < turned);
    assert!(writing < of_cut && of_cut < of_turned);
}

#[test]
fn a_header_cannot_claim_more_than_its_file_holds() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cloud.ply");
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 1000000000000\n\
        property float x\nproperty float y\nproperty float z\nend_header\n";
    std::fs::write(&path, [header.as_bytes(), &[0; 1200]].concat()).unwrap();
    let known = Known::from_headers(&[path], &Selection::default()).ok();
    assert!(known.is_none_or(|known| known.points < 200), "{known:?}");
    let nothing = [folder.path().join("nothing")];
    let (known, said) = Known::or_warning(&nothing, &Selection::default());
    assert!(known.is_none());
    assert!(said.is_some_and(|said| said.contains("nothing: cannot open")));
}

/// An uncompressed LAS 1.2 file of 100 points with steps of 1 cm.
fn las(largest: f64) -> Vec<u8> {
    let mut bytes = vec![0; 227 + 100 * 20];
    bytes[..4].copy_from_slice(b"LASF");
    bytes[24..26].copy_from_slice(&[1, 2]);
    bytes[94..96].copy_from_slice(&227u16.to_le_bytes());
    bytes[96..100].copy_from_slice(&227u32.to_le_bytes());
    bytes[105..107].copy_from_slice(&20u16.to_le_bytes());
    bytes[107..111].copy_from_slice(&100u32.to_le_bytes());
    let numbers = [(131, 0.01), (139, 0.01), (147, 0.01), (179, largest)];
    for (at, number) in numbers {
        bytes[at..at + 8].copy_from_slice(&f64::to_le_bytes(number));
    }
    bytes
}

#[test]
fn headers_tell_the_precision_of_the_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    let near = file("near.las", &las(900.0));
    let far = file("far.las", &las(900_000.0));
    let broken = file("broken.las", &las(f64::NAN));
    let text = file("text.xyz", b"1.25 2.5 3\n4 5.5 6\n");
    let double = |paths: &[&PathBuf]| {
        let paths: Vec<PathBuf> = paths.iter().map(|path| (*path).clone()).collect();
        Known::from_headers(&paths, &Selection::default())
            .unwrap()
            .double
    };
    assert_eq!(double(&[&near]), Some(false));
    assert_eq!(double(&[&far]), Some(true));
    assert_eq!(double(&[&near, &far]), Some(true));
    assert_eq!(double(&[&broken]), None);
    assert_eq!(double(&[&text]), None);
}

#[test]
fn what_is_made_of_the_whole_mesh_takes_room_beside_it() {
    let whole = Files::of(Path::new(".whole.ply"));
    let made = Files {
        made: Some(Path::new("small.ply")),
        ..whole
    };
    let params = |triangles| Params {
        triangles,
        ..Params::default()
    };
    let of = |triangles, files| MILLION.estimate(&params(triangles), files);
    let plain = of(None, whole);
    let closed = of(None, made);
    assert_eq!(closed.scratch, plain.scratch);
    assert_eq!(closed.output, 2 * plain.output);
    let small = of(Some(100_000), made);
    // 50 000 vertices and 100 000 triangles, and a header.
    assert!((1_900_000..1_901_000).contains(&(small.output - plain.output)));
    assert!(small.scratch > 5 * plain.output && small.scratch < 6 * plain.output);
    assert_eq!(small.together, small.scratch + small.output);
    let memory = 90 << 20;
    let tight = of(Some(100_000), Files { memory, ..made });
    assert!(tight.scratch > 9 * plain.output);
    let tiles = Files {
        tiles: true,
        ..whole
    };
    assert!(of(None, tiles).scratch > 2 * plain.output);
}
