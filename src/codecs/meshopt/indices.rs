//! The codec of sequences of indices, and how codecs write single ones.

use super::Damaged;

/// The first byte of a sequence, with the version in its low half.
const HEADER: u8 = 0xd0;

/// Bytes behind the last index.
const TAIL: usize = 4;

/// The difference from which on indices are told from the other one of both that are remembered.
const FAR: u32 = 30;

/// Puts a number, seven bits in a byte, the lowest first.
fn put_number(mut number: u32, out: &mut Vec<u8>) {
    while number >= 1 << 7 {
        out.push(number as u8 | 1 << 7);
        number >>= 7;
    }
    out.push(number as u8);
}

/// Takes a number.
fn take_number(data: &mut &[u8]) -> Result<u32, Damaged> {
    let mut number = 0;
    for shift in (0..35).step_by(7) {
        let byte = *data.split_off_first().ok_or("an index without an end")?;
        number |= u64::from(byte & 0x7f) << shift;
        if byte < 1 << 7 {
            return u32::try_from(number).map_err(|_| "an index of more than 32 bits");
        }
    }
    Err("an index of more than 32 bits")
}

/// A difference of indices as a number that is small if the difference is.
fn folded(difference: u32) -> u32 {
    difference << 1 ^ ((difference as i32) >> 31) as u32
}

fn unfolded(number: u32) -> u32 {
    number >> 1 ^ (number & 1).wrapping_neg()
}

/// Puts an index by its difference from the last one.
pub(super) fn put_after(last: &mut u32, index: u32, out: &mut Vec<u8>) {
    put_number(folded(index.wrapping_sub(*last)), out);
    *last = index;
}

/// Takes an index that is told by its difference from the last one.
pub(super) fn take_after(last: &mut u32, data: &mut &[u8]) -> Result<u32, Damaged> {
    *last = last.wrapping_add(unfolded(take_number(data)?));
    Ok(*last)
}

/// Appends an index in two or four bytes.
pub(super) fn put_plain(index: u32, stride: usize, out: &mut Vec<u8>) -> Result<(), Damaged> {
    match (stride, u16::try_from(index)) {
        (2, Ok(index)) => out.extend(index.to_le_bytes()),
        (2, _) => return Err("an index of more than 16 bits"),
        _ => out.extend(index.to_le_bytes()),
    }
    Ok(())
}

/// The version and what is between the first byte and the tail, which is returned as well.
pub(super) fn opened(
    packed: &[u8],
    header: u8,
    (stride, tail): (usize, usize),
) -> Result<(u8, &[u8], &[u8]), Damaged> {
    if stride != 2 && stride != 4 {
        return Err("indices of neither 2 nor 4 bytes");
    }
    let (first, packed) = packed.split_first().ok_or("no byte")?;
    let version = first ^ header;
    if version > 1 {
        return Err("indices of another version than 0 and 1");
    }
    let body = packed.len().checked_sub(tail);
    let (body, tail) = packed.split_at(body.ok_or("indices without a tail")?);
    Ok((version, body, tail))
}

/// Encodes indices in any order.
pub(super) fn encode(indices: &[u32]) -> Vec<u8> {
    let mut out = Vec::with_capacity(2 * indices.len() + TAIL + 1);
    out.push(HEADER | 1);
    let (mut last, mut near) = ([0u32; 2], 0);
    for index in indices {
        let difference = index.wrapping_sub(last[near]) as i32;
        if difference.unsigned_abs() >= FAR {
            near ^= 1;
        }
        let number = folded(index.wrapping_sub(last[near]));
        put_number(number << 1 | near as u32, &mut out);
        last[near] = *index;
    }
    out.extend([0; TAIL]);
    out
}

/// Decodes `count` indices of `stride` bytes.
pub(super) fn decode(packed: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, Damaged> {
    let (_, mut body, _) = opened(packed, HEADER, (stride, TAIL))?;
    if count > body.len() {
        return Err("fewer bytes than indices");
    }
    let mut out = Vec::with_capacity(count * stride);
    let mut last = [0u32; 2];
    for _ in 0..count {
        let number = take_number(&mut body)?;
        let last = &mut last[(number & 1) as usize];
        *last = last.wrapping_add(unfolded(number >> 1));
        put_plain(*last, stride, &mut out)?;
    }
    match body {
        [] => Ok(out),
        _ => Err("more bytes than the indices have"),
    }
}
