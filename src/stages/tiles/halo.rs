//! The pages of a tile and its halo, and the reach of each of its own pages. This decides only which queries
//! are answered in the tile, not their results.

use super::MOST_HALO;
use super::candidates::within;
use crate::ids::PageNumber;
use crate::order::PointStore;
use outcrop_geom::aabb::Aabb;
use outcrop_paper::kernels::{BLOCK, CoveredBoxes, Level, near_boxes};

/// Most pages within the reach of a page; a reach that touches more is shortened.
const MOST_NEAR: usize = 96;

/// The same limit where most of these pages are already in the tile for other pages.
const MOST_SHARED: usize = 1024;

/// Most additional pages loaded for each page with a shortened reach. Answering its points from the whole
/// store would read about as many.
const MOST_MORE: usize = 32;

/// A reach is lengthened if it then still touches at most this number of pages.
const FEW_NEAR: usize = 20;

/// Largest factor by which a reach is lengthened.
const MOST_TIMES: u64 = 4;

/// Most pages, for each page of a tile, on the list that is searched for near pages.
const MOST_AROUND: usize = 8;

/// The reach of a page.
#[derive(Debug)]
pub(super) struct Reach {
    pub page: usize,
    /// Squared distance, in squared steps.
    pub reach2: u64,
    /// The pages within this distance.
    pub near: Vec<PageNumber>,
}

/// All pages of a tile of `size` pages whose pages `own` are queried, and the reaches of the latter. Reaches
/// are shorter than usual where the halo would be too large for the tile, as around scattered outliers.
pub(super) fn halo(store: &PointStore, own: &[usize], size: usize) -> (Vec<usize>, Vec<Reach>) {
    if own.is_empty() {
        return (Vec::new(), Vec::new());
    }
    let most = size * (1 + MOST_HALO) + MOST_NEAR;
    let mut around = ReachablePages::of(store, own, size);
    let mut shrink = 1;
    loop {
        let near = |&page: &usize| {
            let reach = reach(&mut around, page, shrink);
            near_pages(&mut around, page, reach, MOST_NEAR)
        };
        let mut reaches: Vec<_> = own.iter().map(near).collect();
        let mut wanted = own.to_vec();
        let near = reaches.iter().flat_map(|reach| &reach.near);
        wanted.extend(near.map(|page| page.index()));
        wanted.sort_unstable();
        wanted.dedup();
        if wanted.len() <= most || shrink > 1 << 40 {
            if shrink == 1 {
                share(&mut around, &mut wanted, &mut reaches, most);
            }
            return (wanted, reaches);
        }
        shrink *= 2;
    }
}

/// Restores reaches that were shortened, if the pages they touch are already in the tile or are few for all
/// shortened reaches together: around a dense centre, all outer pages reach the same pages.
fn share(
    around: &mut ReachablePages<'_>,
    wanted: &mut Vec<usize>,
    reaches: &mut [Reach],
    most: usize,
) {
    let short: Vec<_> = (reaches.iter_mut())
        .filter(|short| short.reach2 < reach(around, short.page, 1).pow(2))
        .collect();
    let mut left = (short.len() * MOST_MORE).min(most.saturating_sub(wanted.len()));
    for short in short {
        let mut reach = reach(around, short.page, 1);
        while reach * reach > short.reach2 {
            let longer = near_pages(around, short.page, reach, MOST_SHARED);
            let pages = longer.near.iter().map(|page| page.index());
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

/// The desired reach of a page.
fn reach(around: &mut ReachablePages<'_>, page: usize, shrink: u64) -> u64 {
    let reach = full(around.store.page_box(page).longest_side());
    if shrink == 1 {
        // Along a line, neighbours are far and pages few.
        return reach * lonely(around, page, reach);
    }
    (reach / shrink).max(1)
}

/// The usual reach of a page whose box has this longest side.
fn full(longest: i64) -> u64 {
    (longest * 7 / 8).max(1) as u64
}

/// The longest reach, up to `reach`, that touches at most `most` pages; found by halving.
fn near_pages(around: &mut ReachablePages<'_>, page: usize, mut reach: u64, most: usize) -> Reach {
    let mut near = vec![PageNumber::at(page)];
    while reach > 0 {
        if let (found, true) = around.pages(page, reach, most) {
            near = found.to_vec();
            break;
        }
        reach /= 2;
    }
    let reach2 = reach * reach;
    Reach { page, reach2, near }
}

/// The factor by which a reach can be lengthened and still touch few pages.
fn lonely(around: &mut ReachablePages<'_>, page: usize, reach: u64) -> u64 {
    let mut factors = [MOST_TIMES, MOST_TIMES / 2].into_iter();
    let few = |times: &u64| around.pages(page, reach * times, FEW_NEAR).1;
    factors.find(few).unwrap_or(1)
}

/// The pages that any page of a tile can reach, if they are not too many; then the tree of boxes need not be
/// searched for each page.
struct ReachablePages<'a> {
    store: &'a PointStore,
    level: Level,
    /// The boxes of the pages within `reach` of the tile's box, with their numbers.
    boxes: CoveredBoxes,
    reach: u64,
    found: Vec<PageNumber>,
}

impl<'a> ReachablePages<'a> {
    fn of(store: &'a PointStore, own: &[usize], size: usize) -> Self {
        let boxes = || own.iter().map(|page| store.page_box(*page));
        let all = boxes().fold(Aabb::EMPTY, |all, page| all.union(*page));
        let mut sides: Vec<_> = boxes().map(Aabb::longest_side).collect();
        sides.sort_unstable();
        let longest = sides.get(sides.len() * 3 / 4).copied().unwrap_or(0);
        let mut around = Self {
            store,
            level: Level::best(),
            boxes: CoveredBoxes::default(),
            reach: full(longest) * MOST_TIMES,
            found: Vec::new(),
        };
        let most = MOST_AROUND * size;
        if store.pages_near(&all, around.reach, most, &mut around.found) {
            around.boxes.set(|boxes| {
                for &page in &around.found {
                    let Aabb { min, max } = *store.page_box(page.index());
                    boxes.push(min, max, page.get());
                }
            });
        } else {
            around.reach = 0;
        }
        around
    }

    /// The pages within `reach` of a page of the tile, ascending, and true, if there are at most `most`; else
    /// only some of them, and false.
    fn pages(&mut self, page: usize, reach: u64, most: usize) -> (&[PageNumber], bool) {
        let bounds = self.store.page_box(page);
        if reach <= self.reach {
            let limit = within(bounds, reach * reach);
            self.found
                .resize(self.boxes.len() + BLOCK, PageNumber::default());
            let found = bytemuck::cast_slice_mut(&mut self.found);
            let count = near_boxes(self.level, &self.boxes, limit, found);
            return (&self.found[..count], count <= most);
        }
        let all = (self.store).pages_near(bounds, reach, most, &mut self.found);
        (&self.found, all)
    }
}
