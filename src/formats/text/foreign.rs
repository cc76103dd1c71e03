//! Names of formats that are recognised but not supported.

use super::sample::lines;

/// The name of an unsupported format with geometry.
pub(super) fn name(head: &[u8]) -> Option<&'static str> {
    if head.contains(&0) {
        None
    } else {
        of_text(head)
    }
}

fn of_text(head: &[u8]) -> Option<&'static str> {
    let lines = lines(head, true);
    let keyword = |line: &[u8]| {
        let line = line.trim_ascii();
        let word = line.split(|b| *b == b' ').next().unwrap_or(line);
        let known: [&[u8]; 7] = [b"v", b"vn", b"vt", b"o", b"g", b"mtllib", b"usemtl"];
        known.contains(&word)
    };
    if lines.len() > 1 && lines[..2].iter().all(|(_, _, line)| keyword(line)) {
        Some("OBJ")
    } else if lines
        .first()
        .is_some_and(|(_, _, line)| line.trim_ascii().starts_with(b"solid "))
    {
        Some("STL")
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knows_names() {
        assert_eq!(name(b"v 1 2 3\nv 4 5 6\n"), Some("OBJ"));
        assert_eq!(name(b"solid a\n"), Some("STL"));
        assert_eq!(name(b"1 2 3\n"), None);
    }
}
