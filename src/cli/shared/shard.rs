//! The shard of a task: from the command line, or from the index of an array job.

use super::Work;
use outcrop_disk::error::{Error, Result};
use std::path::Path;
use std::str::FromStr;

/// Variables with the index of an array job: Slurm, Kubernetes, AWS Batch, Google Batch.
const INDICES: [&str; 4] = [
    "SLURM_ARRAY_TASK_ID",
    "JOB_COMPLETION_INDEX",
    "AWS_BATCH_JOB_ARRAY_INDEX",
    "BATCH_TASK_INDEX",
];

/// A shard, and the number of shards if it is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wanted {
    /// From 0.
    pub number: u32,
    /// Number of shards.
    pub count: Option<u32>,
}

impl FromStr for Wanted {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let bad = || format!("{text:?} is not a shard like 17 or 17/200");
        let (number, count) = match text.split_once('/') {
            None => (text, None),
            Some((number, count)) => (number, Some(count.parse().map_err(|_| bad())?)),
        };
        let number = number.parse().map_err(|_| bad())?;
        match count {
            Some(count) if number >= count => {
                Err(format!("shards are numbered from 0 to {}", count - 1))
            }
            count => Ok(Self { number, count }),
        }
    }
}

/// The shard of a task.
pub fn chosen(args: &Work) -> Result<Wanted> {
    let found = INDICES.map(|name| (name, std::env::var(name).ok()));
    let found = found
        .into_iter()
        .filter_map(|(name, value)| Some((name, value?)));
    let found: Vec<_> = found.collect();
    match &args.shards {
        Some(shards) => listed(choose(args.shard, None, &found)?, shards),
        None => choose(args.shard, args.shards_file.as_deref(), &found),
    }
}

/// The shard that an index selects in a list like `3,7,12-15`.
fn listed(index: Wanted, shards: &str) -> Result<Wanted> {
    let wrong = |found: String, expected: &str| Error::Parameter {
        name: "shards",
        found,
        expected: expected.into(),
    };
    let mut left = index.number;
    for part in shards.split(',') {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let (Ok(first), Ok(last)) = (first.trim().parse::<u32>(), last.trim().parse::<u32>())
        else {
            return Err(wrong(
                format!("{part:?}"),
                "numbers of shards like 3,7,12-15",
            ));
        };
        let count = last
            .saturating_sub(first)
            .saturating_add(u32::from(last >= first));
        if left < count {
            let number = first + left;
            return Ok(Wanted {
                number,
                count: None,
            });
        }
        left -= count;
    }
    let found = format!("{shards}, and the index {}", index.number);
    Err(wrong(found, "a shard for each index"))
}

fn choose(
    given: Option<Wanted>,
    file: Option<&Path>,
    found: &[(&'static str, String)],
) -> Result<Wanted> {
    if let (Some(given), None) = (given, file) {
        return Ok(given);
    }
    let wrong = |name, found: String, expected: &str| Error::Parameter {
        name,
        found,
        expected: expected.into(),
    };
    let mut index = given;
    for (name, value) in found {
        let is: Wanted = value.parse().map_err(|_| {
            wrong(
                name,
                value.clone(),
                "the index of an array job, a number from 0",
            )
        })?;
        if given.is_none() && index.is_some_and(|index| index.number != is.number) {
            let others: Vec<_> = found.iter().map(|(n, v)| format!("{n}={v}")).collect();
            return Err(wrong(
                "--shard",
                others.join(", "),
                "one index; give --shard",
            ));
        }
        index = index.or(Some(is));
    }
    let index = index.ok_or_else(|| {
        wrong(
            "--shard",
            "nothing, and no index of an array job".into(),
            "the number of the shard",
        )
    })?;
    let Some(path) = file else {
        return Ok(index);
    };
    let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, "read", e))?;
    let Some(line) = text.lines().nth(index.number as usize) else {
        let found = format!("{} lines", text.lines().count());
        let place = format!("line {}", index.number + 1);
        return Err(Error::input(path, place, found, "a line for each index"));
    };
    line.trim().parse().map_err(|why| {
        let place = format!("line {}", index.number + 1);
        Error::input(path, place, why, "the number of a shard")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain(number: u32) -> Wanted {
        Wanted {
            number,
            count: None,
        }
    }

    #[test]
    fn shards_are_read() {
        assert_eq!("17".parse(), Ok(plain(17)));
        let count = Some(200);
        assert_eq!("17/200".parse(), Ok(Wanted { number: 17, count }));
        for bad in ["", "a", "-1", "5/5", "1/", "/2"] {
            assert!(bad.parse::<Wanted>().is_err(), "{bad}");
        }
    }

    #[test]
    fn the_index_of_an_array_job_is_the_shard_unless_two_contradict() {
        let slurm = ("SLURM_ARRAY_TASK_ID", "3".to_owned());
        let other = ("JOB_COMPLETION_INDEX", "4".to_owned());
        let one = choose(None, None, std::slice::from_ref(&slurm)).unwrap();
        assert_eq!(one, plain(3));
        assert!(choose(None, None, &[]).is_err());
        let both = [slurm, other];
        let text = choose(None, None, &both).unwrap_err().to_string();
        assert!(
            text.contains("SLURM_ARRAY_TASK_ID=3, JOB_COMPLETION_INDEX=4"),
            "{text}"
        );
        assert_eq!(choose(Some(plain(7)), None, &both).unwrap(), plain(7));
        assert!(choose(None, None, &[("BATCH_TASK_INDEX", "x".into())]).is_err());
    }

    #[test]
    fn a_list_translates_the_index() {
        for (index, shard) in [(0, 3), (1, 7), (2, 12), (5, 15)] {
            assert_eq!(listed(plain(index), "3,7,12-15").unwrap(), plain(shard));
        }
        assert!(listed(plain(6), "3,7,12-15").is_err());
        for bad in ["", "a", "1,,2", "5-", "0-99999999999"] {
            assert!(listed(plain(1), bad).is_err(), "{bad}");
        }
        assert!(listed(plain(0), "5-4").is_err());
        assert_eq!(listed(plain(1), "0-4294967295").unwrap(), plain(1));
    }

    #[test]
    fn a_file_translates_the_index() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("shards");
        std::fs::write(&path, "3\n17\n").unwrap();
        assert_eq!(choose(Some(plain(1)), Some(&path), &[]).unwrap(), plain(17));
        let text = choose(Some(plain(2)), Some(&path), &[])
            .unwrap_err()
            .to_string();
        assert!(
            text.contains("line 3") && text.contains("2 lines"),
            "{text}"
        );
    }
}
