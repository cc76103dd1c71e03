//! The description of a cloud as text.

use super::{Info, Percentiles};
use outcrop_disk::error::Setting;
use outcrop_points::{FileStats, depths_shown};
use outcrop_stages::normals::NormalStats;
use std::fmt;

/// Most positions of scanners in the text; the report has all.
const MOST_SCANNERS: usize = 8;

/// The number of scanners and their positions; none without any.
fn shown(scanners: &[[f64; 3]]) -> Option<String> {
    let position = |[x, y, z]: &[f64; 3]| format!("{x} {y} {z}");
    let some = scanners.iter().take(MOST_SCANNERS).map(position);
    let some: Vec<String> = some.collect();
    let more = if scanners.len() > some.len() {
        "; …"
    } else {
        ""
    };
    let count = match scanners.len() {
        0 => return None,
        1 => "1 scanner position".to_owned(),
        many => format!("{many} scanner positions"),
    };
    Some(format!("{count}: {}{more}", some.join("; ")))
}

impl Info {
    /// The columns of all files, for `--attributes`.
    pub(crate) fn columns(&self) -> String {
        let mut names: Vec<&str> = Vec::new();
        for name in self.input.files.iter().flat_map(|file| &file.columns) {
            if !names.contains(&name.as_str()) {
                names.push(name);
            }
        }
        match names.is_empty() {
            true => "none".to_owned(),
            false => names.join(", "),
        }
    }
}

impl Info {
    /// The scale of the colours, if files have any.
    fn colors(&self) -> String {
        let depths = self.input.files.iter().filter_map(|file| file.colors);
        let line = depths_shown(&depths.collect::<Vec<_>>()).unwrap_or_default();
        line.trim_start_matches("colours ").to_owned()
    }

    /// How many files in folders were left out; nothing without any.
    fn not_read(&self) -> String {
        match self.input.left_out.len() {
            0 => String::new(),
            1 => "1 file in a folder, which is no scan".into(),
            count => format!("{count} files in folders, which are no scans"),
        }
    }

    /// The noise of the sample, and how many of its points are noisy.
    fn noise_line(&self) -> String {
        let Percentiles { p5, p50, p95 } = self.noise;
        let share = 100.0 * self.noisy;
        format!(
            "{p50:.3} local spacings (5-95 %: {p5:.3} to {p95:.3}); {share:.0} % of the points are noisy"
        )
    }
}

impl fmt::Display for Info {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.told(Setting::to_string))
    }
}

impl Info {
    /// As text, for a front that spells options so.
    #[must_use]
    pub fn told(&self, spell: impl Fn(&Setting) -> String) -> String {
        let rows = self.rows(&spell);
        let rows = rows.iter().filter(|row| !row.1.is_empty());
        let rows = rows.map(|(name, text)| format!("{name:<13}{text}\n"));
        let files = self.input.files.iter().map(|file| self.file(file, &spell));
        let time = format!("time         about {:.0} s", self.seconds.ceil());
        files.chain(rows).chain([time]).collect()
    }

    /// The lines of a file.
    fn file(&self, file: &FileStats, spell: impl Fn(&Setting) -> String) -> String {
        let path = file.path.display();
        let mut lines = format!("{path}: {}, {} points", file.format, file.points);
        // If it is not that of all.
        if let (None, Some(crs)) = (&self.input.crs, &file.crs) {
            lines += &format!(", {}", crs.described(spell));
        }
        let more = file.taken.clone().into_iter().chain(shown(&file.scanners));
        lines.extend(more.map(|line| format!("\n  {line}")));
        lines + "\n"
    }

    /// The lines about the cloud: the name and the text of each. A line without text is not printed.
    fn rows(&self, spell: impl Fn(&Setting) -> String) -> [(&'static str, String); 16] {
        let three = |p: &[f64; 3]| format!("{} {} {}", p[0], p[1], p[2]);
        let spread =
            |p: &Percentiles| format!("{:.4} (5-95 %: {:.4} to {:.4})", p.p50, p.p5, p.p95);
        let mib = |bytes: u64| format!("{} MiB", bytes.div_ceil(1 << 20));
        let input = &self.input;
        let left_out = format!(
            "{} duplicates, {} not finite, {} withheld, {} invalid, {} of other classes, {} far away, {} outside \
             the region",
            self.duplicates,
            input.dropped_non_finite,
            input.withheld,
            input.invalid,
            input.dropped_by_class,
            input.dropped_far,
            input.dropped_by_crop
        );
        let system = match &input.crs {
            Some(crs) => crs.described(spell),
            None if input.files.iter().any(|file| file.crs.is_some()) => "different ones".into(),
            None => "not given".into(),
        };
        let rounding = if self.lattice_exact {
            "exact"
        } else {
            "rounded"
        };
        let normals = self.normals.as_ref();
        [
            (
                "points",
                format!("{} distinct of {} read", self.points, input.read),
            ),
            ("left out", left_out),
            ("columns", self.columns()),
            ("colours", self.colors()),
            (
                "normals",
                normals.map(NormalStats::to_string).unwrap_or_default(),
            ),
            ("system", system),
            ("not read", self.not_read()),
            ("lowest", three(&self.min)),
            ("highest", three(&self.max)),
            (
                "lattice",
                format!("step {} ({rounding})", self.lattice_step),
            ),
            ("spacing", spread(&self.spacing)),
            ("auto radius", spread(&self.auto_radius)),
            ("noise", self.noise_line()),
            (
                "memory",
                format!("any budget from {}", mib(self.memory_minimum)),
            ),
            ("scratch", format!("about {}", mib(self.scratch_bytes))),
            ("mesh", format!("about {}", mib(self.output_bytes))),
        ]
    }
}
