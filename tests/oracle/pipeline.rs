//! The pipeline's mesh equals the reference's, triangle for triangle, on many small difficult clouds, for
//! every block size, tile size, page size and number of threads.

mod compare;
mod seen;

use crate::reference::weighing::Weighing;
use crate::reference::{self, Counts, Given, Settings, clouds};
use compare::{CUTS, at_origin, compare, compare_seen, compare_with};
use outcrop::Params;
use seen::Seen;

/// Counts over all runs.
#[derive(Debug, Default)]
struct Reached {
    rounds: u32,
    kept: usize,
    on_a_line: usize,
    one_sided: usize,
    met: Weighing,
    merges_reverted: usize,
    openings: usize,
    spanned: usize,
    partly_zipped: usize,
    clipped_whole: usize,
    left_open: usize,
    left_open_clipped: usize,
    between: usize,
    wide: usize,
}

impl Reached {
    fn add(&mut self, counts: &Counts) {
        self.rounds = self.rounds.max(counts.rounds);
        self.kept += counts.kept;
        self.on_a_line += counts.flat + counts.flat_candidates;
        self.one_sided += counts.one_sided;
        self.met.add(&counts.met);
        self.merges_reverted += counts.merges_reverted;
        self.openings += counts.holes.openings;
        self.spanned += counts.holes.spanned;
        self.partly_zipped += counts.holes.partly;
        self.clipped_whole += counts.holes.clipped_whole;
        self.left_open += counts.holes.left_open;
        self.left_open_clipped += counts.holes.left_open_clipped;
        self.between += counts.holes.between;
        self.wide += counts.holes.wide;
    }
}

fn run(seeds: std::ops::Range<u64>, settings: impl Fn(u64) -> Settings) -> Reached {
    let mut reached = Reached::default();
    for seed in seeds {
        for (name, points) in clouds::one_of_each(seed) {
            let settings = settings(seed);
            let moves = settings.smooth + settings.relax > 0;
            if moves && points.iter().flatten().any(|x| *x >= 1 << 19) {
                continue;
            }
            let counts = compare(&format!("{name}, seed {seed}"), &points, &settings, &CUTS);
            reached.add(&counts);
        }
    }
    reached
}

#[test]
fn one_block() {
    run(0..3, |_| Settings::default());
}

#[test]
fn small_blocks() {
    run(10..16, |seed| Settings {
        block: [40, 7, 100, 15][seed as usize % 4],
        ..Settings::default()
    });
}

#[test]
fn without_repair() {
    run(20..22, |_| Settings {
        block: 25,
        repair: false,
        ..Settings::default()
    });
}

#[test]
fn few_neighbors_and_fixed_radius() {
    run(30..34, |seed| Settings {
        neighbors: [5, 8, 12][seed as usize % 3],
        radius: [
            reference::Radius::Percent(5.0),
            reference::Radius::Percent(40.0),
        ][seed as usize % 2],
        block: 33,
        min_component: 2,
        ..Settings::default()
    });
}

#[test]
fn smoothed() {
    run(40..44, |seed| Settings {
        smooth: 1 + seed as u32 % 2,
        edges: seed >= 42,
        neighbors: [30, 10][seed as usize / 2 % 2],
        block: 50,
        ..Settings::default()
    });
}

#[test]
fn holes_of_few_edges_and_wide_angles() {
    run(50..53, |seed| Settings {
        max_hole_edges: 3 + seed as usize % 5,
        cos_max_angle: Params {
            max_angle: 120.0,
            ..Params::paper()
        }
        .cos_max_angle(),
        block: 60,
        ..Settings::default()
    });
}

#[test]
fn robust() {
    let reached = run(100..112, |seed| Settings {
        relax: seed as u32 % 4,
        auto: seed.is_multiple_of(2),
        neighbors: [30, 12][seed as usize / 6 % 2],
        block: [40, 7, 100, 15, 25, 65_536][seed as usize % 6],
        patch: [4, 256, 16, 7, 10][seed as usize % 5],
        cluster: [2, 1024, 40, 12][seed as usize % 4],
        min_component: [1, 3, 10][seed as usize % 3],
        max_hole_edges: [500, 500, 0, 12, 4][seed as usize % 5],
        max_edge: [8.0, 11.0, f64::INFINITY][seed as usize / 2 % 3],
        max_fill: [8.0, 2.0, f64::INFINITY, 3.0, 1.2][seed as usize / 3 % 5],
        ..Settings::robust()
    });
    let parts = [
        reached.kept,
        reached.on_a_line,
        reached.one_sided,
        reached.merges_reverted,
    ];
    let mended = [
        reached.partly_zipped,
        reached.clipped_whole,
        reached.spanned,
        reached.left_open,
        reached.left_open_clipped,
        reached.between,
        reached.wide,
    ];
    let all = parts.iter().chain(&mended).all(|n| *n > 0);
    assert!(reached.rounds == 3 && all, "parts not reached: {reached:?}");
    // The remaining cases are reached with other triples, see `stitch.rs`, and by bands.
    let but = [
        "folded",
        "faced",
        "crowded",
        "flagged elsewhere",
        "cut inside",
        "cut between",
        "looked back",
        "under sky",
        "turned by sky",
    ];
    assert_eq!(reached.met.missing(&but), [""; 0], "{reached:?}");
}

#[test]
fn robust_and_seen_by_scanners() {
    let mut faced = 0;
    for seed in 120..124 {
        for (name, points) in clouds::one_of_each(seed) {
            if points.iter().flatten().any(|x| *x >= 1 << 19) {
                continue;
            }
            let settings = Settings {
                relax: seed as u32 % 4,
                neighbors: [30, 12][seed as usize % 2],
                block: [40, 65_536, 100, 250][seed as usize % 4],
                patch: [256, 16][seed as usize % 2],
                cluster: [1024, 12][seed as usize / 2 % 2],
                min_component: 3,
                ..Settings::robust()
            };
            let name = format!("{name}, seed {seed}");
            let counts = compare_seen(&name, &points, Some(seed), &settings, &CUTS);
            faced += counts.met.faced;
        }
    }
    assert!(faced > 300, "{faced}");
}

#[test]
fn facing_a_side() {
    let mut faced = 0;
    for seed in 130..133 {
        for (name, points) in clouds::one_of_each(seed) {
            if points.iter().flatten().any(|x| *x >= 1 << 19) {
                continue;
            }
            let settings = Settings {
                relax: seed as u32 % 4,
                neighbors: [30, 12][seed as usize % 2],
                block: [65_536, 100, 40][seed as usize % 3],
                patch: [256, 16][seed as usize % 2],
                min_component: 3,
                facing: [
                    reference::outside::Facing::In,
                    reference::outside::Facing::Out,
                    reference::outside::Facing::At([-20, 50, 300]),
                ][seed as usize % 3],
                ..Settings::robust()
            };
            let name = format!("{name}, seed {seed}");
            faced += compare(&name, &points, &settings, &CUTS).met.faced;
        }
    }
    assert!(faced > 300, "{faced}");
}

#[test]
fn points_with_normals() {
    let mut faced = 0;
    for seed in 140..152 {
        let kind = |name| {
            clouds::KINDS
                .iter()
                .position(|kind| kind.0 == name)
                .unwrap()
        };
        let large = |name| (name, clouds::cloud(kind(name), 500, seed));
        let more = ["sphere", "noisy sphere"].map(large);
        for (name, points) in clouds::one_of_each(seed).into_iter().chain(more) {
            if points.iter().flatten().any(|x| *x >= 1 << 19) {
                continue;
            }
            let usual = match seed % 3 {
                0 => Settings::default(),
                _ => Settings::robust(),
            };
            let settings = Settings {
                given: [Given::Auto, Given::Use][seed as usize % 2],
                relax: if usual.robust { seed as u32 % 4 } else { 0 },
                neighbors: [30, 12][seed as usize % 2],
                block: [65_536, 40, 100, 250][seed as usize % 4],
                min_component: 3,
                ..usual
            };
            let points = at_origin(&points);
            let seen = match seed % 5 {
                0 if usual.robust => Seen::some(&points, seed),
                _ => Seen::default(),
            };
            let seen = seen.with_normals(&points, seed);
            let name = format!("{name}, seed {seed}");
            let counts = compare_with(&name, &points, &seen, &settings, &CUTS);
            // Of the others some face scanners.
            faced += if seed % 5 > 0 { counts.met.faced } else { 0 };
        }
    }
    assert!(faced > 25, "{faced}");
}

#[test]
fn robust_and_smoothed() {
    run(80..82, |seed| Settings {
        smooth: 1,
        auto: false,
        relax: 1 + seed as u32 % 2,
        neighbors: 12,
        block: [50, 90][seed as usize % 2],
        patch: 16,
        cluster: 10,
        ..Settings::robust()
    });
}

/// Junctions of three sheets, and twisted bands that are one flat patch.
fn walls_and_bands(seed: u64, settings: Settings, reached: &mut Reached) {
    let cloud = |name: &str, size: usize| {
        let kind = clouds::KINDS.iter().position(|kind| kind.0 == name);
        clouds::cloud(kind.expect("a kind"), size, seed)
    };
    let settings = Settings {
        neighbors: 12,
        ..settings
    };
    let walls = cloud("walls", 1000);
    reached.add(&compare("walls", &walls, &settings, &CUTS));
    let settings = Settings {
        neighbors: 8,
        relax: 0,
        block: 65_536,
        patch: 256,
        ..settings
    };
    let bands = cloud("moebius band", 250);
    reached.add(&compare("band", &bands, &settings, &CUTS));
}

/// Several patches, of which some are relaxed.
#[test]
fn robust_on_torn_sheets_and_doors() {
    let (mut reached, mut some_stayed) = (Reached::default(), 0);
    for seed in 0..6 {
        let points = clouds::half_rough(seed, 1000);
        let settings = Settings {
            smooth: (seed == 3) as u32,
            relax: 1 + seed as u32 % 3,
            auto: seed < 2,
            neighbors: [12, 20][seed as usize % 2],
            block: [30, 200, 65_536][seed as usize % 3],
            patch: [256, 8, 16][seed as usize % 3],
            cluster: [1024, 5, 30, 1][seed as usize % 4],
            ..Settings::robust()
        };
        let counts = compare("half rough", &points, &settings, &CUTS);
        some_stayed += usize::from(0 < counts.moved && counts.moved < points.len());
        reached.add(&counts);
        let settings = Settings {
            neighbors: 8,
            ..settings
        };
        reached.add(&compare("door", &clouds::door(seed), &settings, &CUTS));
        let settings = Settings {
            neighbors: 30,
            smooth: 0,
            ..settings
        };
        let pillars = clouds::pillars(seed);
        reached.add(&compare("pillars", &pillars, &settings, &CUTS));
        let settings = Settings {
            max_hole_edges: [500, 20][seed as usize % 2],
            max_fill: [8.0, 2.0][seed as usize % 2],
            ..settings
        };
        let hole = clouds::wide_hole(seed);
        reached.add(&compare("wide hole", &hole, &settings, &CUTS));
        walls_and_bands(seed, settings, &mut reached);
    }
    let parts = [
        reached.openings,
        reached.kept,
        reached.met.folded,
        reached.met.cut_inside,
        reached.met.votes,
        reached.met.under_sky,
        reached.met.turned_by_sky,
        reached.met.left_free,
        reached.partly_zipped,
        reached.left_open,
    ];
    let parts = parts.iter().all(|n| *n > 0);
    assert!(parts && some_stayed > 1, "{some_stayed} {reached:?}");
}
