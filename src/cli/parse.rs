//! Values of options.

use crate::params::{NoRegion, Region};
use outcrop_points::GivenCrs;
use outcrop_survey::volume::Above;
use std::io::Read;
use std::time::Duration;

/// A size in bytes.
pub fn size(text: &str) -> Result<u64, String> {
    let size: bytesize::ByteSize = text
        .parse()
        .map_err(|_| format!("{text:?} is not a size like 512MiB, 4GiB or 2000000000"))?;
    Ok(size.as_u64())
}

/// From where on heights are measured: a number, or the name of a file.
pub fn above(text: &str) -> Result<Above, String> {
    match text.trim().parse::<f64>() {
        Ok(level) if level.is_finite() => Ok(Above::Level(level)),
        Ok(_) => Err(format!("{text:?} is not a level like 412.5")),
        Err(_) if std::path::Path::new(text).is_file() => Ok(Above::Mesh(text.into())),
        Err(_) => Err("neither a number nor a file that can be read".to_owned()),
    }
}

/// A region: numbers, or the name of a file.
pub fn region(text: &str) -> Result<Region, String> {
    if Region::is_numbers(text) {
        return text.parse().map_err(|e: NoRegion| e.to_string());
    }
    // A point cloud given by mistake must not be read as a whole.
    let limit = Region::LONGEST as u64 + 1;
    let read = std::fs::File::open(text).and_then(|file| {
        let mut content = Vec::new();
        file.take(limit).read_to_end(&mut content).map(|_| content)
    });
    let content = read.map_err(|e| format!("neither numbers nor a file that can be read ({e})"))?;
    let content = String::from_utf8_lossy(&content);
    content.parse().map_err(|e: NoRegion| e.to_string())
}

/// A reference system: EPSG codes, or the name of a file with well-known text.
pub fn system(text: &str) -> Result<GivenCrs, String> {
    let wrong = match text.parse() {
        Ok(given) => return Ok(given),
        Err(wrong)
            if text.contains('[')
                || text
                    .get(..5)
                    .is_some_and(|t| t.eq_ignore_ascii_case("epsg:")) =>
        {
            return Err(wrong);
        }
        Err(wrong) => wrong,
    };
    // A point cloud given by mistake must not be read as a whole.
    let read = std::fs::File::open(text).and_then(|file| {
        let mut content = Vec::new();
        file.take(LONGEST_SYSTEM + 1)
            .read_to_end(&mut content)
            .map(|_| content)
    });
    let content = read.map_err(|e| format!("{wrong}, nor a file that can be read ({e})"))?;
    String::from_utf8_lossy(&content).parse()
}

/// Most bytes of a file with well-known text.
const LONGEST_SYSTEM: u64 = 1 << 20;

/// A time that is not zero.
pub fn time(text: &str) -> Result<Duration, String> {
    match humantime::parse_duration(text) {
        Ok(time) if time > Duration::ZERO => Ok(time),
        _ => Err(format!("{text:?} is not a time like 90s, 45m or 7h30m")),
    }
}

/// A number of points.
pub fn count(text: &str) -> Result<u64, String> {
    match text.parse::<f64>() {
        Ok(x) if (1.0..=4e9).contains(&x) && x.fract() == 0.0 => Ok(x as u64),
        _ => Err(format!(
            "{text:?} is not a number of points like 200000 or 1e6"
        )),
    }
}

/// A number of samples, which may be 0.
pub fn samples(text: &str) -> Result<u64, String> {
    match text {
        "0" => Ok(0),
        _ => count(text),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read() {
        assert_eq!(size("512MiB"), Ok(512 << 20));
        assert_eq!(size("2GiB"), Ok(2 << 30));
        assert_eq!(size("1000"), Ok(1000));
        assert!(size("lots").is_err());
    }
}
