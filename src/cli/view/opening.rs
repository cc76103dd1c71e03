//! The moment at which the page can be opened: its address is printed, and a browser called.

use super::super::output::print;
use outcrop_disk::error::{Error, Result, Setting};
use outcrop_disk::workspace::lock;
use outcrop_disk::workspace::outlook::Planned;
use outcrop_disk::workspace::progress::Observer;
use std::process::Stdio;
use std::sync::{Arc, Mutex};

/// Opens the page once: as soon as the work on its first part begins, or at the latest when that part is there. If the
/// input is refused before that, there is a message and no page.
pub struct Opening {
    pub url: String,
    /// True if a browser is to be opened.
    pub browser: bool,
    /// A line for people.
    pub line: Option<String>,
    state: Mutex<State>,
}

enum State {
    Coming,
    Done,
    Failed(Error),
}

impl Opening {
    pub fn new(url: String, browser: bool, line: Option<String>) -> Self {
        Self {
            url,
            browser,
            line,
            state: Mutex::new(State::Coming),
        }
    }

    /// Opens the page, unless that was done.
    pub fn now(&self) -> Result<()> {
        let mut state = lock(&self.state);
        match std::mem::replace(&mut *state, State::Done) {
            State::Coming => {
                print(&self.url)?;
                if let Some(line) = &self.line {
                    eprintln!("outcrop: {line}");
                }
                if self.browser {
                    open(&self.url);
                }
                Ok(())
            }
            State::Done => Ok(()),
            State::Failed(error) => Err(error),
        }
    }
}

/// Opens the page when work begins, and passes everything on.
pub struct Beginning {
    pub opening: Arc<Opening>,
    pub other: Arc<dyn Observer>,
}

impl Observer for Beginning {
    fn plan(&self, stages: &[Planned]) {
        self.other.plan(stages);
    }

    fn begin(&self, name: &'static str, unit: &'static str, total: u64) {
        if let Err(error) = self.opening.now() {
            // The next one who opens it is told.
            *lock(&self.opening.state) = State::Failed(error);
        }
        self.other.begin(name, unit, total);
    }

    fn advance(&self, count: u64) {
        self.other.advance(count);
    }

    fn end(&self) {
        self.other.end();
    }

    fn warn(&self, message: &str) {
        self.other.warn(message);
    }

    fn spell(&self, setting: &Setting) -> String {
        self.other.spell(setting)
    }
}

/// Opens a browser, if there is one.
fn open(url: &str) {
    let Some(mut command) = outcrop_platform::browser(url) else {
        return;
    };
    let silent = command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    if let Ok(mut child) = silent.spawn() {
        // It may stay for as long as the browser does.
        std::thread::spawn(move || child.wait());
    }
}
