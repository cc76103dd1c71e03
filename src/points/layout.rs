//! What the caller says about the columns of text files.

use super::columns::usual_name;
use serde::{Deserialize, Serialize};

/// Names of the columns of text files, in the order of the columns; empty for one that is passed over.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TextColumns(Vec<String>);

/// How text files are read; by default as they say.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Layout {
    /// Names of their columns.
    pub columns: Option<TextColumns>,
    /// Lines at their beginning that are passed over.
    pub skip_lines: u64,
}

impl Layout {
    /// True if nothing is said.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

impl TextColumns {
    /// The names.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.0
    }

    /// The columns of x, y and z.
    pub fn axes(&self) -> [usize; 3] {
        let place = |axis| self.0.iter().position(|name| name == axis);
        ["x", "y", "z"].map(|axis| place(axis).unwrap_or(usize::MAX))
    }
}

impl std::fmt::Display for TextColumns {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let shown = self.0.iter().map(|name| match &**name {
            "" => "-",
            name => name,
        });
        f.write_str(&shown.collect::<Vec<_>>().join(","))
    }
}

impl std::str::FromStr for TextColumns {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let name = |word: &str| match word.trim() {
            "-" => String::new(),
            name => usual_name(name),
        };
        let names: Vec<String> = text.split(',').map(name).collect();
        let like = "names like x,y,z,intensity,r,g,b,- in the order of the columns";
        let times = |name: &str| names.iter().filter(|n| *n == name).count();
        if text.split(',').any(|word| word.trim().is_empty()) {
            return Err(format!("{text:?} is no list of {like}"));
        }
        if let Some(axis) = ["x", "y", "z"].into_iter().find(|axis| times(axis) != 1) {
            return Err(format!("{text:?} does not have {axis} once, in {like}"));
        }
        match names
            .iter()
            .find(|name| !name.is_empty() && times(name) > 1)
        {
            Some(name) => Err(format!("{text:?} has {name:?} twice, expected {like}")),
            None => Ok(Self(names)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_parsed() {
        let parsed = |text: &str| {
            text.parse::<TextColumns>()
                .map(|columns| columns.to_string())
        };
        for (text, want) in [
            ("x,y,z", "x,y,z"),
            ("-,Y, X ,-,z,R,g,b,I", "-,y,x,-,z,red,green,blue,i"),
        ] {
            assert_eq!(parsed(text), Ok(want.to_owned()));
        }
        for text in ["", "x,y", "x,y,z,", "x,y,z,x", "x,y,z,r,red", "-,-,-"] {
            assert!(parsed(text).is_err(), "{text}");
        }
    }
}
