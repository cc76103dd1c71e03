//! Progress for the page.

use super::scene::{Part, Scene};
use outcrop_disk::error::Setting;
use outcrop_disk::workspace::outlook::Planned;
use outcrop_disk::workspace::progress::Observer;
use std::sync::Arc;

/// Tells the page of the work on a part, and passes everything on to another observer.
pub struct Watching {
    pub scene: Arc<Scene>,
    pub part: Part,
    pub other: Arc<dyn Observer>,
}

impl Observer for Watching {
    fn plan(&self, stages: &[Planned]) {
        self.scene.plan(self.part, stages);
        self.other.plan(stages);
    }

    fn begin(&self, name: &'static str, unit: &'static str, total: u64) {
        self.scene.begin(self.part, name, unit, total);
        self.other.begin(name, unit, total);
    }

    fn advance(&self, count: u64) {
        self.scene.advance(count);
        self.other.advance(count);
    }

    fn end(&self) {
        self.scene.end(self.part);
        self.other.end();
    }

    fn warn(&self, message: &str) {
        self.other.warn(message);
    }

    fn spell(&self, setting: &Setting) -> String {
        self.other.spell(setting)
    }
}
