//! Bridges: triangles that hang by one edge and touch another part with the opposite vertex.

use super::EXCHANGE_BUFFER;
use crate::error::Result;
use crate::spill::{Exchange, Sections};
use crate::stages::blocks::Blocks;
use crate::stages::surface::star::{Link, Star};
use crate::workspace::Workspace;

/// The bridge triangles, `[block, i, j, k]`, for each block they touch.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`].
pub fn find(
    around: &Sections<3>,
    bytes: impl Fn(usize) -> u64 + Sync,
    blocks: Blocks,
    workspace: &Workspace,
) -> Result<Sections<4>> {
    let _held = workspace.reserve("exchange", EXCHANGE_BUFFER)?;
    let exchange = Exchange::new(workspace, "repair.bridges", EXCHANGE_BUFFER);
    workspace.for_each_unit("repair: block", blocks.count(), bytes, |block| {
        let triangles = around.get(block)?;
        let star = Star::of(blocks.ids(block), &triangles);
        let mut link = Link::default();
        let mut found = Vec::new();
        for v in star.ids() {
            let at = star.at(v);
            link.set(v, at.iter().map(|&n| triangles[n as usize]));
            if link.groups() < 2 {
                continue;
            }
            // A triangle that is a fan by itself has both its edges at v on the boundary. If there
            // is no larger fan, the first stays, so that v stays.
            let size = |group| (0..at.len()).filter(|&i| link.group(i) == group).count();
            let larger = (0..link.groups()).any(|group| size(group) > 1);
            for (index, &n) in at.iter().enumerate() {
                let group = link.group(index);
                if size(group) == 1 && (larger || group > 0) {
                    found.push(n);
                }
            }
        }
        found.sort_unstable();
        found.dedup();
        let mut sent = Vec::new();
        for n in found {
            let t = triangles[n as usize];
            sent.push([blocks.of(t[0]), t[0], t[1], t[2]]);
            sent.extend(blocks.visited(t).map(|b| [b, t[0], t[1], t[2]]));
        }
        // A triangle may be found from several of its vertices, in several blocks.
        exchange.send(&sent)
    })?;
    exchange.deliver_unique(workspace, blocks.count())
}
