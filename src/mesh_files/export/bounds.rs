//! The bounds of the vertices of the mesh.

use super::number::Numbering;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_geom::Point;
use outcrop_stages::ids::{Id, PageNumber};
use outcrop_stages::order::PointStore;

/// The lowest and the highest coordinates of the points that are vertices, along each axis. Pages are read in
/// the order of their boxes, until none can have a point beyond those that were found.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`], [`outcrop_disk::error::Error::Cancelled`].
pub fn bounds(
    store: &PointStore,
    numbering: &Numbering,
    workspace: &Workspace,
) -> Result<[Point; 2]> {
    workspace.once("bounds", |_| {
        let list = store.pages() * 4 + store.page_size() * 32;
        let _held = workspace.reserve("export: bounds", list as u64)?;
        let is_used = |page: &PageNumber| {
            let ids = store.page_ids(page.index());
            numbering.vertex(Id::at(ids.start)) < numbering.vertex(Id::at(ids.end))
        };
        let pages = (0..store.pages()).map(PageNumber::at);
        let mut pages: Vec<_> = pages.filter(is_used).collect();
        let mut found = [[i32::MAX; 3], [i32::MIN; 3]];
        let mut points = Vec::new();
        for axis in 0..3 {
            for side in 0..2 {
                // Ascending for the lowest, descending for the highest.
                let key = |page: PageNumber| {
                    let page = store.page_box(page.index());
                    [page.min[axis], -page.max[axis]][side]
                };
                pages.sort_unstable_by_key(|page| (key(*page), *page));
                for &page in &pages {
                    let reached = [found[0][axis].into(), -i64::from(found[1][axis])][side];
                    if i64::from(key(page)) >= reached {
                        break;
                    }
                    workspace.check_cancel()?;
                    add(store, numbering, page.index(), &mut points, &mut found)?;
                }
            }
        }
        Ok(found)
    })
}

/// Adds the vertices of a page to the bounds.
fn add(
    store: &PointStore,
    numbering: &Numbering,
    page: usize,
    points: &mut Vec<Point>,
    found: &mut [Point; 2],
) -> Result<()> {
    points.clear();
    store.read_pages(page..page + 1, points)?;
    for (id, point) in store.page_ids(page).zip(&*points) {
        if numbering.used(Id::at(id)) {
            for (axis, x) in point.iter().enumerate() {
                found[0][axis] = found[0][axis].min(*x);
                found[1][axis] = found[1][axis].max(*x);
            }
        }
    }
    Ok(())
}
