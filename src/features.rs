//! The parts of the program that a build may leave out: the features of its manifest.

use outcrop_disk::error::{Error, Result};

/// A part of the program.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Feature {
    /// Its name in the manifest.
    name: &'static str,
    /// Its name for people.
    what: &'static str,
    is_built: bool,
}

macro_rules! feature {
    ($name:literal, $what:literal) => {
        Feature {
            name: $name,
            what: $what,
            is_built: cfg!(feature = $name),
        }
    };
}

pub(crate) const CLOUD: Feature = feature!("cloud", "files behind URLs");
pub(crate) const DEMO: Feature = feature!("demo", "the demonstration");
const E57: Feature = feature!("e57", "E57");
pub(crate) const LEVELS: Feature = feature!("levels", "levels of detail");
pub(crate) const PAGES: Feature = feature!("pages", "pages and pictures");
pub(crate) const VIEW: Feature = feature!("view", "the viewer");
const ABLATION: Feature = feature!("ablation", "other constants of the method");
const FAULTS: Feature = feature!("faults", "fault injection");

/// Those that are off by default come last.
const ALL: [Feature; 8] = [DEMO, E57, LEVELS, PAGES, VIEW, CLOUD, ABLATION, FAULTS];

impl Feature {
    /// An error if the part was left out.
    ///
    /// # Errors
    /// [`Error::NotBuilt`].
    pub(crate) fn require(self) -> Result<()> {
        match self.is_built {
            true => Ok(()),
            false => Err(self.missing()),
        }
    }

    /// The error of a build without the part.
    pub(crate) fn missing(self) -> Error {
        Error::NotBuilt {
            path: None,
            what: self.what,
            feature: self.name,
        }
    }
}

/// The names of the parts that are there, for the version.
pub(crate) fn built() -> String {
    let names = ALL.iter().filter(|part| part.is_built);
    let names: Vec<&str> = names.map(|part| part.name).collect();
    match names.is_empty() {
        true => "no features".to_owned(),
        false => format!("features {}", names.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_refused_with_the_feature_that_has_it_or_is_named() {
        for part in ALL {
            let named = built().split([' ', ',']).any(|word| word == part.name);
            match part.require() {
                Ok(()) => assert!(named, "{part:?}"),
                Err(error) => {
                    let said = error.to_string();
                    let start = format!("this outcrop was built without {}: ", part.what);
                    assert_eq!(
                        said,
                        format!("{start}build it with --features {}", part.name)
                    );
                    assert!(!named, "{part:?}");
                }
            }
        }
    }
}
