//! What helps against an error: data, which each front puts into words with its own names of options.

use super::Error;

/// An option of a run, in an error or a warning. Names are those of Python: lower case, with `_` between words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Setting {
    /// An option of which the user knows the value.
    Option(&'static str),
    /// An option that is on or off: on.
    Flag(&'static str),
    /// An option with this value.
    Value(&'static str, String),
}

/// By name; each front has its own way to write it.
impl std::fmt::Display for Setting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Option(name) | Self::Flag(name) => f.write_str(name),
            Self::Value(name, value) => write!(f, "{name} {value}"),
        }
    }
}

/// What helps against an error.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Remedy {
    /// Give an option, which does this.
    Give(Setting, &'static str),
    /// Give an option at least this value.
    AtLeast(&'static str, String),
    /// Give another value of an option.
    Another(&'static str),
    /// Give a larger value of an option.
    Larger(&'static str),
    /// Give a smaller value of an option.
    Smaller(&'static str),
    /// Run a command of the program, to this end.
    Command(&'static str, &'static str),
    /// Write the mesh in another format.
    Formats(&'static str),
    /// Wait for the other run.
    Wait,
    /// Remove the file or folder.
    Remove,
}

impl Remedy {
    fn told(&self, spell: &dyn Fn(&Setting) -> String) -> String {
        let option = |name| spell(&Setting::Option(name));
        match self {
            Self::Give(setting, effect) => format!("{} {effect}", spell(setting)),
            Self::AtLeast(name, value) => {
                format!(
                    "give at least {}",
                    spell(&Setting::Value(name, value.clone()))
                )
            }
            Self::Another(name) => format!("choose another {}", option(name)),
            Self::Larger(name) => format!("try a larger {}", option(name)),
            Self::Smaller(name) => format!("try a smaller {}", option(name)),
            Self::Command(name, end) => format!("run `outcrop {name}` {end}"),
            Self::Formats(names) => format!("write {names}"),
            Self::Wait => "wait for it".to_owned(),
            Self::Remove => "remove it".to_owned(),
        }
    }
}

impl Error {
    /// What helps, if something is known: most of it are options, by name.
    #[must_use]
    pub fn remedies(&self) -> Vec<Remedy> {
        let flag = |name, effect| Remedy::Give(Setting::Flag(name), effect);
        let restart = || flag("restart", "begins again");
        match self {
            Self::Input { remedies, .. }
            | Self::NoTriangles { remedies, .. }
            | Self::NotResumable { remedies, .. } => remedies.clone(),
            Self::Memory { needed, .. } => {
                let value = format!("{}MiB", needed.div_ceil(1 << 20));
                vec![Remedy::AtLeast("memory", value)]
            }
            Self::TooLarge { finished: true, .. } => vec![Remedy::Formats(LARGE)],
            Self::TooLarge { .. } => {
                let option = |name, effect| Remedy::Give(Setting::Option(name), effect);
                let (fewer, several) = ("makes a smaller one", "makes several");
                let smaller = [option("thin", fewer), option("split", several)];
                std::iter::once(Remedy::Formats(LARGE))
                    .chain(smaller)
                    .collect()
            }
            Self::Locked { .. } => vec![Remedy::Wait, Remedy::Another("scratch")],
            Self::Unfinished { .. } => vec![flag("resume", "goes on with it"), restart()],
            Self::Mismatch { .. } => vec![restart()],
            _ => Vec::new(),
        }
    }

    /// The same error, against which this helps, if it is one that says what helps.
    #[must_use]
    pub fn with(mut self, remedy: Remedy) -> Self {
        if let Self::Input { remedies, .. }
        | Self::NoTriangles { remedies, .. }
        | Self::NotResumable { remedies, .. } = &mut self
        {
            remedies.push(remedy);
        }
        self
    }

    /// The message with all that helps, for a front that spells options so.
    pub fn told(&self, spell: impl Fn(&Setting) -> String) -> String {
        let what = match self {
            Self::Parameter {
                name,
                found,
                expected,
            } => {
                let name = spell(&Setting::Option(name));
                format!("{name}: {found} is not valid, expected {expected}")
            }
            other => other.to_string(),
        };
        let remedies = self.remedies();
        let remedies: Vec<String> = remedies.iter().map(|r| r.told(&spell)).collect();
        match remedies.is_empty() {
            true => what,
            false => format!("{what}; {}", remedies.join(", or ")),
        }
    }
}

/// The formats without a limit.
const LARGE: &str = ".ply or .obj";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_front_reads_its_own_names() {
        let python = |setting: &Setting| match setting {
            Setting::Option(name) => (*name).to_owned(),
            Setting::Flag(name) => format!("{name}=True"),
            Setting::Value(name, value) => format!("{name}=\"{value}\""),
        };
        let path = || std::path::PathBuf::from("run");
        let said = Error::Unfinished { path: path() }.told(python);
        let expected = "run: an unfinished run is here already; resume=True goes on with it, or restart=True \
            begins again";
        assert_eq!(said, expected);
        let memory = Error::Memory {
            what: "a table".into(),
            needed: 5 << 20,
            budget: 1,
        };
        assert!(
            memory
                .told(python)
                .ends_with("; give at least memory=\"5MiB\"")
        );
        let parameter = Error::Parameter {
            name: "max_edge",
            found: "x".into(),
            expected: "y".into(),
        };
        let dashed = |setting: &Setting| match setting {
            Setting::Option(name) => name.replace('_', "-"),
            _ => String::new(),
        };
        assert_eq!(
            parameter.told(dashed),
            "max-edge: x is not valid, expected y"
        );
        let input = Error::input("a", "b", "c", "d");
        assert_eq!(input.told(python), input.to_string());
        let input = input.with(Remedy::Larger("radius"));
        assert_eq!(input.told(python), format!("{input}; try a larger radius"));
    }
}
