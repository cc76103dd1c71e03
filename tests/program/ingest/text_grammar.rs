//! Text of every separator, quote, header, count and name is read as the table that was written, or refused.

use crate::ingest::bench::Bench;
use crate::ingest::recipe::Recipe;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

/// The coordinates that are read, in thousandths, sorted; none if the file is refused.
fn found(bench: &Bench, text: &str) -> Option<Vec<[i64; 3]>> {
    let spool = bench.read(&[bench.write("a.txt", text)]).ok()?;
    let lattice = spool.choose_lattice(0).unwrap();
    let mut all = Vec::new();
    let take = |points: &[[i32; 3]]| {
        let position = |p: &[i32; 3]| lattice.position(*p).map(|v| (v * 1000.0).round() as i64);
        all.extend(points.iter().map(position));
        Ok(())
    };
    spool.for_each(&bench.workspace, &lattice, take).unwrap();
    spool.release(&bench.workspace).unwrap();
    all.sort_unstable();
    Some(all)
}

#[test]
fn text_is_read_as_it_was_written() {
    let bench = Bench::new();
    let mut runner = TestRunner::new(ProptestConfig {
        cases: 1000,
        failure_persistence: None,
        ..ProptestConfig::default()
    });
    let bytes = proptest::collection::vec(any::<u8>(), 18..60);
    let outcome = runner.run(&bytes, |bytes| {
        let recipe = Recipe::of(&bytes).unwrap();
        let text = recipe.text();
        prop_assert_eq!(
            found(&bench, &text),
            recipe.expected(),
            "{}\n{:?}",
            text,
            recipe
        );
        Ok(())
    });
    outcome.unwrap_or_else(|error| panic!("{error}"));
}

/// Neither outcome is rare.
#[test]
fn recipes_are_read_and_refused() {
    let mut random = oorandom::Rand32::new(7);
    let mut outcomes = [0; 2];
    for _ in 0..2000 {
        let bytes: Vec<u8> = (0..30).map(|_| random.rand_u32() as u8).collect();
        let recipe = Recipe::of(&bytes).unwrap();
        outcomes[usize::from(recipe.expected().is_some())] += 1;
    }
    assert!(outcomes.iter().all(|count| *count > 200), "{outcomes:?}");
}
