//! Command line of `outcrop`.
use outcrop::*;
use std::sync::Arc;
fn main() {
    let path = std::env::args().nth(1).unwrap();
    let data = std::fs::read(path).unwrap();
    let pos = data.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let pts: Vec<[i32; 3]> = data[pos..]
        .chunks_exact(12)
        .map(|c| {
            std::array::from_fn(|i| {
                let x = f32::from_le_bytes(c[4 * i..4 * i + 4].try_into().unwrap());
                ((x + 600.0) * 500000.0).round() as i32
            })
        })
        .collect();
    let memory = workspace::memory::MemoryPool::new(512 << 20).unwrap();
    let ws = workspace::Workspace::new(&std::path::Path::new("/tmp"), memory, 2, Arc::new(workspace::progress::Silent), Default::default()).unwrap();
    let t = std::time::Instant::now();
    let mut o = stages::order::Orderer::new(&ws).unwrap();
    for c in pts.chunks(1 << 16) { o.push(&ws, c).unwrap(); }
    let (store, dup) = o.finish(&ws, 256).unwrap();
    eprintln!("order {} dup {dup} {:?}", store.len(), t.elapsed());
    let t = std::time::Instant::now();
    let blocks = stages::blocks::Blocks::new(store.len(), 65536);
    let (c, s) = stages::cells::cells(&store, blocks, 65536, 30, if std::env::args().nth(2).is_some() { stages::cells::DiskRadius::Steps(25e6) } else { stages::cells::DiskRadius::Auto }, &ws).unwrap();
    eprintln!("cells {s:?} {:?}", t.elapsed());
    let t = std::time::Instant::now();
    let (tr, s) = stages::triples::triples(&c, blocks, &ws).unwrap();
    eprintln!("triples {s:?} {:?}", t.elapsed());
    let t = std::time::Instant::now();
    let (_st, b, i) = stages::stitch::stitch(&store, &tr, blocks, 0.5, &ws).unwrap();
    eprintln!("stitch {b:?} {i:?} {:?}", t.elapsed());
}
