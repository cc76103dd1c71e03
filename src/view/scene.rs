//! What is shown: one mesh or two, and points; what of it is there, and how far the rest is.

use super::folder::{Folder, Opened};
use super::frame::Matrix;
use super::tileset::{Facts, Tileset};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::lock;
use outcrop_disk::workspace::outlook::{Outlook, Planned};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// A part of what a server shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The mesh, whose coordinates are those of the page.
    First,
    /// Another mesh in the same place.
    Second,
    /// Points of a cloud.
    Points,
}

impl Part {
    /// The folder in the URL under which its tileset is.
    const fn path(self) -> &'static str {
        match self {
            Self::First => "mesh",
            Self::Second => "second",
            Self::Points => "points",
        }
    }

    /// What it is, for the page.
    const fn kind(self) -> &'static str {
        match self {
            Self::First | Self::Second => "mesh",
            Self::Points => "points",
        }
    }
}

/// Work on a part that is not there yet.
#[derive(Debug)]
struct Work {
    outlook: Outlook,
    began: Instant,
    /// Name of the stage, what it counts, and how many there are (0: unknown).
    stage: Option<(&'static str, &'static str, u64)>,
}

/// A tileset that is there.
#[derive(Debug)]
struct Ready {
    folder: Folder,
    facts: Facts,
    /// The map to the coordinates of the first part; none if they are the same.
    matrix: Option<Matrix>,
}

#[derive(Debug)]
enum State {
    Waiting,
    Making(Work),
    Ready(Ready),
}

/// A part and its state.
#[derive(Debug)]
struct Shown {
    part: Part,
    name: String,
    state: State,
}

/// All parts.
#[derive(Debug)]
pub struct Scene {
    parts: Mutex<Vec<Shown>>,
    /// Items of the current stage that are done.
    done: AtomicU64,
    /// Why there will be no more.
    failed: Mutex<Option<String>>,
    /// True if a page has asked for the state, and for the failure.
    asked: AtomicBool,
    told: AtomicBool,
}

impl Scene {
    /// Parts with their names, none of which is there yet.
    pub fn new(parts: &[(Part, String)]) -> Self {
        let waiting = |(part, name): &(Part, String)| Shown {
            part: *part,
            name: name.clone(),
            state: State::Waiting,
        };
        Self {
            parts: Mutex::new(parts.iter().map(waiting).collect()),
            done: AtomicU64::new(0),
            failed: Mutex::default(),
            asked: AtomicBool::new(false),
            told: AtomicBool::new(false),
        }
    }

    /// A part is in this folder from now on.
    pub fn show(&self, part: Part, path: &Path) -> Result<()> {
        let mut facts = Tileset::check(path)?;
        let folder = Folder::new(path).map_err(|e| Error::io(path, "open the folder", e))?;
        let mut parts = lock(&self.parts);
        if let Some(shown) = parts.iter().find(|shown| shown.part == part) {
            // The folder may be one of scratch files, which tells nobody anything.
            facts.path = PathBuf::from(&shown.name);
        }
        let first = parts.iter().find_map(|shown| match &shown.state {
            State::Ready(ready) if shown.part == Part::First => Some(&ready.facts),
            _ => None,
        });
        let matrix = match first {
            Some(first) if part != Part::First => facts.beside(first)?,
            _ => None,
        };
        if let Some(shown) = parts.iter_mut().find(|shown| shown.part == part) {
            let ready = Ready {
                folder,
                facts,
                matrix,
            };
            shown.state = State::Ready(ready);
        }
        Ok(())
    }

    /// There will be no more, for this reason. True if a page is there that may be told.
    pub fn fail(&self, why: &str) -> bool {
        *lock(&self.failed) = Some(why.to_owned());
        self.asked.load(Ordering::SeqCst)
    }

    /// True if a page was told of the failure.
    pub fn is_told(&self) -> bool {
        self.told.load(Ordering::SeqCst)
    }

    /// The file at a path of plain names; `None` if there is none.
    pub fn open(&self, names: &[&str]) -> Option<Opened> {
        let (first, names) = names.split_first()?;
        let parts = lock(&self.parts);
        let shown = parts.iter().find(|shown| shown.part.path() == *first)?;
        match &shown.state {
            State::Ready(ready) => ready.folder.open(names.iter().copied()),
            _ => None,
        }
    }

    /// The state of all parts, for the page.
    pub fn json(&self) -> Value {
        self.asked.store(true, Ordering::SeqCst);
        let done = self.done.load(Ordering::Relaxed);
        let mut parts = lock(&self.parts);
        let parts: Vec<Value> = parts.iter_mut().map(|shown| shown.json(done)).collect();
        let failed = lock(&self.failed).clone();
        if failed.is_some() {
            self.told.store(true, Ordering::SeqCst);
        }
        json!({ "parts": parts, "failed": failed })
    }

    // Progress.

    /// Changes the work on a part that is not there yet.
    fn work(&self, part: Part, change: impl FnOnce(&mut Work)) {
        let mut parts = lock(&self.parts);
        let Some(shown) = parts.iter_mut().find(|shown| shown.part == part) else {
            return;
        };
        if let State::Waiting = shown.state {
            shown.state = State::Making(Work {
                outlook: Outlook::default(),
                began: Instant::now(),
                stage: None,
            });
        }
        if let State::Making(work) = &mut shown.state {
            change(work);
        }
    }

    pub fn plan(&self, part: Part, stages: &[Planned]) {
        self.work(part, |work| work.outlook.plan(stages));
    }

    pub fn begin(&self, part: Part, name: &'static str, unit: &'static str, total: u64) {
        self.done.store(0, Ordering::Relaxed);
        self.work(part, |work| {
            let now = work.began.elapsed();
            work.outlook.begin(name, total, now);
            work.stage = Some((name, unit, total));
        });
    }

    pub fn advance(&self, count: u64) {
        self.done.fetch_add(count, Ordering::Relaxed);
    }

    pub fn end(&self, part: Part) {
        self.work(part, |work| {
            let now = work.began.elapsed();
            work.outlook.end(now);
        });
    }
}

impl Shown {
    /// The part for the page; `done` items of its stage are done, if it is being made.
    fn json(&mut self, done: u64) -> Value {
        let mut json = json!({
            "kind": self.part.kind(), "path": format!("{}/", self.part.path()), "name": self.name,
        });
        json["state"] = match &mut self.state {
            State::Waiting => "waiting".into(),
            State::Making(work) => {
                json["work"] = work.json(done);
                "making".into()
            }
            State::Ready(ready) => {
                json["matrix"] = json!(ready.matrix);
                "ready".into()
            }
        };
        json
    }
}

impl Work {
    /// The stage, its items, and of the whole work the share that is done and the seconds that are left, if they are
    /// known.
    fn json(&mut self, done: u64) -> Value {
        let position = self.outlook.position(done, self.began.elapsed());
        let (stage, unit, total) = self.stage.unwrap_or_default();
        json!({
            "stage": stage, "unit": unit, "done": done, "total": total,
            "share": position.map(|p| p.share),
            "left": position.map(|p| p.left.min(LONGEST).as_secs_f64()),
        })
    }
}

/// Longer times are not told.
const LONGEST: Duration = Duration::from_secs(30 * 24 * 3600);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_state_tells_what_is_there_and_how_far_the_rest_is() {
        let place = tempfile::tempdir().unwrap();
        let tileset = |x: f64| {
            format!(
                "{{\"asset\":{{\"version\":\"1.1\"}},\"root\":{{\"geometricError\":0}},\
                 \"extras\":{{\"outcrop\":{{\"origin\":[{x},0,0],\"epsg\":25832}}}}}}"
            )
        };
        let folder = |x: f64| {
            let folder = place.path().join(x.to_string());
            std::fs::create_dir_all(&folder).unwrap();
            std::fs::write(folder.join("tileset.json"), tileset(x)).unwrap();
            folder
        };
        let names = [
            (Part::First, "a".to_owned()),
            (Part::Second, "b".to_owned()),
        ];
        let scene = Scene::new(&names);
        assert_eq!(scene.json()["parts"][0]["state"], "waiting");
        scene.plan(
            Part::First,
            &[Planned {
                name: "cells",
                seconds: 9.0,
            }],
        );
        scene.begin(Part::First, "cells", "triangles", 10);
        scene.advance(5);
        let work = &scene.json()["parts"][0]["work"];
        assert_eq!(
            (&work["stage"], &work["done"], &work["total"]),
            (&"cells".into(), &5.into(), &10.into())
        );
        assert_eq!(work["share"], 0.5);
        assert!(scene.open(&["mesh", "tileset.json"]).is_none());
        scene.end(Part::First);
        scene.show(Part::First, &folder(1.0)).unwrap();
        assert!(scene.open(&["mesh", "tileset.json"]).is_some());
        assert!(scene.open(&["second", "tileset.json"]).is_none());
        scene.show(Part::Second, &folder(4.0)).unwrap();
        let json = scene.json();
        assert_eq!(json["parts"][0]["matrix"], Value::Null);
        assert_eq!(json["parts"][1]["matrix"][12], 3.0);
        assert_eq!(json["parts"][1]["path"], "second/");
        // What came late has no more to tell.
        scene.begin(Part::Second, "cells", "triangles", 10);
        assert_eq!(scene.json()["parts"][1]["state"], "ready");
    }

    #[test]
    fn a_failure_is_told_to_a_page_that_is_there() {
        let scene = Scene::new(&[(Part::First, "a".to_owned())]);
        assert!(!scene.fail("no triangle") && !scene.is_told());
        assert_eq!(scene.json()["failed"], "no triangle");
        assert!(scene.fail("no triangle") && scene.is_told());
    }
}
