//! The codec of triangles: one byte for most of them, which names an edge and a vertex of those that came last.

use super::indices::{opened, put_after, put_plain, take_after};
use super::{Damaged, take};

/// The first byte of a stream, with the version in its low half.
const HEADER: u8 = 0xe0;

/// Vertices and edges that are remembered.
const RECENT: usize = 16;

/// Pairs of places of the second and third corner that need no byte of their own: those that are frequent.
const PAIRS: [u8; RECENT] = [
    0x00, 0x76, 0x87, 0x56, 0x67, 0x78, 0xa9, 0x86, 0x65, 0x89, 0x68, 0x98, 0x01, 0x69, 0, 0,
];

/// Places of that table that codes name.
const NAMED: usize = 14;

/// The code of a triangle whose edges are not remembered, and those of these whose pair is not in the table: with the
/// next vertex as the first corner, and with any.
const ALONE: u8 = 0xf0;
const WITH_NEXT: u8 = 0xfe;
const WITH_ANY: u8 = 0xff;

/// Places of corners: the next new vertex, and an index of its own. Others are those of remembered vertices.
const NEXT: u8 = 0;
const OWN: u8 = 15;

/// Third corners that are the vertex before the last index, and the one after it; in version 0 they are remembered ones.
const BEFORE: u8 = 13;
const AFTER: u8 = 14;

/// The last of something; 0 is the latest.
struct Recent<T> {
    all: [T; RECENT],
    end: usize,
}

impl<T: Copy> Recent<T> {
    fn push(&mut self, one: T) {
        self.all[self.end] = one;
        self.end = (self.end + 1) % RECENT;
    }

    fn at(&self, place: usize) -> T {
        self.all[(self.end + 2 * RECENT - 1 - place) % RECENT]
    }

    fn find<F>(&self, found: impl Fn(T) -> Option<F>) -> Option<(u8, F)> {
        (0..RECENT).find_map(|place| Some((place as u8, found(self.at(place))?)))
    }
}

/// The state that encoder and decoder share: edges and vertices of the triangles before.
struct Known {
    next: u32,
    last: u32,
    edges: Recent<[u32; 2]>,
    vertices: Recent<u32>,
}

const NOTHING: Known = Known {
    next: 0,
    last: 0,
    edges: Recent {
        all: [[u32::MAX; 2]; RECENT],
        end: 0,
    },
    vertices: Recent {
        all: [u32::MAX; RECENT],
        end: 0,
    },
};

impl Known {
    fn is_next(&mut self, vertex: u32) -> bool {
        let is = vertex == self.next;
        self.next = self.next.wrapping_add(is.into());
        is
    }

    fn place(&self, vertex: u32) -> Option<u8> {
        let same = |other| (other == vertex).then_some(());
        self.vertices.find(same).map(|found| found.0)
    }

    /// Remembers a triangle at an edge that was known.
    fn push_third(&mut self, [a, b, c]: [u32; 3], is_new: bool) {
        if is_new {
            self.vertices.push(c);
        }
        self.edges.push([c, b]);
        self.edges.push([a, c]);
    }

    /// Remembers a triangle with corners from these places.
    fn push_all(&mut self, [a, b, c]: [u32; 3], places: [u8; 3]) {
        for (vertex, place) in [a, b, c].into_iter().zip(places) {
            if place == NEXT || place == OWN {
                self.vertices.push(vertex);
            }
        }
        for edge in [[b, a], [c, b], [a, c]] {
            self.edges.push(edge);
        }
    }

    /// Puts what a triangle needs besides its code, which is returned.
    fn put(&mut self, triangle: [u32; 3], data: &mut Vec<u8>) -> u8 {
        let turned = |turn| {
            let mut corners = triangle;
            corners.rotate_left(turn);
            corners
        };
        let edge = self.edges.find(|edge| {
            let same = |turn: &usize| edge == [triangle[*turn], triangle[(turn + 1) % 3]];
            (0..3).find(same)
        });
        match edge {
            Some((edge, turn)) if edge < OWN => edge << 4 | self.put_third(turned(turn), data),
            _ => {
                let turn = (1..3).find(|turn| triangle[*turn] == self.next);
                self.put_all(turned(turn.unwrap_or(0)), data)
            }
        }
    }

    fn put_third(&mut self, triangle: [u32; 3], data: &mut Vec<u8>) -> u8 {
        let c = triangle[2];
        let place = match self.place(c) {
            Some(place @ 1..BEFORE) => place,
            _ if self.is_next(c) => NEXT,
            _ if c.wrapping_add(1) == self.last => BEFORE,
            _ if c == self.last.wrapping_add(1) => AFTER,
            _ => OWN,
        };
        match place {
            OWN => put_after(&mut self.last, c, data),
            BEFORE | AFTER => self.last = c,
            _ => {}
        }
        self.push_third(triangle, !(1..BEFORE).contains(&place));
        place
    }

    fn put_all(&mut self, triangle: [u32; 3], data: &mut Vec<u8>) -> u8 {
        // Such a triangle begins a mesh of its own.
        let begins = triangle == [0, 1, 2] && self.next > 0;
        if begins {
            self.next = 0;
            self.vertices = NOTHING.vertices;
        }
        let first = match self.is_next(triangle[0]) {
            true => NEXT,
            false => OWN,
        };
        let [second, third] = [1, 2].map(|k: usize| match self.place(triangle[k]) {
            Some(place @ 0..14) => place + 1,
            _ if self.is_next(triangle[k]) => NEXT,
            _ => OWN,
        });
        let pair = second << 4 | third;
        let named = PAIRS[..NAMED].iter().position(|other| *other == pair);
        let code = match named {
            Some(place) if first == NEXT && !begins => ALONE | place as u8,
            _ => {
                data.push(pair);
                WITH_NEXT | first
            }
        };
        let places = [first, second, third];
        for (vertex, place) in triangle.into_iter().zip(places) {
            if place == OWN {
                put_after(&mut self.last, vertex, data);
            }
        }
        self.push_all(triangle, places);
        code
    }

    fn corner(&mut self, place: u8, data: &mut &[u8]) -> Result<u32, Damaged> {
        match place {
            NEXT => {
                let next = self.next;
                self.next = next.wrapping_add(1);
                Ok(next)
            }
            OWN => take_after(&mut self.last, data),
            _ => Ok(self.vertices.at(usize::from(place) - 1)),
        }
    }

    /// Takes a triangle at an edge that is known.
    fn take_third(&mut self, code: u8, version: u8, data: &mut &[u8]) -> Result<[u32; 3], Damaged> {
        let [a, b] = self.edges.at(usize::from(code >> 4));
        let place = code & 15;
        let is_old = (1..OWN).contains(&place) && (version == 0 || place < BEFORE);
        let c = match place {
            _ if is_old => self.vertices.at(place.into()),
            BEFORE => self.last.wrapping_sub(1),
            AFTER => self.last.wrapping_add(1),
            _ => self.corner(place, data)?,
        };
        if place != NEXT && !is_old {
            self.last = c;
        }
        self.push_third([a, b, c], !is_old);
        Ok([a, b, c])
    }

    /// Takes a triangle that is told as a whole.
    fn take_all(&mut self, code: u8, pairs: &[u8], data: &mut &[u8]) -> Result<[u32; 3], Damaged> {
        let pair = match code < WITH_NEXT {
            true => pairs[usize::from(code - ALONE)],
            false => take(data, 1)?[0],
        };
        if code >= WITH_NEXT && pair == 0 {
            self.next = 0;
        }
        let first = match code {
            WITH_ANY => OWN,
            _ => NEXT,
        };
        let places = [first, pair >> 4, pair & 15];
        let mut triangle = [0; 3];
        for (vertex, place) in triangle.iter_mut().zip(places) {
            *vertex = self.corner(place, data)?;
        }
        self.push_all(triangle, places);
        Ok(triangle)
    }
}

/// Encodes triangles.
pub(super) fn encode(triangles: &[[u32; 3]]) -> Vec<u8> {
    let mut out = Vec::with_capacity(2 * triangles.len() + 1 + RECENT);
    out.push(HEADER | 1);
    let (mut known, mut data) = (NOTHING, Vec::new());
    out.extend(triangles.iter().map(|t| known.put(*t, &mut data)));
    out.extend(data);
    out.extend(PAIRS);
    out
}

/// Decodes the triangles of `count` indices of `stride` bytes.
pub(super) fn decode(packed: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, Damaged> {
    let (version, body, pairs) = opened(packed, HEADER, (stride, RECENT))?;
    if !count.is_multiple_of(3) {
        return Err("indices that are no whole triangles");
    }
    let is_own = |pair: &u8| pair >> 4 == OWN || pair & 15 == OWN;
    if pairs.iter().any(is_own) || pairs[NAMED..] != [0, 0] {
        return Err("a table that is none of pairs");
    }
    let codes = body.split_at_checked(count / 3);
    let (codes, mut data) = codes.ok_or("fewer bytes than triangles")?;
    let mut out = Vec::with_capacity(count * stride);
    let mut known = NOTHING;
    for code in codes {
        let triangle = match *code < ALONE {
            true => known.take_third(*code, version, &mut data)?,
            false => known.take_all(*code, pairs, &mut data)?,
        };
        for index in triangle {
            put_plain(index, stride, &mut out)?;
        }
    }
    match data {
        [] => Ok(out),
        _ => Err("more bytes than the triangles have"),
    }
}
