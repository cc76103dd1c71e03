//! The reference system in comments of a PLY header: `epsg 25832`, and `crs EPSG:25832+7837` or `crs NAME`.

use super::super::crs::{Crs, CrsSource};

/// The system that comments give, if they do. The last comment of a kind counts.
pub(super) fn of_comments(comments: &[String]) -> Option<Crs> {
    let (mut codes, mut name) = (None, None);
    for comment in comments {
        let text = comment.trim();
        let end = text.find(|c: char| !c.is_ascii_alphabetic());
        let (key, rest) = text.split_at(end.unwrap_or(text.len()));
        let rest = rest.trim_matches(|c: char| c.is_whitespace() || ":=".contains(c));
        if key.eq_ignore_ascii_case("epsg") {
            codes = parsed(rest).or(codes);
        } else if key.eq_ignore_ascii_case("crs") && !rest.is_empty() {
            name = Some(rest);
        }
    }
    // What is named by codes tells of heights, too.
    let prefix = |text: &str| {
        text.get(..5)
            .is_some_and(|p| p.eq_ignore_ascii_case("epsg:"))
    };
    let named = name
        .filter(|name| prefix(name))
        .and_then(|n| parsed(&n[5..]));
    let of = match (codes, named) {
        (Some(codes), Some(named)) if codes.0 == named.0 => Some(named),
        (Some(codes), _) => Some(codes),
        (None, named) => named,
    };
    let label = match of {
        Some((plane, None)) => format!("EPSG:{plane}"),
        Some((plane, Some(heights))) => format!("EPSG:{plane}+{heights}"),
        None => name?.to_owned(),
    };
    Some(Crs {
        name: name
            .filter(|n| !prefix(n))
            .map_or_else(String::new, str::to_owned),
        horizontal: of.map(|of| of.0),
        vertical: of.and_then(|of| of.1),
        source: CrsSource::Comments,
        wkt: None,
        normal: label,
    })
}

/// The codes of a plane and of heights, as in `25832` and `25832+7837`.
fn parsed(text: &str) -> Option<(u32, Option<u32>)> {
    let code = |word: &str| word.trim().parse().ok().filter(|code| *code > 0);
    match text.split_once('+') {
        Some((plane, heights)) => Some((code(plane)?, Some(code(heights)?))),
        None => Some((code(text)?, None)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_name_a_system() {
        for (comments, label) in [
            (&["epsg 25832"][..], Some("EPSG:25832")),
            (
                &["EPSG: 25832", "crs EPSG:25832+7837"],
                Some("EPSG:25832+7837"),
            ),
            (&["crs EPSG:25832"], Some("EPSG:25832")),
            (&["epsg 2994", "crs EPSG:25832+7837"], Some("EPSG:2994")),
            (&["epsg 0", "epsg far", "made by hand"], None),
            (&["crs NAD83 / Oregon"], Some("\"NAD83 / Oregon\"")),
            (&["crs", "epsgish 5"], None),
        ] {
            let comments: Vec<String> = comments.iter().map(ToString::to_string).collect();
            let found = of_comments(&comments).map(|crs| crs.to_string());
            assert_eq!(found.as_deref(), label, "{comments:?}");
        }
    }
}
