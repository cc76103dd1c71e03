//! What the names of columns mean.

use outcrop_points::columns::usual_name;

/// Words beside the letter of an axis that say no more than that it is a coordinate, and in which unit.
const BESIDE: [&str; 22] = [
    "coord",
    "coords",
    "coordinate",
    "coordinates",
    "point",
    "points",
    "pos",
    "position",
    "cartesian",
    "global",
    "world",
    "utm",
    "val",
    "value",
    "m",
    "metre",
    "meter",
    "metres",
    "meters",
    "mm",
    "ft",
    "feet",
];

/// Of these, as many are also written in one word with the letter of the axis.
const JOINED: usize = 9;

/// Other words for the axes: of maps, in English and German.
const SURVEYED: [&[&str]; 3] = [
    &["easting", "eastings", "east", "rechtswert", "ostwert"],
    &["northing", "northings", "north", "hochwert", "nordwert"],
    &[
        "elevation",
        "elev",
        "height",
        "altitude",
        "alt",
        "höhe",
        "hoehe",
    ],
];

/// Letters for the axes on maps.
const LETTERS: [&str; 3] = ["e", "n", "h"];

/// How plainly a name says that it is that of a coordinate, the plainest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Axis,
    Decorated,
    Surveyed,
    Letter,
}

/// Columns of the coordinates by their names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Axes {
    /// The columns.
    pub(super) places: [usize; 3],
    /// True if they are called x, y and z, perhaps with units.
    pub(super) plain: bool,
    /// What is doubtful about it.
    pub(super) doubt: Option<String>,
}

/// Finds the coordinates among the names of columns; none if no three names are theirs.
pub(super) fn axes(names: &[String]) -> Option<Axes> {
    let kinds: Vec<Option<(usize, Kind)>> = names.iter().map(|name| axis(name)).collect();
    let of = |axis: usize, wanted: [Kind; 2]| {
        let places = (0..names.len()).filter_map(|at| match kinds[at] {
            Some((a, kind)) if a == axis && wanted.contains(&kind) => Some((kind, at)),
            _ => None,
        });
        // Of columns that are as plain the first counts.
        places.min()
    };
    if let [
        Some((0, Kind::Axis)),
        Some((1, Kind::Axis)),
        Some((_, Kind::Axis)),
    ] = kinds[..]
        && of(2, [Kind::Axis; 2]).is_none()
    {
        // One slip in a line that has nothing but names of axes.
        let third = names[2].trim();
        return Some(Axes {
            places: [0, 1, 2],
            plain: true,
            doubt: Some(format!(
                "two columns are called {third:?}, the last is taken for z"
            )),
        });
    }
    let both = |wanted| Some([of(0, wanted)?, of(1, wanted)?]);
    let axis_kinds = [Kind::Axis, Kind::Decorated];
    let map_kinds = [Kind::Surveyed, Kind::Letter];
    let level = both(axis_kinds).or_else(|| both(map_kinds))?;
    let up = of(2, axis_kinds).or_else(|| of(2, map_kinds))?;
    let found = [level[0], level[1], up];
    let places = found.map(|(_, at)| at);
    let twice = (0..3).find(|axis| {
        let same = |at: &usize| kinds[*at] == Some((*axis, found[*axis].0));
        (0..names.len()).filter(same).count() > 1
    });
    let units = places.map(|at| unit(&names[at]));
    let doubt = match twice {
        Some(axis) => Some(format!(
            "of several columns for {} the first counts",
            ["x", "y", "z"][axis]
        )),
        None if units.iter().any(|unit| *unit != units[0]) && units.iter().all(Option::is_some) => {
            Some("the units in their names differ and are not converted".to_owned())
        }
        None => None,
    };
    Some(Axes {
        places,
        plain: found.iter().all(|(kind, _)| *kind == Kind::Axis),
        doubt,
    })
}

/// A name without a unit in brackets behind it, in lower case; and that unit.
fn parts(name: &str) -> (String, Option<String>) {
    let name = name.trim().trim_matches('\'').trim().to_lowercase();
    for (open, close) in [('[', ']'), ('(', ')')] {
        if let Some(inner) = name.strip_suffix(close)
            && let Some((before, unit)) = inner.rsplit_once(open)
            && !before.trim().is_empty()
        {
            return (before.trim().to_owned(), Some(unit.trim().to_owned()));
        }
    }
    (name, None)
}

fn unit(name: &str) -> Option<String> {
    parts(name).1
}

/// The coordinate that a name stands for.
fn axis(name: &str) -> Option<(usize, Kind)> {
    let (name, _) = parts(name);
    let words = name.split(|c: char| !c.is_alphanumeric());
    let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
    let letter = |word: &str| ["x", "y", "z"].iter().position(|axis| *axis == word);
    if let [word] = words[..] {
        let map = |axis: &usize| SURVEYED[*axis].contains(&word);
        let joined = |part: &str| {
            let behind = word.strip_prefix(part).and_then(letter);
            behind.or_else(|| word.strip_suffix(part).and_then(letter))
        };
        let lone = letter(word).map(|axis| (axis, Kind::Axis));
        let surveyed = (0..3).find(map).map(|axis| (axis, Kind::Surveyed));
        let short = LETTERS.iter().position(|axis| *axis == word);
        let decorated = BESIDE[..JOINED].iter().find_map(|part| joined(part));
        return lone
            .or(surveyed)
            .or(short.map(|axis| (axis, Kind::Letter)))
            .or(decorated.map(|axis| (axis, Kind::Decorated)));
    }
    // ParaView numbers the parts of a vector.
    let number = |word: &str| ["0", "1", "2"].iter().position(|axis| *axis == word);
    if let [vector, part] = words[..]
        && ["points", "point", "position", "coords", "coordinates"].contains(&vector)
        && let Some(axis) = number(part)
    {
        return Some((axis, Kind::Decorated));
    }
    let (beside, own): (Vec<&str>, Vec<&str>) =
        words.iter().partition(|word| BESIDE.contains(word));
    let [own] = own[..] else { return None };
    let map = |axis: &usize| SURVEYED[*axis].contains(&own);
    match (beside.is_empty(), letter(own)) {
        (true, _) => None,
        (_, Some(axis)) => Some((axis, Kind::Decorated)),
        _ => (0..3).find(map).map(|axis| (axis, Kind::Surveyed)),
    }
}

/// The name by which a column of text is known: as in other formats, without units, in letters, digits and `_`.
pub(super) fn usual(name: &str) -> String {
    let (name, _) = parts(name);
    let part = |c: char| if c.is_alphanumeric() { c } else { ' ' };
    let words: String = name.chars().map(part).collect();
    let words: Vec<&str> = words.split_whitespace().collect();
    let name = words.join("_");
    match &*name {
        "rf" => "red".to_owned(),
        "gf" => "green".to_owned(),
        "bf" => "blue".to_owned(),
        "reflectivity" => "intensity".to_owned(),
        _ => usual_name(&name),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(names: &str) -> Option<[usize; 3]> {
        let names: Vec<String> = names.split('|').map(str::to_owned).collect();
        axes(&names).map(|axes| axes.places)
    }

    #[test]
    fn coordinates_have_many_names() {
        for (names, want) in [
            ("x|y|z", [0, 1, 2]),
            ("X[m]|Y [m]|z (m)|Ori_x|Ori_y|Ori_z", [0, 1, 2]),
            ("Ori_x|Ori_y|Ori_z|X|Y|Z", [3, 4, 5]),
            ("Points:0|Points:1|Points:2", [0, 1, 2]),
            ("Intensity|Points_2|Points_1|Points_0", [3, 2, 1]),
            ("Northing|Easting|Elevation", [1, 0, 2]),
            ("Point ID|Easting (m)|Northing (m)|Height (m)", [1, 2, 3]),
            ("P|E|N|H|code", [1, 2, 3]),
            ("N|E|Z", [1, 0, 2]),
            ("x|y|Height", [0, 1, 2]),
            ("POINT_X|POINT_Y|POINT_Z", [0, 1, 2]),
            ("cartesianX|cartesianY|cartesianZ", [0, 1, 2]),
            ("xcoord|ycoord|zcoord", [0, 1, 2]),
            ("X coordinate|Y coordinate|Altitude", [0, 1, 2]),
            ("'x'|'y'|'z'", [0, 1, 2]),
            ("East|North|Elev|x", [0, 1, 2]),
            ("Rechtswert|Hochwert|Höhe", [0, 1, 2]),
            ("X|Y|X", [0, 1, 2]),
        ] {
            assert_eq!(places(names), Some(want), "{names}");
        }
        for names in [
            "a|b|c",
            "x|y",
            "nx|ny|nz",
            "Ori_x|Ori_y|Ori_z",
            "lon|lat|height",
            "x|northing|z",
        ] {
            assert_eq!(places(names), None, "{names}");
        }
    }

    #[test]
    fn names_are_usual_ones() {
        for (name, want) in [
            ("Return number", "return_number"),
            ("M3C2 distance [m]", "m3c2_distance"),
            ("R", "red"),
            ("Bf", "blue"),
            ("scalar_Nx", "nx"),
            ("Scalar_Field X", "field_x"),
            ("Reflectivity", "intensity"),
            ("class", "classification"),
            ("", ""),
        ] {
            assert_eq!(usual(name), want, "{name}");
        }
    }
}
