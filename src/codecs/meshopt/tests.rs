//! Tests of the codecs: streams as they always were, round trips, streams of other encoders, and damage.

use super::*;
use proptest::prelude::*;

/// Decodes without a filter.
fn plain(mode: &str, count: usize, stride: usize, packed: &[u8]) -> Vec<u8> {
    decode((mode, None), (count, stride), packed).unwrap()
}

fn words_of(bytes: &[u8]) -> Vec<u32> {
    let words = bytes.as_chunks::<4>().0.iter();
    words.map(|word| u32::from_le_bytes(*word)).collect()
}

/// A number for bytes: FNV-1a.
fn hash(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3)
    })
}

/// Records whose bytes change by little or much, or not at all.
fn records(count: usize, stride: usize, seed: u64) -> Vec<u8> {
    let mut random = oorandom::Rand32::new(seed);
    let mut last = vec![0u8; stride];
    let mut all = Vec::with_capacity(count * stride);
    for _ in 0..count {
        for (k, byte) in last.iter_mut().enumerate() {
            let most = [1, 2, 5, 40, 256][(k + seed as usize) % 5];
            if random.rand_range(0..3) > 0 {
                *byte = byte
                    .wrapping_add((random.rand_range(0..most) as u8).wrapping_sub(most as u8 / 2));
            }
        }
        all.extend(&last);
    }
    all
}

/// The triangles of a grid of vertices, some of them anywhere, which begins again after `restart` triangles.
fn grid(count: usize, restart: usize, seed: u64) -> Vec<[u32; 3]> {
    let mut random = oorandom::Rand32::new(seed);
    let triangle = |n: usize| {
        let n = n % restart;
        let (square, row) = (n as u32 / 2, 12);
        let [a, b] = [square + square / row, square + square / row + row + 1];
        let mut corners = match n % 2 {
            0 => [a, a + 1, b],
            _ => [a + 1, b + 1, b],
        };
        match random.rand_range(0..9) {
            0 => corners[random.rand_range(0..3) as usize] = random.rand_u32() >> 2,
            turn => corners.rotate_left(turn as usize % 3),
        }
        corners
    };
    (0..count).map(triangle).collect()
}

/// Two runs of indices, one in the other, and some that are anywhere.
fn runs(count: usize, seed: u64) -> Vec<u32> {
    let mut random = oorandom::Rand32::new(seed);
    let index = |n: usize| match random.rand_range(0..10) {
        0 => random.rand_u32() >> 3,
        1..4 => 70_000 - n as u32,
        _ => n as u32 + random.rand_range(0..20),
    };
    (0..count).map(index).collect()
}

#[test]
fn streams_are_those_of_all_former_versions() {
    // They are also those of meshoptimizer 1.3, byte by byte.
    let sizes = [(0, 12), (1, 4), (16, 8), (100, 12), (1000, 24), (300, 256)];
    let records = sizes.map(|(count, stride)| vertices(&records(count, stride, 3), stride));
    let lists = [(0, 10), (1, 10), (500, 500), (3000, 700)];
    let triangles = lists.map(|(count, restart)| triangles(&grid(count, restart, 5)));
    let sequences = [0, 1, 700].map(|count| sequence(&runs(count, 7)));
    let all = records.iter().chain(&triangles).chain(&sequences);
    let found: Vec<u64> = all.map(|stream| hash(stream)).collect();
    assert_eq!(found, STREAMS, "{found:#x?}");
}

const STREAMS: [u64; 13] = [
    0x4927_3802_ecf9_9a7f,
    0xb001_e637_c8b9_b1b4,
    0xc5c4_e886_dda7_d291,
    0xe254_0203_0d82_e6a3,
    0x6ff7_9ef2_ce5d_2cc0,
    0x9368_04c2_a154_5f55,
    0x3652_63e2_8e04_9cb7,
    0x2651_ef43_b1bd_5e44,
    0xbb07_7e88_6f65_6980,
    0x05d5_7a99_ac0a_5833,
    0x2625_ff34_7862_ef5c,
    0x9801_a5bf_cd58_52bf,
    0x498e_c672_e104_4c53,
];

#[test]
fn examples_of_the_specification_are_read() {
    // The first byte of 16 elements has these differences in groups of four bits, the others have none.
    let differences = [0x17, 0x5f, 0xf0, 0xbc, 0x77, 0xa9, 0x21, 0x00, 0x34, 0xb5u8];
    let stream = [&[0xa0, 2][..], &differences, &[0; 3], &[0; 32]].concat();
    let bytes = plain("ATTRIBUTES", 16, 4, &stream);
    let steps = [-1, -4, -3, 26, -91, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0];
    let mut sum = 0i8;
    for (element, step) in bytes.as_chunks::<4>().0.iter().zip(steps) {
        sum = sum.wrapping_add(step);
        assert_eq!(*element, [sum as u8, 0, 0, 0]);
    }
    // Three new vertices; then the edge from 2 to 1 with a new one, in both versions.
    for header in [0xe0, 0xe1] {
        let table = [&[0; 14][..], &[0; 2]].concat();
        let stream = [&[header, 0xf0, 0x10][..], &table].concat();
        let bytes = plain("TRIANGLES", 6, 2, &stream);
        assert_eq!(bytes, [0, 0, 1, 0, 2, 0, 2, 0, 1, 0, 3, 0]);
    }
    // A number of several bytes.
    let stream = [0xd1, 0x84, 0x08, 0, 0, 0, 0];
    assert_eq!(plain("INDICES", 1, 4, &stream), 0x101u32.to_le_bytes());
}

#[test]
fn filters_change_numbers() {
    let filtered = |name, elements: &[[i16; 4]]| {
        let records: &[u8] = bytemuck::cast_slice(elements);
        let packed = vertices(records, 8);
        let bytes = decode(("ATTRIBUTES", Some(name)), (elements.len(), 8), &packed).unwrap();
        let shorts = bytes.as_chunks::<2>().0.iter();
        let shorts: Vec<i16> = shorts.map(|b| i16::from_le_bytes(*b)).collect();
        shorts.as_chunks::<4>().0.to_vec()
    };
    let most = i16::MAX;
    let elements = [
        [0, 0, 511, 7],
        [511, 0, 511, 0],
        [511, 511, 511, 0],
        [-100, 411, 511, -3],
    ];
    let expected = [
        [0, 0, most, 7],
        [most, 0, 0, 0],
        [0, 0, -most, 0],
        [-7747, 31838, 0, -3],
    ];
    assert_eq!(filtered("OCTAHEDRAL", &elements), expected);
    let elements = [[0, 0, 0, 511], [0, 511, 0, 508], [0, 0, 0, 0]];
    let half = (f32::from(most) / 2f32.sqrt()).round() as i16;
    let read = filtered("QUATERNION", &elements);
    assert_eq!(read[0], [0, 0, 0, most]);
    assert_eq!(read[1], [half, 0, half, 0]);
    let packed = vertices(&[0, 0, 127, 5, 127, 0, 127, 0], 4);
    let bytes = decode(("ATTRIBUTES", Some("OCTAHEDRAL")), (2, 4), &packed).unwrap();
    assert_eq!(bytes, [0, 0, 127, 5, 127, 0, 0, 0]);
    for (name, stride) in [("OCTAHEDRAL", 12), ("QUATERNION", 4), ("COLOUR", 8)] {
        let packed = vertices(&[0; 24], stride);
        let damage = decode(("ATTRIBUTES", Some(name)), (24 / stride, stride), &packed);
        assert!(damage.unwrap_err().contains("filter"), "{name}");
    }
    for mode in ["TRIANGLES", "INDICES"] {
        let damage = decode((mode, Some("EXPONENTIAL")), (0, 4), &[]);
        assert!(damage.unwrap_err().contains("filter"), "{mode}");
    }
}

#[test]
fn a_count_that_cannot_be_is_no_memory() {
    let claims = [
        ("ATTRIBUTES", usize::MAX, 4, vertices(&[0; 400], 4)),
        ("ATTRIBUTES", 1 << 40, 256, vertices(&[0; 512], 256)),
        ("TRIANGLES", usize::MAX / 3 * 3, 4, triangles(&[[0, 1, 2]])),
        ("INDICES", usize::MAX, 4, sequence(&[1, 2, 3])),
    ];
    for (mode, count, stride, packed) in claims {
        let damage = decode((mode, None), (count, stride), &packed).unwrap_err();
        assert!(damage.contains("fewer bytes than"), "{damage}");
    }
}

proptest! {
    #[test]
    fn records_are_read_as_they_were(count in 0usize..700, quarter in 1usize..=64, seed in 0u64..1000) {
        let records = records(count, 4 * quarter, seed);
        let packed = vertices(&records, 4 * quarter);
        prop_assert_eq!(plain("ATTRIBUTES", count, 4 * quarter, &packed), records);
    }

    #[test]
    fn triangles_are_read_with_their_direction(count in 0usize..600, restart in 1usize..300, seed: u64) {
        let list = grid(count, restart, seed);
        let read = words_of(&plain("TRIANGLES", 3 * count, 4, &triangles(&list)));
        let (read, _) = read.as_chunks::<3>();
        prop_assert_eq!(read.len(), count);
        for (read, t) in read.iter().zip(list) {
            let turned = [t, [t[1], t[2], t[0]], [t[2], t[0], t[1]]];
            prop_assert!(turned.contains(read), "{:?} {:?}", read, t);
        }
    }

    #[test]
    fn sequences_are_read_as_they_were(count in 0usize..300, seed: u64) {
        let list = runs(count, seed);
        prop_assert_eq!(words_of(&plain("INDICES", count, 4, &sequence(&list))), list);
    }

    /// Whatever is damaged, there is a result or a line.
    #[test]
    fn damage_is_no_panic(
        mode in 0usize..3,
        damage in prop::collection::vec((0usize..5000, any::<u8>()), 1..6),
        cut in 0usize..40,
        count in 0usize..400,
        stride in 0usize..14,
        filter in 0usize..4,
    ) {
        let (name, mut packed) = [
            ("ATTRIBUTES", vertices(&records(90, 12, 1), 12)),
            ("TRIANGLES", triangles(&grid(90, 60, 1))),
            ("INDICES", sequence(&runs(90, 1))),
        ][mode].clone();
        for (place, byte) in damage {
            let place = place % packed.len();
            packed[place] = byte;
        }
        packed.truncate(packed.len() - cut % packed.len());
        let filter = ["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL"][filter];
        for (count, stride) in [(90, 12), (270, 4), (270, 2), (90, 4), (count, stride)] {
            if let Ok(bytes) = decode((name, Some(filter)), (count, stride), &packed) {
                prop_assert_eq!(bytes.len(), count * stride);
            }
        }
    }
}

/// The numbers that a reader gets.
fn read(steps: &[[i32; 3]]) -> (Vec<f32>, bool) {
    let words = words(steps);
    let encoded = vertices(bytemuck::cast_slice(&words.words), 12);
    let filter = words.filtered.then_some("EXPONENTIAL");
    let bytes = decode(("ATTRIBUTES", filter), (steps.len(), 12), &encoded).unwrap();
    let floats = words_of(&bytes).into_iter().map(f32::from_bits);
    (floats.collect(), words.filtered)
}

#[test]
fn steps_are_read_exactly_or_as_the_nearest_float() {
    let most = 1 << 23;
    for (steps, exact) in [
        (vec![[0, 0, 0]], true),
        (vec![[1, -1, 77], [most - 1, -most, 0]], true),
        (vec![[most, 0, 1]], false),
        (vec![[most, 0, 2]], true),
        (vec![[128 - (1 << 30), 1 << 29, 3 << 7]; 300], true),
        (vec![[(1 << 30) - 1, -(1 << 30) + 1, 12_345_679]; 7], false),
    ] {
        let (read, filtered) = read(&steps);
        assert_eq!(filtered, exact, "{:?}", steps[0]);
        let expected: Vec<f32> = steps.as_flattened().iter().map(|x| *x as f32).collect();
        assert_eq!(read, expected);
    }
}

#[test]
fn normals_are_read_to_half_a_step() {
    let mut random = oorandom::Rand64::new(2);
    let mut normals = vec![[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -0.6, 0.8]];
    normals.extend((0..500).map(|_| {
        let x = [0, 1, 2].map(|_| random.rand_float() * 2.0 - 1.0);
        let length = x.iter().map(|x| x * x).sum::<f64>().sqrt();
        x.map(|x| (x / length) as f32)
    }));
    let words: Vec<[u32; 3]> = normals.iter().map(|n| direction(*n)).collect();
    let encoded = vertices(bytemuck::cast_slice(&words), 12);
    let filter = Some("EXPONENTIAL");
    let bytes = decode(("ATTRIBUTES", filter), (words.len(), 12), &encoded).unwrap();
    let read: Vec<f32> = words_of(&bytes).into_iter().map(f32::from_bits).collect();
    assert_eq!(read[..6], [0.0, 0.0, 1.0, -1.0, 0.0, 0.0]);
    for (x, exact) in read.iter().zip(normals.as_flattened()) {
        assert!((x - exact).abs() <= 0.5 / 4096.0, "{x} {exact}");
    }
}
