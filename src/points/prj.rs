//! Reference systems in `.prj` files beside others.

use super::crs::{Crs, CrsSource, LONGEST};
use super::wkt::well_known;
use outcrop_disk::workspace::compressed::plain_name;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Path of the `.prj` file that belongs to an input.
#[must_use]
pub fn prj_of(input: &Path) -> PathBuf {
    plain_name(input).with_extension("prj")
}

/// The reference system in a `.prj` file, if there is one; a warning if it cannot be used.
pub fn of_prj(path: &Path) -> (Option<Crs>, Option<String>) {
    let Ok(file) = File::open(path) else {
        return (None, None);
    };
    let not = |why: &str| {
        let warning = format!(
            "{}: {why}, no reference system is taken from it",
            path.display()
        );
        (None, Some(warning))
    };
    let mut bytes = Vec::new();
    if let Err(e) = file.take(LONGEST as u64 + 1).read_to_end(&mut bytes) {
        return not(&e.to_string());
    }
    if bytes.len() > LONGEST {
        return not("it is longer than 1 MiB");
    }
    let text = String::from_utf8_lossy(&bytes);
    let text = text.trim_start_matches('\u{feff}').trim();
    if !text.contains('[') {
        return not("it is no well-known text");
    }
    let crs = Crs {
        source: CrsSource::Prj,
        ..well_known(text)
    };
    (Some(crs), None)
}
