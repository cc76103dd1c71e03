//! The codec of attributes, version 0: differences of the bytes of consecutive elements, byte by byte of an element, in
//! groups of 16.

use super::{Damaged, take};

/// The first byte of a stream.
const HEADER: u8 = 0xa0;

/// Elements of a group.
const GROUP: usize = 16;

/// Most elements of a block.
const BLOCK: usize = 256;

/// Most bytes of an element, and fewest of the tail.
const STRIDE: usize = 256;
const TAIL: usize = 32;

/// The mode of groups whose differences are all zero, and that of groups with whole bytes. Between them are 1 and 2,
/// with two and four bits for each difference.
const ZEROS: u8 = 0;
const BYTES: u8 = 3;

/// Elements of all blocks but the last.
fn block(stride: usize) -> usize {
    (8192 / stride / GROUP * GROUP).min(BLOCK)
}

/// Encodes records of `stride` bytes.
pub(super) fn encode(records: &[u8], stride: usize) -> Vec<u8> {
    let records = &records[..records.len() / stride * stride];
    let mut out = Vec::with_capacity(records.len() / 2 + TAIL + stride);
    out.push(HEADER);
    let first = records.get(..stride);
    let first = first.map_or_else(|| vec![0; stride], <[u8]>::to_vec);
    let mut last = first.clone();
    let mut lane = [0; BLOCK];
    for block in records.chunks(block(stride) * stride) {
        let groups = (block.len() / stride).next_multiple_of(GROUP);
        for (k, last) in last.iter_mut().enumerate() {
            lane.fill(0);
            for (difference, byte) in lane.iter_mut().zip(block[k..].iter().step_by(stride)) {
                let step = byte.wrapping_sub(*last) as i8;
                *difference = (step << 1 ^ step >> 7) as u8;
                *last = *byte;
            }
            put_lane(&lane[..groups], &mut out);
        }
    }
    out.resize(out.len() + TAIL.saturating_sub(stride), 0);
    out.extend(first);
    out
}

/// Puts the differences of one byte of the elements of a block.
fn put_lane(lane: &[u8], out: &mut Vec<u8>) {
    let groups = lane.as_chunks::<GROUP>().0;
    let header = out.len();
    out.resize(header + groups.len().div_ceil(4), 0);
    let mut before = BYTES;
    for (n, group) in groups.iter().enumerate() {
        let mode = mode(group, before);
        out[header + n / 4] |= mode << (2 * (n % 4));
        put_group(group, mode, out);
        before = mode;
    }
}

/// The mode with the fewest bytes; of several, whole bytes, or else that of the group before, or else the first.
fn mode(group: &[u8; GROUP], before: u8) -> u8 {
    let beyond = |most: u8| group.iter().map(|x| u8::from(*x >= most)).sum::<u8>();
    let zeros = match beyond(1) {
        0 => 0,
        _ => u8::MAX,
    };
    let sizes = [zeros, 4 + beyond(3), 8 + beyond(15), GROUP as u8];
    (ZEROS..BYTES).fold(BYTES, |best, mode| {
        let [size, least] = [mode, best].map(|mode| sizes[usize::from(mode)]);
        match size < least || size == least && mode == before && best != BYTES {
            true => mode,
            false => best,
        }
    })
}

fn put_group(group: &[u8; GROUP], mode: u8, out: &mut Vec<u8>) {
    match mode {
        ZEROS => {}
        BYTES => out.extend(group),
        _ => {
            let bits = 2 * mode;
            let most = (1 << bits) - 1;
            let parts = group.chunks_exact(usize::from(8 / bits));
            out.extend(
                parts.map(|part| part.iter().fold(0, |byte, x| byte << bits | *x.min(&most))),
            );
            out.extend(group.iter().filter(|x| **x >= most));
        }
    }
}

/// Decodes `count` records of `stride` bytes.
pub(super) fn decode(packed: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, Damaged> {
    if stride == 0 || stride > STRIDE || !stride.is_multiple_of(4) {
        return Err("records whose bytes are no multiple of 4 up to 256");
    }
    let (header, packed) = packed.split_first().ok_or("no byte")?;
    if *header != HEADER {
        return Err("attributes of another version than 0");
    }
    let body = packed.len().checked_sub(stride.max(TAIL));
    let (mut body, tail) = packed.split_at(body.ok_or("attributes without a tail")?);
    // A block has at least one byte for 64 elements, for each byte of an element.
    let least = count.div_ceil(4 * GROUP).checked_mul(stride);
    if least.is_none_or(|least| least > body.len()) {
        return Err("fewer bytes than so many elements have");
    }
    let size = count.checked_mul(stride).ok_or("too many elements")?;
    let mut last = tail[tail.len() - stride..].to_vec();
    let mut out = vec![0; size];
    let mut lane = [0; BLOCK];
    for block in out.chunks_mut(block(stride) * stride) {
        let groups = (block.len() / stride).next_multiple_of(GROUP);
        for (k, last) in last.iter_mut().enumerate() {
            take_lane(&mut body, &mut lane[..groups])?;
            for (byte, difference) in block[k..].iter_mut().step_by(stride).zip(&lane) {
                let step = difference >> 1 ^ (difference & 1).wrapping_neg();
                *last = last.wrapping_add(step);
                *byte = *last;
            }
        }
    }
    match body {
        [] => Ok(out),
        _ => Err("more bytes than the elements have"),
    }
}

fn take_lane(body: &mut &[u8], lane: &mut [u8]) -> Result<(), Damaged> {
    let groups = lane.as_chunks_mut::<GROUP>().0;
    let header = take(body, groups.len().div_ceil(4))?;
    for (n, group) in groups.iter_mut().enumerate() {
        take_group(body, header[n / 4] >> (2 * (n % 4)) & 3, group)?;
    }
    Ok(())
}

fn take_group(body: &mut &[u8], mode: u8, group: &mut [u8; GROUP]) -> Result<(), Damaged> {
    match mode {
        ZEROS => group.fill(0),
        BYTES => group.copy_from_slice(take(body, GROUP)?),
        _ => {
            let bits = 2 * mode;
            let most = (1 << bits) - 1;
            let packed = take(body, usize::from(2 * bits))?;
            let parts = group.chunks_exact_mut(usize::from(8 / bits));
            for (part, byte) in parts.zip(packed) {
                let shifts = (0..8).step_by(usize::from(bits)).rev();
                for (x, shift) in part.iter_mut().zip(shifts) {
                    *x = byte >> shift & most;
                }
            }
            for x in group.iter_mut().filter(|x| **x == most) {
                *x = take(body, 1)?[0];
            }
        }
    }
    Ok(())
}
