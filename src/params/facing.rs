//! Which side of the surface is out.

/// Three finite numbers with commas between.
pub(super) fn position(text: &str) -> Option<[f64; 3]> {
    let parsed = text.split(',').map(|number| number.trim().parse::<f64>());
    let parsed: Vec<f64> = parsed.collect::<Result<_, _>>().ok()?;
    let at: [f64; 3] = parsed.try_into().ok()?;
    at.iter().all(|c| c.is_finite()).then_some(at)
}

/// Which side of the surface is out.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Facing {
    /// That of the points' normals, where neighbours agree in sign; else the side that the scanners saw, where files
    /// give their positions; else as for [`Facing::Up`].
    Auto,
    /// The topmost surface faces up.
    Up,
    /// The outermost surface faces outwards: a body.
    Out,
    /// The outermost surface faces inwards: a room, a tunnel.
    In,
    /// The whole surface faces this position, in the input's coordinates.
    At([f64; 3]),
}

impl std::str::FromStr for Facing {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong =
            || format!("{text:?} is not auto, up, out, in, or three numbers like 12.5,3,1.6");
        match text.trim() {
            "auto" => Ok(Self::Auto),
            "up" => Ok(Self::Up),
            "out" => Ok(Self::Out),
            "in" => Ok(Self::In),
            numbers => position(numbers).map(Self::At).ok_or_else(wrong),
        }
    }
}
