//! Decodes input files one after another into a spool.

use super::formats;
use super::input::Input;
use super::point_format::{Claims, PointFile};
use super::taken::Taken;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_ply::Scalar;
use outcrop_points::colors::depth_of;
use outcrop_points::columns::{Also, SCANNER, Wanted};
use outcrop_points::crop::Nearby;
use outcrop_points::frames::Frame;
use outcrop_points::source::Source;
use outcrop_points::spool::SourceWriter;
use outcrop_points::systems::Systems;
use outcrop_points::{Classes, Crs, CrsSource, Layout, Selection, Spool, of_prj, prj_of};
use outcrop_points::{FileStats, IngestStats};
use std::iter::once;
use std::path::PathBuf;

/// Decodes all inputs into the spool `name`.
pub(super) fn read_all(
    paths: &[PathBuf],
    selection: &Selection,
    name: &str,
    stats: &mut IngestStats,
    workspace: &Workspace,
) -> Result<Spool> {
    let classes = &selection.classes;
    let crop = selection.crop.as_ref();
    let nearby = crop.map(|crop| Nearby::of(crop, &workspace.memory));
    let nearby = nearby.transpose()?;
    let (mut section, mut frames, mut values) = (0, Vec::new(), Vec::new());
    let mut sources = Vec::new();
    let mut systems = Systems::default();
    let mut shared = false;
    let mut present = Vec::new();
    let mut taken = Taken::default();
    for path in paths {
        workspace.check_cancel()?;
        let opened = Opened::new(
            Input::open(path, &formats::is_cloud, workspace)?,
            &selection.layout,
        )?;
        let number = sources.len() as u32;
        let scanners = selection.scanners && opened.has_scanners();
        let columns = opened.file.columns();
        let depth = opened.file.color_depth();
        let also = Also {
            scanners,
            normals: selection.normals,
            classes: *classes != Classes::All && !opened.claims.classes,
            depths: selection.depths && depth_of(&columns, depth, None).is_none(),
        };
        let wanted = Wanted::of(&selection.attributes, &columns, also)?;
        let has_classes = opened.claims.classes || wanted.class.is_some();
        let target = SourceWriter::new(workspace, name, section, number, classes, &wanted)?
            .within(nearby.as_ref(), opened.claims.native);
        let outside =
            |nearby: &Nearby<'_>| opened.file.lies_outside(&opened.input, nearby, workspace);
        let mut warnings = if let Some(bounds) = nearby.as_ref().and_then(outside) {
            target.skip(opened.claims.likely_points, bounds);
            Vec::new()
        } else {
            if !opened.file.says_what_it_reads() {
                opened
                    .input
                    .expect(once(0..opened.input.bytes), workspace)?;
            }
            match opened.file.read(&opened.input, &target) {
                // Tasks read all files at the same time.
                Err(Error::Left(_)) => {
                    shared = true;
                    Vec::new()
                }
                other => other?,
            }
        };
        if *classes != Classes::All && !has_classes {
            warnings.push("its points have no class, all of them are kept".to_owned());
        }
        let found = opened.file.found();
        let columns = wanted.found(&found);
        present.extend(found);
        let path = &opened.input.path;
        taken.add(path, opened.claims.format, opened.file.taken());
        let read = target.stats();
        let (next, more, more_values) = target.end();
        section = next;
        frames.extend(more);
        if !more_values.frames.is_empty() {
            // Frames without values come before.
            values.resize(frames.len() - more_values.frames.len(), Frame::default());
            values.extend(more_values.frames);
        }
        let source = Source {
            native: opened.claims.native,
            stats: read,
            text: opened.claims.text,
            cut: false,
            columns,
            spans: more_values.spans,
            depth,
            tally: more_values.tally,
        };
        let shown = |w: String| format!("{}: {w}", path.display());
        stats.warnings.extend(warnings.into_iter().map(shown));
        let (crs, unusable) = opened.crs();
        stats.warnings.extend(unusable);
        count(
            stats,
            &opened,
            &source,
            crs.as_ref().map(Crs::without_texts),
        );
        if let Some(crs) = crs {
            systems.add(path, crs);
        }
        sources.push(source);
    }
    if shared {
        return Err(Error::left());
    }
    if !values.is_empty() {
        values.resize(frames.len(), Frame::default());
    }
    selection.attributes.check(&present)?;
    taken.check(&selection.layout)?;
    stats.warnings.extend(taken.warnings());
    if let Some(crop) = crop.filter(|_| stats.kept == 0) {
        crop.check_met(&sources)?;
    }
    let wkt = stats.compare(systems, selection.crs.as_ref(), &*workspace.observer);
    let stats = std::mem::take(stats);
    Ok(Spool::of(name, (frames, values), sources, stats, wkt))
}

/// An input file with its header.
pub(super) struct Opened {
    pub(super) input: Input,
    pub(super) file: Box<dyn PointFile>,
    pub(super) claims: Claims,
}

impl Opened {
    pub(super) fn new(input: Input, layout: &Layout) -> Result<Self> {
        let file = formats::open(&input, layout)?;
        let claims = file.claims(&input);
        Ok(Self {
            input,
            file,
            claims,
        })
    }

    /// True if the file tells where the scanners were, and which of them saw a point.
    pub(super) fn has_scanners(&self) -> bool {
        let columns = self.file.columns();
        let scanner = columns.iter().find(|c| c.name == SCANNER);
        scanner.is_some_and(|c| c.scalar == Scalar::U16) && !self.file.scanners().is_empty()
    }

    /// The reference system that the file gives, or else a `.prj` file beside it; a warning about that.
    pub(super) fn crs(&self) -> (Option<Crs>, Option<String>) {
        let prj = prj_of(&self.input.path);
        let beside = of_prj(&prj);
        let Some(own) = self.file.crs(&self.input) else {
            return beside;
        };
        let same = |other: &Crs| {
            let heights = own.vertical.is_none() || other.vertical == own.vertical;
            own.horizontal.is_some() && other.horizontal == own.horizontal && heights
        };
        if own.source == CrsSource::Comments && beside.0.as_ref().is_some_and(same) {
            // The same system, told as a text.
            return beside;
        }
        let other = beside.0.filter(|beside| beside.differs(&own));
        let warning = other.map(|beside| {
            format!(
                "{}: it gives {beside}, but {} itself gives {own}, which is taken",
                prj.display(),
                self.input.path.display()
            )
        });
        (Some(own), warning)
    }
}

/// Adds a file, of whose points `source` was read.
fn count(all: &mut IngestStats, opened: &Opened, source: &Source, crs: Option<Crs>) {
    let stats = &source.stats;
    all.read += stats.read;
    all.kept += stats.kept;
    all.dropped_non_finite += stats.dropped;
    all.withheld += stats.withheld;
    all.invalid += stats.invalid;
    all.dropped_by_class += stats.unwanted;
    all.dropped_by_crop += stats.outside;
    all.skipped_by_crop += stats.skipped;
    let bounds = source.bounds();
    let taken = opened.file.taken();
    let columns = opened.file.found();
    let read = source.reads_colors().then_some(&source.tally);
    let colors = depth_of(&columns, source.depth, read);
    all.files.push(FileStats {
        path: opened.input.path.clone(),
        format: opened.claims.format,
        bytes: opened.input.size,
        fetched: opened.input.fetched(),
        columns: columns.into_iter().map(|c| c.name).collect(),
        taken: taken.map(|(taken, _)| taken.to_owned()),
        guessed: taken.is_some_and(|(_, guessed)| guessed),
        colors,
        claimed: opened.claims.points,
        points: stats.read,
        kept: stats.kept,
        dropped_non_finite: stats.dropped,
        withheld: stats.withheld,
        invalid: stats.invalid,
        dropped_by_class: stats.unwanted,
        dropped_by_crop: stats.outside,
        skipped_by_crop: stats.skipped,
        dropped_far: 0,
        min: bounds.map(|b| b[0]),
        max: bounds.map(|b| b[1]),
        scanners: opened.file.scanners(),
        crs,
    });
}
