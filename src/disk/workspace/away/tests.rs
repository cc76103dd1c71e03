//! Processes that share a store in memory.

use super::super::generations::{Opened, Resources, Shard, SharedFolder};
use super::super::journal::Sharing;
use super::super::memory::{MINIMUM_BUDGET, MemoryPool};
use super::*;
use outcrop_platform::FileAt;
use std::collections::BTreeMap;
use std::sync::atomic::AtomicU64;

/// Objects in memory.
#[derive(Debug, Default)]
struct Memory {
    objects: Mutex<BTreeMap<String, Vec<u8>>>,
    requests: AtomicU64,
    fetched: AtomicU64,
    /// Requests to put something new that are done, and whose answers are lost.
    lost: AtomicU64,
}

impl Memory {
    fn with(name: &str, bytes: &[u8]) -> Arc<Self> {
        let store = Arc::new(Self::default());
        lock(&store.objects).insert(name.into(), bytes.to_vec());
        store
    }

    fn names(&self) -> Vec<String> {
        lock(&self.objects).keys().cloned().collect()
    }
}

fn stored((name, bytes): (&String, &Vec<u8>)) -> Stored {
    Stored {
        name: name.clone(),
        bytes: bytes.len() as u64,
        modified: SystemTime::now(),
    }
}

impl Store for Memory {
    fn list(&self, under: &str) -> io::Result<Vec<Stored>> {
        let objects = lock(&self.objects);
        let below = objects.iter().filter(|(name, _)| name.starts_with(under));
        Ok(below.map(stored).collect())
    }

    fn look(&self, name: &str) -> io::Result<Option<Stored>> {
        Ok(lock(&self.objects).get_key_value(name).map(stored))
    }

    fn read(&self, name: &str, range: Range<u64>) -> io::Result<Vec<u8>> {
        self.requests.fetch_add(1, Ordering::Relaxed);
        self.fetched
            .fetch_add(range.end - range.start, Ordering::Relaxed);
        let objects = lock(&self.objects);
        let bytes = objects.get(name).ok_or(ErrorKind::NotFound)?;
        let part = bytes.get(range.start as usize..range.end as usize);
        Ok(part.ok_or(ErrorKind::UnexpectedEof)?.to_vec())
    }

    fn put(&self, name: &str, file: &File, bytes: u64) -> io::Result<()> {
        let mut all = vec![0; bytes as usize];
        file.read_exact_at(&mut all, 0)?;
        lock(&self.objects).insert(name.into(), all);
        Ok(())
    }

    fn put_new(&self, name: &str, bytes: Vec<u8>) -> io::Result<bool> {
        let mut objects = lock(&self.objects);
        if objects.contains_key(name) {
            return Ok(false);
        }
        objects.insert(name.into(), bytes);
        match self.lost.load(Ordering::Relaxed) {
            0 => Ok(true),
            left => {
                self.lost.store(left - 1, Ordering::Relaxed);
                Err(ErrorKind::ConnectionReset.into())
            }
        }
    }

    fn delete(&self, name: &str) -> io::Result<()> {
        lock(&self.objects).remove(name);
        Ok(())
    }

    fn part(&self) -> u64 {
        1 << 20
    }

    fn traffic(&self) -> Traffic {
        Traffic::default()
    }
}

fn process(store: &Arc<Memory>, limit: u64) -> Away {
    Away::new(store.clone(), &std::env::temp_dir(), limit).unwrap()
}

fn content(bytes: usize) -> Vec<u8> {
    (0..bytes as u32)
        .map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8)
        .collect()
}

#[test]
fn parts_are_fetched_once_and_are_those_of_the_object() {
    let all = content(9_000_003);
    let store = Memory::with("a.7", &all);
    let away = process(&store, 1 << 30);
    let path = away.folder().join("a.7");
    let end = all.len() as u64;
    for (offset, count) in [
        (5, 10),
        (3_000_000, 1),
        (262_143, 3),
        (8_999_000, 1003),
        (1, 9_000_002),
    ] {
        let mut bytes = vec![0; count];
        away.read(&path, end, &mut bytes, offset).unwrap();
        assert!(bytes == all[offset as usize..][..count], "{offset} {count}");
    }
    let fetched = store.fetched.load(Ordering::Relaxed);
    assert!(fetched < end + (2 << 20), "{fetched} of {end}");
    let before = store.requests.load(Ordering::Relaxed);
    away.bring(&path, end).unwrap();
    assert_eq!(store.requests.load(Ordering::Relaxed), before);
    assert_eq!(std::fs::read(&path).unwrap(), all);
    away.forget(&path);
    assert!(!path.exists());
    let short = away
        .read(&path, end + 9, &mut [0; 20], end - 10)
        .unwrap_err();
    assert_eq!(short.kind(), ErrorKind::UnexpectedEof);
    let absent = away.read(&away.folder().join("b.1"), 9, &mut [0; 2], 0);
    assert_eq!(absent.unwrap_err().kind(), ErrorKind::NotFound);
}

#[test]
fn copies_take_no_more_than_the_limit() {
    let store = Arc::new(Memory::default());
    let all = content(2 << 20);
    for n in 0..20 {
        lock(&store.objects).insert(format!("a.{n}"), all.clone());
    }
    let away = process(&store, 8 << 20);
    std::thread::scope(|scope| {
        for thread in 0..4 {
            let (away, all) = (&away, &all);
            scope.spawn(move || {
                for step in 0..200 {
                    let path = away
                        .folder()
                        .join(format!("a.{}", (step * 7 + thread) % 20));
                    let offset = (step * 104_729 + thread * 1001) % (2 << 20) - 50;
                    let offset = offset.max(0) as usize;
                    let mut bytes = [0; 50];
                    away.read(&path, 2 << 20, &mut bytes, offset as u64)
                        .unwrap();
                    assert!(bytes == all[offset..][..50]);
                }
            });
        }
    });
    let sizes = std::fs::read_dir(away.folder()).unwrap().flatten();
    let bytes: u64 = sizes.map(|entry| entry.metadata().unwrap().len()).sum();
    assert!(bytes <= (8 << 20) + 4 * (2 << 20), "{bytes}");
}

#[test]
fn what_must_be_new_is_put_once_also_if_an_answer_is_lost() {
    let store = Arc::new(Memory::default());
    let (one, two) = (process(&store, 0), process(&store, 0));
    let put = |away: &Away, text: &str| {
        let from = away.folder().join("journal");
        std::fs::write(&from, text).unwrap();
        let memory = MemoryPool::new(MINIMUM_BUDGET).unwrap();
        away.publish(&from, &away.folder().join("tasks/1/0.done"), &memory)
    };
    store.lost.store(1, Ordering::Relaxed);
    assert!(put(&one, "the work of the first").unwrap());
    assert!(!put(&two, "the work of another one").unwrap());
    assert!(!put(&two, "the work of anybody..").unwrap());
    assert_eq!(
        lock(&store.objects)["tasks/1/0.done"],
        b"the work of the first"
    );
}

#[test]
fn a_process_gives_signs_of_life_while_it_works_and_none_afterwards() {
    let parent = tempfile::tempdir().unwrap();
    let store = Arc::new(Memory::default());
    let mut away = Away::new(store.clone(), parent.path(), 0).unwrap();
    assert_eq!(away.every, BEAT);
    away.every = Duration::from_millis(20);
    let away = Arc::new(away);
    let journal = away.folder().join("tasks/000001/0.0");
    std::fs::create_dir_all(journal.parent().unwrap()).unwrap();
    std::fs::write(&journal, "a journal that has begun").unwrap();
    let begin = std::time::Instant::now();
    assert!(away.claim(&journal).unwrap());
    // Each sign is the same journal, put again.
    for _ in 0..3 {
        lock(&store.objects).clear();
        while store.names().is_empty() {
            assert!(begin.elapsed() < Duration::from_secs(30), "no sign of life");
            std::thread::sleep(Duration::from_millis(1));
        }
        assert_eq!(
            lock(&store.objects)["tasks/000001/0.0"],
            b"a journal that has begun"
        );
    }
    assert!(begin.elapsed() >= 3 * away.every, "too many signs");
    away.end_beat();
    lock(&store.objects).clear();
    std::thread::sleep(5 * away.every);
    assert!(store.names().is_empty());
}

#[test]
fn folders_of_killed_processes_are_removed_and_no_others() {
    let parent = tempfile::tempdir().unwrap();
    let store = Arc::new(Memory::default());
    let alive = Away::new(store.clone(), parent.path(), 0).unwrap();
    let killed = parent.path().join("outcrop-copies-x");
    std::fs::create_dir_all(killed.join("run")).unwrap();
    std::fs::write(killed.join("lock"), "").unwrap();
    let other = Away::new(store, parent.path(), 0).unwrap();
    assert!(!killed.exists() && alive.folder().exists() && other.folder().exists());
    drop((alive, other));
    assert_eq!(std::fs::read_dir(parent.path()).unwrap().count(), 0);
}

#[test]
fn a_run_is_begun_once_and_attempts_have_numbers_of_their_own() {
    let store = Arc::new(Memory::default());
    let shown = Path::new("s3://bucket/run");
    let plan = |run| {
        let sharing = Sharing {
            run,
            shards: 2,
            threads: 1,
            memory: MINIMUM_BUDGET,
            program: 0,
        };
        SharedFolder::create_away(process(&store, 0), shown, b"{}".to_vec(), sharing)
    };
    let absent = SharedFolder::open_away(process(&store, 0), shown).unwrap_err();
    assert!(absent.to_string().contains("s3://bucket/run"), "{absent}");
    plan(1).unwrap();
    assert!(
        plan(2)
            .unwrap_err()
            .to_string()
            .contains("it exists already")
    );
    assert_eq!(store.names(), ["generations/000000", "manifest"]);

    let open = || SharedFolder::open_away(process(&store, 0), shown).unwrap();
    let memory = MemoryPool::new(MINIMUM_BUDGET).unwrap();
    let io = Arc::default();
    let resources = Resources {
        threads: 1,
        memory: &memory,
        io: &io,
    };
    let next = |folder: &SharedFolder| {
        folder
            .begin_next(folder.read(0).unwrap(), &resources)
            .unwrap()
    };
    let (one, two) = (open(), open());
    let Opened::Run(first) = next(&one) else {
        panic!()
    };
    let Opened::Run(second) = next(&two) else {
        panic!()
    };
    assert!(first.first() != second.first());
    assert_eq!(one.advances(&one.read(0).unwrap()).unwrap().count, 2);
    assert_eq!(
        one.shards(&one.read(0).unwrap()).unwrap(),
        [Shard::Empty, Shard::Empty]
    );
    assert!(one.newest().unwrap() == 0 && one.has_begun(0) && !one.has_begun(1));
    assert!(!one.is_left_over());
    one.remove();
    assert!(store.names().is_empty());
    assert!(two.is_left_over());
}
