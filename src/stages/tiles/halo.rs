//! Which pages a tile takes in: how far each of its own reaches. None of it decides what is found, only
//! what is found in the tile.

use super::MOST_HALO;
use crate::geom::aabb::Aabb;
use crate::stages::order::PointStore;

/// Most pages that the reach of one page may touch; it is made shorter where it touches more,
const MOST_NEAR: usize = 96;

/// or so many, if few of them are the tile's for its sake.
const MOST_SHARED: usize = 1024;

/// So many more pages are taken in for each that reaches shorter: no more than answering its points in
/// the whole store would take.
const MOST_MORE: usize = 32;

/// Where a reach touches no more pages it is made longer,
const FEW_NEAR: usize = 20;

/// up to so many times.
const MOST_TIMES: u64 = 4;

/// How far a page reaches.
#[derive(Debug)]
pub(super) struct Reach {
    pub page: usize,
    /// Squared.
    pub reach2: u64,
    /// The pages within it.
    pub near: Vec<u32>,
}

/// All pages of a tile of `size` pages, of which `own` are asked for, and the reaches of these; shorter
/// than usual where the halo would outgrow the tile, as it would around scattered outliers.
pub(super) fn halo(store: &PointStore, own: &[usize], size: usize) -> (Vec<usize>, Vec<Reach>) {
    let most = size * (1 + MOST_HALO) + MOST_NEAR;
    let mut shrink = 1;
    loop {
        let near = |&page: &usize| near_pages(store, page, reach(store, page, shrink), MOST_NEAR);
        let mut reaches: Vec<_> = own.iter().map(near).collect();
        let mut wanted = own.to_vec();
        let near = reaches.iter().flat_map(|reach| &reach.near);
        wanted.extend(near.map(|page| *page as usize));
        wanted.sort_unstable();
        wanted.dedup();
        if wanted.len() <= most || shrink > 1 << 40 {
            if shrink == 1 {
                share(store, &mut wanted, &mut reaches, most);
            }
            return (wanted, reaches);
        }
        shrink *= 2;
    }
}

/// Makes reaches long again that touched too many pages, where these are the tile's already or
/// serve many: around a dense middle all pages farther out reach over the same ones.
fn share(store: &PointStore, wanted: &mut Vec<usize>, reaches: &mut [Reach], most: usize) {
    let full = |page: usize| reach(store, page, 1);
    let short: Vec<_> = (reaches.iter_mut())
        .filter(|reach| reach.reach2 < full(reach.page).pow(2))
        .collect();
    let mut left = (short.len() * MOST_MORE).min(most.saturating_sub(wanted.len()));
    for short in short {
        let mut reach = full(short.page);
        while reach * reach > short.reach2 {
            let longer = near_pages(store, short.page, reach, MOST_SHARED);
            let pages = longer.near.iter().map(|page| *page as usize);
            let mut more: Vec<_> = pages.filter(|p| wanted.binary_search(p).is_err()).collect();
            if more.len() <= left {
                left -= more.len();
                wanted.append(&mut more);
                wanted.sort_unstable();
                *short = longer;
                break;
            }
            reach /= 2;
        }
    }
}

/// How far a page should reach.
fn reach(store: &PointStore, page: usize, shrink: i64) -> u64 {
    let bounds = store.page_box(page);
    let reach = (bounds.longest_side() * 7 / 8 / shrink).max(1) as u64;
    if shrink == 1 {
        // Along a line neighbours are far, and pages few.
        return reach * lonely(store, bounds, reach);
    }
    reach
}

/// How far a page may reach, at most `reach`, to touch at most `most` pages.
fn near_pages(store: &PointStore, page: usize, mut reach: u64, most: usize) -> Reach {
    let bounds = store.page_box(page);
    loop {
        let mut near = Vec::new();
        store.pages_near(bounds, reach * reach, &mut |p| {
            near.push(p as u32);
            near.len() <= most
        });
        let fits = near.len() <= most;
        if fits || reach <= 1 {
            return Reach {
                page,
                reach2: if fits { reach * reach } else { 0 },
                near: if fits { near } else { vec![page as u32] },
            };
        }
        reach /= 2;
    }
}

/// How many times as far a page can reach and still touch few pages.
fn lonely(store: &PointStore, bounds: &Aabb, reach: u64) -> u64 {
    for times in [MOST_TIMES, MOST_TIMES / 2] {
        let (mut count, reach) = (0, reach * times);
        store.pages_near(bounds, reach * reach, &mut |_| {
            count += 1;
            count <= FEW_NEAR
        });
        if count <= FEW_NEAR {
            return times;
        }
    }
    1
}
