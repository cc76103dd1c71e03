//! A cloud as pages of points in curve order.

use super::pages::PageWriter;
use super::shape::{Items, Kind, Shape, side, unusable, usable};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::vector::V3;
use std::path::Path;

/// Reads a cloud: gives the number of its distinct points, and the positions of some, in the order of a curve, until
/// all are given. Its scratch files stay if the second argument is true. It returns false if positions were rounded.
pub type Clouds =
    fn(&Path, bool, &Workspace, &mut dyn FnMut(u64, &[V3]) -> Result<()>) -> Result<bool>;

/// Reads a cloud. If there is a unit, the pages survive the attempt.
pub(super) fn read(
    path: &Path,
    name: &'static str,
    clouds: Clouds,
    unit: Option<&Unit<'_>>,
    workspace: &Workspace,
) -> Result<Shape> {
    let (mut writer, mut count) = (None, 0);
    // A unit that is killed before its end needs the scratch files again.
    let exact = clouds(path, unit.is_some(), workspace, &mut |all, positions| {
        count = all;
        let writer = match &mut writer {
            Some(writer) => writer,
            None => writer.insert(PageWriter::new(workspace, name, all, unit)?),
        };
        positions
            .iter()
            .try_for_each(|position| match usable(*position) {
                true => writer.push(*position),
                false => Err(unusable(path, "points", *position)),
            })
    })?;
    let Some(writer) = writer else {
        return Err(Error::input(path, "points", "none", "one or more"));
    };
    let pages = writer.finish()?;
    let mut side = side(path, Kind::Cloud, pages.bounds());
    side.points = count;
    side.exact = exact;
    Ok(Shape {
        name,
        side,
        items: Items::Cloud(pages),
    })
}
