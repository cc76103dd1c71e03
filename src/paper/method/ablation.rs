//! Other values of the constants, from the environment: `OUTCROP_ABLATION=filling.slender=3,noise.floor=0.03`.

use super::{Constants, VALUES};
use std::fmt::Write;
use std::sync::LazyLock;

/// Name of the environment variable.
const VARIABLE: &str = "OUTCROP_ABLATION";

/// The constants. The command line has checked the variable before ([`report`]).
pub static METHOD: LazyLock<Constants> =
    LazyLock::new(|| read().unwrap_or_else(|why| panic!("{VARIABLE}: {why}")));

fn read() -> Result<Constants, String> {
    let mut constants = VALUES;
    let asked = std::env::var(VARIABLE).unwrap_or_default();
    for part in asked.split(',').filter(|part| !part.is_empty()) {
        let (name, value) = part
            .split_once('=')
            .ok_or_else(|| format!("{part:?} is not like filling.slender=3"))?;
        constants.set(name.trim(), value.trim())?;
    }
    Ok(constants)
}

/// With `OUTCROP_ABLATION=list`, all constants, one in a line: name, value, unit, reason, and two values to
/// try, separated by tabs. Else an empty text, or an error that describes an invalid variable.
pub fn report() -> Result<String, String> {
    let mut lines = String::new();
    if std::env::var(VARIABLE).is_ok_and(|asked| asked == "list") {
        for entry in Constants::list() {
            let (name, value, unit, why) = (entry.name, entry.value, entry.unit, entry.why);
            let [less, more] = entry.tried;
            let line = writeln!(lines, "{name}\t{value}\t{unit}\t{why}\t{less}\t{more}");
            line.map_err(|e| e.to_string())?;
        }
    } else {
        read().map_err(|why| format!("{VARIABLE}: {why}"))?;
    }
    Ok(lines)
}
