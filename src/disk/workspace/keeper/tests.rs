//! Rounds of syncing, and what they let go.

use super::*;

fn keeper(folder: &std::path::Path, round: Duration) -> (Keeper, Arc<IoCounters>) {
    let (io, journal) = (Arc::new(IoCounters::default()), folder.join("journal"));
    let journal = File::create(journal).unwrap();
    let keeper = Keeper::every(round, Arc::new(journal), folder, io.clone());
    (keeper.unwrap(), io)
}

fn file(folder: &std::path::Path) -> Arc<Kept> {
    let path = folder.join("file");
    File::create(&path).unwrap();
    Arc::new(Kept::new(path))
}

fn wait_until(mut there: impl FnMut() -> bool) {
    while !there() {
        std::thread::sleep(Duration::from_millis(1));
    }
}

const NEVER: Duration = Duration::from_secs(1 << 20);

#[test]
fn after_something_could_not_be_synced_no_file_is_deleted() {
    let folder = tempfile::tempdir().unwrap();
    let (keeper, _) = keeper(folder.path(), NEVER);
    let kept = file(folder.path());
    keeper.check().unwrap();
    // A folder is no file.
    let lost = Arc::new(Kept::new(folder.path().join("lost")));
    std::fs::create_dir(&lost.path).unwrap();
    keeper.sync_later(&lost);
    keeper
        .delete([Leaving(kept.clone(), 0)].into_iter())
        .unwrap();
    wait_until(|| keeper.check().is_err());
    let said = keeper.check().unwrap_err().to_string();
    let expected = format!("{}: cannot sync: ", lost.path.display());
    assert!(said.starts_with(&expected), "{said}");
    let fresh = Arc::new(Kept::new(folder.path().join("journal")));
    fresh.made();
    assert!(keeper.delete([Leaving(fresh, 0)].into_iter()).is_err());
    drop(keeper);
    assert!(kept.path.exists() && folder.path().join("journal").exists());
}

/// Elsewhere pipes are in no folder.
#[cfg(unix)]
#[test]
fn a_file_that_was_replaced_by_a_pipe_cannot_be_synced() {
    use rustix::fs::{CWD, FileType, Mode, mknodat};
    let folder = tempfile::tempdir().unwrap();
    let (keeper, _) = keeper(folder.path(), NEVER);
    let (kept, other) = (file(folder.path()), folder.path().join("other"));
    std::fs::remove_file(&kept.path).unwrap();
    let (mode, kind) = (Mode::RUSR | Mode::WUSR, FileType::Fifo);
    mknodat(CWD, &kept.path, kind, mode, 0).unwrap();
    File::create(&other).unwrap();
    keeper.sync_later(&kept);
    keeper
        .delete([Leaving(Arc::new(Kept::new(other.clone())), 0)].into_iter())
        .unwrap();
    wait_until(|| keeper.check().is_err() || !other.exists());
    let said = keeper.check().unwrap_err().to_string();
    let expected = format!("{}: cannot sync: not a regular file", kept.path.display());
    assert_eq!(said, expected);
}

#[test]
fn a_file_that_may_have_been_synced_goes_without_waiting_for_a_round() {
    let folder = tempfile::tempdir().unwrap();
    let (keeper, io) = keeper(folder.path(), NEVER);
    let file = file(folder.path());
    io.grow_scratch(7);
    keeper
        .delete([Leaving(file.clone(), 7)].into_iter())
        .unwrap();
    wait_until(|| !file.path.exists() && io.scratch() == 0);
}

#[test]
fn a_file_is_deleted_at_once_until_it_was_synced() {
    for synced in [false, true] {
        let folder = tempfile::tempdir().unwrap();
        let round = Duration::from_millis(if synced { 1 } else { 1 << 40 });
        let (keeper, _) = keeper(folder.path(), round);
        let file = file(folder.path());
        file.made();
        keeper.sync_later(&file);
        keeper.sync_later(&file);
        if synced {
            wait_until(|| file.state.load(Ordering::Acquire) == SYNCED);
        }
        let deleting = lock(&keeper.deleting);
        keeper
            .delete([Leaving(file.clone(), 0)].into_iter())
            .unwrap();
        assert_eq!(file.path.exists(), synced);
        drop(deleting);
        wait_until(|| !file.path.exists());
    }
}

#[test]
fn nothing_is_deleted_after_the_run() {
    for _ in 0..200 {
        let folder = tempfile::tempdir().unwrap();
        let (keeper, _) = keeper(folder.path(), NEVER);
        let file = file(folder.path());
        keeper
            .delete([Leaving(file.clone(), 0)].into_iter())
            .unwrap();
        drop(keeper);
        File::create(&file.path).unwrap();
        std::thread::sleep(Duration::from_micros(200));
        assert!(file.path.exists());
    }
}
