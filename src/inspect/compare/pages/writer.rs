//! Writing of pages, and their description for a later attempt.

use super::{Item, Pages};
use outcrop_disk::error::Result;
use outcrop_disk::spill::{LocalTable, Row, row};
use outcrop_disk::workspace::memory::Reservation;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::boxes::BoxTree;
use outcrop_geom::vector::{Box3, V3};
use serde::{Deserialize, Serialize};
use std::marker::PhantomData;

/// Least number of items per page.
const LEAST: u64 = 64;

/// Largest number of pages.
const MOST_PAGES: u64 = 1 << 17;

/// Boxes of a section.
const BOXES: usize = 4096;

row! {
    /// The box around a page.
    pub(super) struct PageBox {
        /// The bits of six `f64`: lowest and highest corner.
        corners: [u32; 12],
    }
    unpacked
}

/// Pages that survive the attempt, by the name of their file.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound = "")]
pub(crate) struct KeptPages<T> {
    name: String,
    page: usize,
    items: PhantomData<fn() -> T>,
}

impl<T: Item> KeptPages<T> {
    /// Opens them, with the tree of their boxes.
    pub(crate) fn open(&self, workspace: &Workspace) -> Result<Pages<T>> {
        let stored = LocalTable::<T>::kept(workspace, &self.name)?;
        let kept = LocalTable::<PageBox>::kept(workspace, &boxes_of(&self.name))?;
        let held = reserve::<T>(workspace, stored.count() as u64, self.page)?;
        let (mut boxes, mut some) = (Vec::with_capacity(stored.count()), Vec::new());
        for section in 0..kept.count() {
            kept.get_into(section, &mut some)?;
            boxes.extend(some.iter().map(|PageBox { corners }| {
                let [min, max]: [V3; 2] = bytemuck::cast(*corners);
                Box3 { min, max }
            }));
        }
        Ok(Pages::of(stored, boxes, self.page, held))
    }
}

/// The name of the file of boxes.
fn boxes_of(name: &str) -> String {
    format!("{name}.boxes")
}

/// Memory for the boxes of pages and for a page that is written. The boxes are dropped before the tree grows to its
/// size.
fn reserve<T: Row>(workspace: &Workspace, pages: u64, page: usize) -> Result<Reservation> {
    let index = pages * BoxTree::<f64>::BYTES + (page * 2 * size_of::<T>()) as u64;
    workspace.reserve("compare: boxes", index + 4096)
}

impl<T: Item> Pages<T> {
    /// The pages that `make` makes, or that it made in an earlier attempt.
    pub(crate) fn once(
        workspace: &Workspace,
        step: &str,
        make: impl FnOnce(&Unit<'_>) -> Result<Self>,
    ) -> Result<Self> {
        let make = |unit: &Unit<'_>| {
            let pages = make(unit)?;
            let kept = pages.kept();
            Ok((pages, kept))
        };
        workspace.once_opened(step, make, |kept| kept.open(workspace))
    }

    /// Their description, with which a later attempt opens them.
    pub(crate) fn kept(&self) -> KeptPages<T> {
        KeptPages {
            name: self.stored.name().to_owned(),
            page: self.page,
            items: PhantomData,
        }
    }

    fn of(stored: LocalTable<T>, boxes: Vec<Box3>, page: usize, held: Reservation) -> Self {
        let bounds = boxes.iter().copied().fold(Box3::EMPTY, Box3::union);
        let boxes = boxes.into_iter().map(|Box3 { min, max }| [min, max]);
        Self {
            stored,
            tree: BoxTree::of(boxes),
            bounds,
            page,
            _held: held,
        }
    }
}

/// Writes [`Pages`] in order.
#[derive(Debug)]
pub(crate) struct PageWriter<'a, T: Row> {
    stored: LocalTable<T>,
    /// The unit that writes them, if they survive the attempt.
    unit: Option<&'a Unit<'a>>,
    page: usize,
    pending: Vec<T>,
    boxes: Vec<Box3>,
    held: Reservation,
}

impl<'a, T: Item> PageWriter<'a, T> {
    /// Starts the scratch file `name` for `count` items. If there is a unit, they survive the attempt once it is
    /// finished.
    pub(crate) fn new(
        workspace: &Workspace,
        name: &str,
        count: u64,
        unit: Option<&'a Unit<'a>>,
    ) -> Result<Self> {
        let page = count.div_ceil(MOST_PAGES).max(LEAST) as usize;
        let pages = count.div_ceil(page as u64);
        Ok(Self {
            held: reserve::<T>(workspace, pages, page)?,
            stored: match unit {
                Some(_) => LocalTable::kept(workspace, name)?,
                None => LocalTable::create(workspace, name)?,
            },
            unit,
            page,
            pending: Vec::with_capacity(page),
            boxes: Vec::with_capacity(pages as usize),
        })
    }

    pub(crate) fn push(&mut self, item: T) -> Result<()> {
        self.pending.push(item);
        if self.pending.len() == self.page {
            self.flush()?;
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<()> {
        let bounds = self.pending.iter().map(T::bounds);
        let bounds = bounds.fold(Box3::EMPTY, Box3::union);
        let section = self.boxes.len();
        match self.unit {
            Some(unit) => self.stored.put_by(unit, section, &self.pending)?,
            None => self.stored.put(section, &self.pending)?,
        }
        self.boxes.push(bounds);
        self.pending.clear();
        Ok(())
    }

    pub(crate) fn finish(mut self) -> Result<Pages<T>> {
        if !self.pending.is_empty() {
            self.flush()?;
        }
        if let Some(unit) = self.unit.filter(|unit| unit.is_resumable()) {
            let kept = LocalTable::<PageBox>::kept(unit, &boxes_of(self.stored.name()))?;
            for (section, boxes) in self.boxes.chunks(BOXES).enumerate() {
                let corners = boxes.iter().map(|Box3 { min, max }| PageBox {
                    corners: bytemuck::cast([*min, *max]),
                });
                kept.put_by(unit, section, &corners.collect::<Vec<_>>())?;
            }
        }
        let Self {
            stored,
            boxes,
            page,
            held,
            ..
        } = self;
        Ok(Pages::of(stored, boxes, page, held))
    }
}
