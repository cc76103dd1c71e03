//! The triangles around each vertex of one range, contiguous in memory.

use super::places::Places;
use super::star::{Inspector, NO_MORE, Tally};
use rayon::prelude::*;
use std::ops::Range;

/// Vertices examined by one task.
const TASK: usize = 4096;

/// The stars of a range of vertices, or of a part of it.
#[derive(Debug, Default)]
pub(super) struct Corners {
    first: u32,
    /// Triangles at each vertex of the range.
    degree: Vec<u32>,
    /// For each vertex of the part the place of its next triangle; at the end, the end of its star.
    end: Vec<u32>,
    part: Range<usize>,
    links: Vec<[u32; 2]>,
}

impl Corners {
    /// Resets it to the range of `length` vertices from `first`.
    pub(super) fn reset(&mut self, first: u32, length: usize) {
        self.first = first;
        for words in [&mut self.degree, &mut self.end] {
            words.clear();
            words.reserve_exact(length);
            words.resize(length, 0);
        }
    }

    /// First vertex of the range.
    pub(super) fn first(&self) -> u32 {
        self.first
    }

    fn local(&self, vertex: u32) -> usize {
        // Vertices below the range wrap around to numbers above it.
        vertex.wrapping_sub(self.first) as usize
    }

    /// Counts the triangles at each vertex.
    pub(super) fn count(&mut self, triangles: &[[u32; 3]]) {
        for corner in triangles.iter().flatten() {
            let at = self.local(*corner);
            if let Some(degree) = self.degree.get_mut(at) {
                *degree = degree.saturating_add(1);
            }
        }
    }

    /// The vertices of the range that have triangles.
    pub(super) fn referenced(&self) -> impl Iterator<Item = u32> {
        let degrees = (self.first..).zip(&self.degree);
        degrees.filter(|(_, degree)| **degree > 0).map(|(v, _)| v)
    }

    /// Leaves out the stars of vertices that are not `wanted`.
    pub(super) fn keep(&mut self, wanted: impl Fn(u32) -> bool) {
        for (vertex, degree) in (self.first..).zip(&mut self.degree) {
            if *degree > 0 && !wanted(vertex) {
                *degree = 0;
            }
        }
    }

    /// The part from vertex `start` of the range with at most `most` corners, but at least one vertex; and
    /// its number of corners.
    pub(super) fn part_from(&self, start: usize, most: usize) -> (Range<usize>, usize) {
        let mut corners = 0;
        for (at, &degree) in self.degree.iter().enumerate().skip(start) {
            if at > start && corners + degree as usize > most {
                return (start..at, corners);
            }
            corners += degree as usize;
        }
        (start..self.degree.len(), corners)
    }

    /// Allocates the stars of a part; [`Corners::fill`] fills them.
    pub(super) fn begin(&mut self, part: Range<usize>, corners: usize) {
        let mut next = 0;
        for at in part.clone() {
            self.end[at] = next;
            next += self.degree[at];
        }
        self.part = part;
        if self.links.capacity() < corners {
            self.links = Vec::new();
            self.links.reserve_exact(corners);
        }
        self.links.resize(corners, [0; 2]);
    }

    /// Adds triangles to the stars of their corners in the part.
    pub(super) fn fill(&mut self, triangles: &[[u32; 3]]) {
        for &[x, y, z] in triangles {
            for (v, link) in [(x, [y, z]), (y, [z, x]), (z, [x, y])] {
                let at = self.local(v);
                if self.part.contains(&at) && self.degree[at] > 0 {
                    self.links[self.end[at] as usize] = link;
                    self.end[at] += 1;
                }
            }
        }
    }

    /// Frees the memory of the stars if it exceeds `most` corners.
    pub(super) fn trim(&mut self, most: usize) {
        if self.links.capacity() > most {
            self.links = Vec::new();
        }
    }

    fn star(&self, at: usize) -> Range<usize> {
        let end = self.end[at] as usize;
        end - self.degree[at] as usize..end
    }

    /// Examines all stars of up to `most` triangles, on all threads.
    pub(super) fn inspect(&mut self, most: usize) -> (Tally, Places) {
        let mut tasks = Vec::with_capacity(self.part.len() / TASK + 1);
        let (mut rest, mut start) = (&mut self.links[..], self.part.start);
        while start < self.part.end {
            let end = (start + TASK).min(self.part.end);
            let size = self.degree[start..end].iter().map(|d| *d as usize).sum();
            let (now, later) = rest.split_at_mut(size);
            tasks.push((start..end, now));
            (rest, start) = (later, end);
        }
        let (first, degrees) = (self.first, &self.degree);
        let inspect = |mut inspector: Inspector, (vertices, mut links): (Range<usize>, &mut _)| {
            for at in vertices {
                let all: &mut [[u32; 2]] = std::mem::take(&mut links);
                let (star, later) = all.split_at_mut(degrees[at] as usize);
                if star.len() <= most {
                    inspector.inspect(first + at as u32, star);
                }
                links = later;
            }
            inspector
        };
        tasks
            .into_par_iter()
            .fold(Inspector::default, inspect)
            .map(|inspector| (inspector.tally, inspector.places))
            .reduce(Default::default, |a, b| (a.0 + b.0, a.1.with(b.1)))
    }

    /// The next vertex of the part, from `at` on, with more than `most` triangles: its number in the range,
    /// and its star.
    pub(super) fn large(&mut self, at: usize, most: usize) -> Option<(usize, &mut [[u32; 2]])> {
        let mut rest = at.max(self.part.start)..self.part.end;
        let found = rest.find(|&at| self.degree[at] as usize > most)?;
        let star = self.star(found);
        Some((found, &mut self.links[star]))
    }

    /// After the examination: each vertex of the part that is the higher end of boundary edges, with their
    /// other ends.
    pub(super) fn boundaries(&self) -> impl Iterator<Item = (u32, &[u32])> {
        self.part.clone().filter_map(|at| {
            let words: &[u32] = bytemuck::cast_slice(&self.links[self.star(at)]);
            if words.first().is_none_or(|w| *w == NO_MORE) {
                return None;
            }
            let count = words
                .iter()
                .position(|w| *w == NO_MORE)
                .unwrap_or(words.len());
            Some((self.first + at as u32, &words[..count]))
        })
    }
}
