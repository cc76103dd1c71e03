//! Entwine Point Tiles: an `ept.json`, a hierarchy of nodes with their numbers of points, and a file for each node.
//! Each point is in one node. (entwine.io/entwine-point-tile.html)

mod hierarchy;
mod info;
mod pins;
mod rows;
mod tiles;

use super::input::Input;
use super::point_format::{Claims, Head, PointFile, PointFormat, Refusal};
use super::reads::{Means, Reads};
use info::{Data, Info};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_points::Format;
use outcrop_points::columns::Column;
use outcrop_points::crop::Nearby;
use outcrop_points::spool::SourceWriter;
use outcrop_points::wkt::well_known;
use outcrop_points::{Crs, CrsSource};
use tiles::Kind;

/// The name of the file that describes a set of tiles.
pub(super) const NAME: &str = "ept.json";

/// The format.
pub(super) struct Ept;

impl PointFormat for Ept {
    fn names(&self) -> &'static str {
        "EPT"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &[]
    }

    fn recognize(&self, head: &Head) -> Result<bool, Refusal> {
        let text = String::from_utf8_lossy(&head.bytes);
        Ok(text.trim_start().starts_with('{') && text.contains("\"hierarchyType\""))
    }

    fn open(&self, input: &Input, _: &Head) -> Result<Box<dyn PointFile>> {
        let info = Info::read(input)?;
        let kind = Kind::of(input, &info)?;
        Ok(Box::new(Tiles { info, kind }))
    }
}

/// A set of tiles.
struct Tiles {
    info: Info,
    kind: Kind,
}

impl PointFile for Tiles {
    fn claims(&self, input: &Input) -> Claims {
        let [low, high] = self.info.conforming;
        Claims {
            classes: self.kind.knows_classes(),
            version: self.info.version.clone(),
            bounds: Some([low, high]),
            likely_points: self.info.points,
            ..Claims::new(input, Format::EPT, self.kind.native(), self.info.points, 1)
        }
    }

    fn crs(&self, _: &Input) -> Option<Crs> {
        let text = self.info.wkt.as_deref().filter(|text| !text.is_empty())?;
        Some(Crs {
            source: CrsSource::WellKnownText,
            ..well_known(text)
        })
    }

    fn columns(&self) -> Vec<Column> {
        self.kind.columns()
    }

    fn says_what_it_reads(&self) -> bool {
        true
    }

    fn lies_outside(&self, _: &Input, nearby: &Nearby<'_>, _: &Workspace) -> Option<[[f64; 3]; 2]> {
        let outside = !nearby.may_meet(self.info.cube);
        outside.then(|| self.kind.in_native(self.info.conforming))
    }

    fn reads(&self, input: &Input, nearby: Option<&Nearby<'_>>, means: Means<'_>) -> Result<Reads> {
        let (bytes, points) = self.kind.sample(input, &self.info)?;
        let bytes_of = |wanted: u64| {
            let bytes = u128::from(wanted) * u128::from(bytes) / u128::from(points.max(1));
            u64::try_from(bytes).unwrap_or(u64::MAX)
        };
        let all = self.info.points;
        let mut reads = Reads {
            bytes: bytes_of(all),
            bytes_of_all: bytes_of(all),
            points: all,
            parts: None,
            is_estimated: self.info.data != Data::Binary,
        };
        if nearby.is_some() {
            let nodes = hierarchy::read(input, &self.info, nearby, means)?.all;
            reads.points = nodes.iter().map(|node| node.points).sum();
            reads.bytes = bytes_of(reads.points);
            reads.parts = Some(nodes.len() as u64);
        }
        Ok(reads)
    }

    fn read(&self, input: &Input, target: &SourceWriter<'_>) -> Result<Vec<String>> {
        let mut nodes = hierarchy::read(
            input,
            &self.info,
            target.region(),
            Means::of(target.workspace),
        )?;
        let found: u64 = nodes.all.iter().map(|node| node.points).sum();
        let left_out = self.info.points.saturating_sub(found);
        if left_out > 0 && target.region().is_some() {
            target.skip(left_out, self.kind.in_native(self.info.conforming));
        }
        nodes.files.extend(self.kind.root().cloned());
        let begun = pins::check(input, &mut nodes.files, target)?;
        self.kind
            .read(input, &self.info, (&nodes.all, begun), target)?;
        let mut warnings = Vec::new();
        if target.region().is_none() && found != self.info.points {
            let claimed = self.info.points;
            warnings.push(format!(
                "{NAME} claims {claimed} points, its hierarchy has {found}"
            ));
        }
        Ok(warnings)
    }
}
