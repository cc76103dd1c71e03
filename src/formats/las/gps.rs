//! Decodes compressed GPS times (laszip item 7, version 2).
//!
//! The decoder of the `laz` crate is recursive, and damaged data can make it overflow the stack.

use laz::decoders::ArithmeticDecoder;
use laz::decompressors::{IntegerDecompressor, IntegerDecompressorBuilder};
use laz::models::{ArithmeticModel, ArithmeticModelBuilder};
use laz::record::FieldDecompressor;
use std::io::Read;

/// Multiples of the last difference that have their own symbol: 1 to 500, then -1 to -10.
const MULTIPLES: i32 = 500;
const NEGATIVE_MULTIPLES: i32 = 10;
/// Symbol of the last of them.
const LAST_MULTIPLE: i32 = MULTIPLES + NEGATIVE_MULTIPLES;
/// Symbol of a time that did not change.
const UNCHANGED: i32 = LAST_MULTIPLE + 1;
/// Symbol of a time that is stored in full; larger symbols switch to another sequence.
const WHOLE: i32 = UNCHANGED + 1;

/// Most consecutive switches from one sequence of times to another; a writer makes at most one.
const MOST_SWITCHES: usize = 16;

/// State of the four interleaved sequences of times.
pub(super) struct GpsTimes {
    multiple: ArithmeticModel,
    first_difference: ArithmeticModel,
    integers: IntegerDecompressor,
    last: usize,
    next: usize,
    /// The bits of the last time of each sequence, as an integer.
    times: [i64; 4],
    differences: [i32; 4],
    extremes: [u32; 4],
}

impl Default for GpsTimes {
    fn default() -> Self {
        Self {
            multiple: ArithmeticModelBuilder::new((WHOLE + 4) as u32).build(),
            first_difference: ArithmeticModelBuilder::new(6).build(),
            integers: IntegerDecompressorBuilder::new()
                .bits(32)
                .contexts(9)
                .build_initialized(),
            last: 0,
            next: 0,
            times: [0; 4],
            differences: [0; 4],
            extremes: [0; 4],
        }
    }
}

impl GpsTimes {
    /// After four extreme differences in a row, the last one becomes the prediction.
    fn extreme(&mut self, difference: i32) {
        self.extremes[self.last] += 1;
        if self.extremes[self.last] > 3 {
            self.extremes[self.last] = 0;
            self.differences[self.last] = difference;
        }
    }

    /// A time stored in full starts a new sequence.
    fn whole<R: Read>(&mut self, decoder: &mut ArithmeticDecoder<R>) -> std::io::Result<()> {
        let prediction = (self.times[self.last] >> 32) as i32;
        let upper = self.integers.decompress(decoder, prediction, 8)?;
        let lower = decoder.read_int()?;
        self.next = (self.next + 1) & 3;
        self.last = self.next;
        self.times[self.last] = i64::from(upper) << 32 | i64::from(lower);
        self.differences[self.last] = 0;
        self.extremes[self.last] = 0;
        Ok(())
    }

    /// Adds a difference to the last time of the sequence.
    fn add(&mut self, difference: i32) {
        let time = &mut self.times[self.last];
        *time = time.wrapping_add(difference.into());
    }

    /// Decodes one symbol and its data; true if it was a switch to another sequence.
    fn step<R: Read>(&mut self, decoder: &mut ArithmeticDecoder<R>) -> std::io::Result<bool> {
        if self.differences[self.last] == 0 {
            match decoder.decode_symbol(&mut self.first_difference)? {
                0 => {}
                1 => {
                    let difference = self.integers.decompress(decoder, 0, 0)?;
                    self.differences[self.last] = difference;
                    self.add(difference);
                    self.extremes[self.last] = 0;
                }
                2 => self.whole(decoder)?,
                switch => {
                    self.last = (self.last + switch as usize - 2) & 3;
                    return Ok(true);
                }
            }
            return Ok(false);
        }
        // The difference is predicted as a multiple of the last one.
        let symbol = decoder.decode_symbol(&mut self.multiple)? as i32;
        let (multiple, context) = match symbol {
            0 => (0, 7),
            1 => (1, 1),
            2..10 => (symbol, 2),
            10..MULTIPLES => (symbol, 3),
            MULTIPLES => (symbol, 4),
            ..LAST_MULTIPLE => (MULTIPLES - symbol, 5),
            LAST_MULTIPLE => (-NEGATIVE_MULTIPLES, 6),
            UNCHANGED => return Ok(false),
            WHOLE => return self.whole(decoder).map(|()| false),
            switch => {
                self.last = (self.last + (switch - WHOLE) as usize) & 3;
                return Ok(true);
            }
        };
        let prediction = multiple.wrapping_mul(self.differences[self.last]);
        let difference = self.integers.decompress(decoder, prediction, context)?;
        self.add(difference);
        match context {
            1 => self.extremes[self.last] = 0,
            4 | 6 | 7 => self.extreme(difference),
            _ => {}
        }
        Ok(false)
    }
}

impl<R: Read> FieldDecompressor<R> for GpsTimes {
    fn size_of_field(&self) -> usize {
        size_of::<f64>()
    }

    fn decompress_first(&mut self, source: &mut R, first: &mut [u8]) -> std::io::Result<()> {
        source.read_exact(first)?;
        let bytes = first.iter().rev();
        self.times[0] = bytes.fold(0, |time, byte| time << 8 | i64::from(*byte));
        Ok(())
    }

    fn decompress_with(
        &mut self,
        decoder: &mut ArithmeticDecoder<R>,
        time: &mut [u8],
    ) -> std::io::Result<()> {
        for _ in 0..MOST_SWITCHES {
            if !self.step(decoder)? {
                time.copy_from_slice(&self.times[self.last].to_le_bytes());
                return Ok(());
            }
        }
        Err(std::io::Error::other(
            "GPS times that belong to no sequence",
        ))
    }
}
