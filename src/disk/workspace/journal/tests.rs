use super::super::place::Place;
use super::*;

fn records() -> Vec<Record> {
    let put = |section| Put {
        file: "cells.own".into(),
        section,
        place: Place {
            segment: 2,
            offset: 1 << 40,
            bytes: 77,
            records: 3,
            crc: 0xdead_beef,
        },
    };
    vec![
        Record::Manifest(b"{}".to_vec()),
        Record::Attempt(3),
        Record::Begin("cells#0".into()),
        Record::Unit {
            step: "cells#0/tile#0".into(),
            unit: 9,
            after: 3,
            puts: vec![put(1), put(2)],
            payload: Vec::new(),
        },
        Record::End {
            step: "cells#0/tile#0".into(),
            units: 10,
            files: vec!["cells.own".into()],
        },
        Record::Deleted("points".into()),
    ]
}

#[test]
fn a_torn_or_damaged_end_is_cut_off() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(NAME);
    let journal = Journal::create(&path).unwrap();
    let mut ends = vec![MAGIC.len() as u64];
    for record in records() {
        journal.append(record).unwrap();
        ends.push(lock(&journal.end).bytes);
    }
    let whole = std::fs::read(&path).unwrap();
    let read_back = || {
        let mut found = Vec::new();
        let end = read(&path, None, |entry| {
            found.push(entry.record.clone());
            true
        });
        let (end, count) = end.unwrap().unwrap();
        assert_eq!(count as usize, found.len());
        (found, end)
    };
    assert_eq!(read_back(), (records(), whole.len() as u64));
    for cut in MAGIC.len()..whole.len() {
        std::fs::write(&path, &whole[..cut]).unwrap();
        let count = ends.partition_point(|end| *end <= cut as u64) - 1;
        assert_eq!(read_back(), (records()[..count].to_vec(), ends[count]));
    }
    for at in MAGIC.len()..whole.len() {
        let mut damaged = whole.clone();
        damaged[at] ^= 4;
        std::fs::write(&path, &damaged).unwrap();
        let count = ends.partition_point(|end| *end <= at as u64) - 1;
        assert_eq!(read_back().1, ends[count], "a flip at {at}");
    }
}

#[test]
fn a_payload_is_found_again() {
    let folder = tempfile::tempdir().unwrap();
    let journal = Journal::create(&folder.path().join(of_worker(4))).unwrap();
    for unit in 0..3 {
        let payload = vec![unit as u8; 200 * unit as usize];
        let (step, puts) = ("a".into(), Vec::new());
        let record = Record::Unit {
            step,
            unit,
            after: 7,
            puts,
            payload,
        };
        journal.append(record).unwrap();
    }
    let mut found = Vec::new();
    let each = |entry: &Entry<'_>| {
        assert_eq!(entry.at, 14);
        found.push(entry.payload);
        true
    };
    let path = path_of(folder.path(), Some(4));
    assert!(read(&path, Some(4), each).unwrap().is_some());
    for (unit, (_, offset, bytes)) in (0..).zip(found) {
        assert_eq!(
            payload(&path, &open(&path).unwrap(), offset, bytes).unwrap(),
            vec![unit; 200 * unit as usize]
        );
    }
    assert_eq!(
        (worker("journal.4"), worker("journal"), worker("journal.04")),
        (Some(4), None, None)
    );
}
