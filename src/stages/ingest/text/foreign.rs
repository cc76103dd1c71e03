//! Names of formats that are recognised but not supported.

use super::super::number;
use super::dialect::{lines, words};

/// The name of an unsupported format with geometry.
pub(super) fn name(head: &[u8]) -> Option<&'static str> {
    if head.starts_with(b"ASTM-E57") {
        Some("E57")
    } else if is_pcd(head) {
        Some("PCD")
    } else if head.contains(&0) {
        None
    } else {
        of_text(head)
    }
}

/// True for the header of a PCD file.
fn is_pcd(head: &[u8]) -> bool {
    let line = head
        .split(|b| matches!(b, b'\n' | b'\r'))
        .map(<[u8]>::trim_ascii);
    let first = line.clone().find(|l| !l.is_empty() && !l.starts_with(b"#"));
    head.starts_with(b"# .PCD")
        || first.is_some_and(|l| l.starts_with(b"VERSION ") || l.starts_with(b"FIELDS "))
}

fn of_text(head: &[u8]) -> Option<&'static str> {
    let lines = lines(head, true);
    let keyword = |line: &[u8]| {
        let word = line.split(|b| *b == b' ').next().unwrap_or(line);
        let known: [&[u8]; 7] = [b"v", b"vn", b"vt", b"o", b"g", b"mtllib", b"usemtl"];
        known.contains(&word)
    };
    if is_ptx(head) {
        Some("PTX")
    } else if lines.len() > 1 && lines[..2].iter().all(|(_, _, line)| keyword(line)) {
        Some("OBJ")
    } else if lines
        .first()
        .is_some_and(|(_, _, line)| line.starts_with(b"solid "))
    {
        Some("STL")
    } else {
        None
    }
}

/// True for the header of a PTX file: columns, rows, four lines of three and four of four numbers.
fn is_ptx(head: &[u8]) -> bool {
    let numbers = |line: &[u8]| {
        let mut decimals = 0;
        let all = words(line).all(|w| number::parse(w, false, &mut decimals).is_some());
        all.then(|| words(line).count())
    };
    let lines = lines(head, true);
    let shape: Vec<_> = lines.iter().take(10).map(|(_, _, l)| numbers(l)).collect();
    shape == [1, 1, 3, 3, 3, 3, 4, 4, 4, 4].map(Some)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knows_names() {
        assert_eq!(name(b"# .PCD v0.7\nVERSION 0.7\n"), Some("PCD"));
        assert!(is_ptx(
            b"1\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n0 0 0 0.5\n"
        ));
    }
}
