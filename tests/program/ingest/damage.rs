//! Damaged files are refused with the place of the damage, without a panic.

use crate::ingest::bench::{Bench, cloud, frames, ply, positions, write_las};
use crate::ingest::formats::{e57, pcd, ptx};
use ::e57::RecordDataType;
use outcrop::Error;

#[test]
fn files_that_lie_or_end_early_are_refused_with_the_place() {
    let bench = Bench::new();
    let las = bench.path("a.las");
    write_las(&las, (1, 2), 0, (0.01, [0.0; 3]), &cloud(100, 1), false);
    let good = std::fs::read(&las).unwrap();
    let error = bench.error(bench.write("cut.las", &good[..good.len() - 30]));
    assert!(error.contains("found 100 points") && error.contains("at most the 98 records"));
    let patched = |at: usize, bytes: &[u8]| {
        let mut copy = good.clone();
        copy[at..at + bytes.len()].copy_from_slice(bytes);
        bench.write("patched.las", copy)
    };
    let error = bench.error(patched(139, &0f64.to_le_bytes()));
    assert!(
        error.contains("y scale factor at byte 139: found 0e0"),
        "{error}"
    );
    let error = bench.error(patched(171, &f64::NAN.to_le_bytes()));
    assert!(error.contains("z offset at byte 171: found NaN"), "{error}");
    let spool = bench.read(&[patched(107, &0u32.to_le_bytes())]).unwrap();
    assert_eq!((spool.points(), spool.stats().warnings.len()), (100, 1));
    let spool = bench.read(&[patched(107, &60u32.to_le_bytes())]).unwrap();
    assert_eq!(spool.points(), 60);
    assert!(spool.stats().warnings[0].contains("40 records after"));
    for (name, text, says) in [
        ("a.pts", "5\n1 2 3\n4 5 6\n", "count line: found 5 points"),
        (
            "a.obj",
            "v 1 2 3\nv 4 5 6\n",
            "found OBJ, which is not read",
        ),
        ("b.las", "1 2 3\n4 5 6\n", "no signature \"LASF\""),
        ("c.xyz", "\u{0}\u{1}", "binary data"),
        (
            "d.ply",
            "ply\nformat ascii 1.0\nelement vertex 2\n",
            "the end of the file",
        ),
    ] {
        let error = bench.error(bench.write(name, text));
        assert!(error.contains(says), "{error}");
    }
}

#[test]
fn no_damage_makes_it_panic() {
    let bench = Bench::new();
    let points = cloud(300, 10);
    let mut files = vec![ply("binary_big_endian", "double", true, &[[1.0; 3]; 40])];
    for (format, kind) in [(1, "las"), (3, "laz"), (5, "laz"), (10, "laz")] {
        let path = bench.path(&format!("a{format}.{kind}"));
        write_las(&path, (1, 4), format, (0.01, [0.0; 3]), &points, false);
        files.push(std::fs::read(path).unwrap());
    }
    let mut state = 11u64;
    let mut next = |limit: usize| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 33) as usize % limit
    };
    let eighths: Vec<[f64; 3]> = (0..40).map(|i| [f64::from(i) / 8.0; 3]).collect();
    for body in pcd::BODIES {
        files.push(pcd::file(body, ("F", "4"), &eighths));
    }
    files.push(std::fs::read(&ptx::scans(&bench)[1]).unwrap());
    let scans = [
        e57::with_states(),
        e57::cartesian(&RecordDataType::F64, &eighths),
    ];
    files.push(std::fs::read(e57::write(&bench, "a.e57", &scans)).unwrap());
    for file in &files {
        for round in 0..400 {
            let mut copy = file.clone();
            let at = if round % 2 == 0 {
                next(copy.len().min(600))
            } else {
                next(copy.len())
            };
            let until = copy.len().min(at + 1 + next(12));
            let fill = [0xff, 0x00, next(256) as u8][round % 3];
            copy[at..until].fill(fill);
            if round % 7 == 0 {
                copy.truncate(at);
            }
            // Otherwise hardly any damage would get past the checksums.
            if copy.starts_with(b"ASTM-E57") && round % 5 > 0 {
                e57::seal(&mut copy);
            }
            let path = bench.write("damaged", &copy);
            if let Ok(spool) = bench.read(&[path])
                && let Ok(lattice) = spool.choose_lattice(1)
            {
                assert_eq!(
                    positions(&bench, &spool, &lattice).len() as u64,
                    spool.points()
                );
            }
        }
    }
}

#[test]
fn a_damaged_spool_is_noticed() {
    let bench = Bench::new();
    let path = bench.path("a.las");
    write_las(&path, (1, 2), 0, (0.01, [0.0; 3]), &cloud(20_000, 1), false);
    let spool = bench.read(&[path]).unwrap();
    let lattice = spool.choose_lattice(0).unwrap();
    let scratch = std::fs::read_dir(bench.path("scratch"))
        .unwrap()
        .next()
        .unwrap()
        .unwrap();
    let file = std::fs::read_dir(scratch.path())
        .unwrap()
        .next()
        .unwrap()
        .unwrap()
        .path();
    let good = std::fs::read(&file).unwrap();
    for at in [2, 6, 9, 13, 500, good.len() - 1] {
        let mut copy = good.clone();
        copy[at] ^= 0x10;
        std::fs::write(&file, copy).unwrap();
        let error = spool
            .for_each(&bench.workspace, &lattice, |_| Ok(()))
            .unwrap_err();
        assert!(matches!(error, Error::Corrupt { .. }), "byte {at}: {error}");
    }
    std::fs::write(&file, &good[..good.len() / 2]).unwrap();
    let error = spool
        .par_for_frames(&bench.workspace, 2, &lattice, &frames(&spool), |_| Ok(()))
        .unwrap_err();
    assert!(
        error.to_string().contains("scratch file damaged"),
        "{error}"
    );
    spool.release(&bench.workspace).unwrap();
    assert!(!file.exists());
}

#[test]
fn no_points_and_cancelling_are_errors() {
    let bench = Bench::new();
    let path = bench.path("a.laz");
    write_las(&path, (1, 4), 6, (0.01, [0.0; 3]), &[], false);
    let spool = bench.read(std::slice::from_ref(&path)).unwrap();
    assert!(matches!(
        spool.choose_lattice(0),
        Err(Error::Degenerate { .. })
    ));
    bench.workspace.cancel.cancel();
    assert!(matches!(bench.read(&[path]), Err(Error::Cancelled)));
}
