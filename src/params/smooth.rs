//! How often points are smoothed.

/// How often points are smoothed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Smooth {
    /// Each point as often as its neighbourhood is noisy: clean points stay where they are.
    Auto,
    /// All points, in this number of rounds.
    #[serde(untagged)]
    Rounds(u32),
}

impl Smooth {
    /// Rounds in which all points move.
    #[must_use]
    pub fn rounds(self) -> u32 {
        match self {
            Self::Auto => 0,
            Self::Rounds(rounds) => rounds,
        }
    }
}

impl std::str::FromStr for Smooth {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim() {
            "auto" => Ok(Self::Auto),
            number => {
                let wrong = |_| format!("{text:?} is not auto or a number of rounds");
                number.parse().map(Self::Rounds).map_err(wrong)
            }
        }
    }
}

impl std::fmt::Display for Smooth {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Rounds(rounds) => write!(f, "{rounds}"),
        }
    }
}
