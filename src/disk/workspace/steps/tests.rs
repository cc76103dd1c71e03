use super::super::memory::{MINIMUM_BUDGET, MemoryPool};
use super::super::progress::{Cancel, Silent};
use super::super::{Folder, Found};
use super::*;
use std::sync::Arc;

/// The workspace of the next attempt of a run.
fn attempt(path: &Path) -> Workspace {
    let folder = match Folder::find(path).unwrap() {
        Found::Run(folder) => folder,
        _ => Folder::create(path, b"{}".to_vec()).unwrap(),
    };
    let memory = MemoryPool::new(MINIMUM_BUDGET).unwrap();
    Workspace::resumable(folder, memory, 1, Arc::new(Silent), Cancel::new()).unwrap()
}

/// Results of two steps, or those of an earlier attempt.
fn results<A, B>(workspace: &Workspace, a: A, b: B) -> Result<(A, Vec<B>)>
where
    A: Serialize + DeserializeOwned,
    B: Serialize + DeserializeOwned + Send + Sync + Copy,
{
    let (mut a, mut all) = (Some(a), Vec::new());
    let made = workspace.once("one", |_| Ok(a.take().unwrap()))?;
    let each = |_, found| {
        all.push(found);
        Ok(())
    };
    workspace.units("some", 2, |_| 0, |_| Ok(b), each)?;
    Ok((made, all))
}

#[test]
fn results_of_other_types_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run");
    let first = results(&attempt(&path), (1u32, 2u32), 3u64).unwrap();
    assert_eq!(first, ((1, 2), vec![3, 3]));
    // The same types: what was made counts.
    let again = results(&attempt(&path), (0u32, 0u32), 0u64).unwrap();
    assert_eq!(again, first);
    let refused = |error: Error, expected: &str| {
        // The run can be resumed by the build that began it.
        assert!(error.can_resume());
        let text = error.to_string();
        assert!(text.contains("a result of another type"), "{text}");
        assert!(text.contains(expected), "{text}");
    };
    // The bytes fit these types too.
    let error = results(&attempt(&path), (0u64, 0u16), 0u64).unwrap_err();
    refused(error, "(u64, u16)");
    let error = results(&attempt(&path), (0u32, 0u32), 0i64).unwrap_err();
    refused(error, "i64");
    let again = results(&attempt(&path), (0u32, 0u32), 0u64).unwrap();
    assert_eq!(again, first);
}
