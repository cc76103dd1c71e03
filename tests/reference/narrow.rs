//! The part of a filling that remains if some of its triangles are too wide (section 8.7).

/// A triangle of a filling by the positions of its corners in the loop.
type Corners = [usize; 3];

/// For each triangle of the filling of a loop of `count` corners: it is left out. These are the wide ones,
/// and repeatedly at each corner those between two that are left out.
pub fn left_out(count: usize, filling: &[Corners], wide: impl Fn(&Corners) -> bool) -> Vec<bool> {
    let mut out: Vec<bool> = filling.iter().map(wide).collect();
    loop {
        let before = out.clone();
        for corner in 0..count {
            let around = around(corner, count, filling);
            let Some(first) = around.iter().position(|&t| out[t]) else {
                continue;
            };
            let last = around.iter().rposition(|&t| out[t]).expect("one is out");
            for &t in &around[first..=last] {
                out[t] = true;
            }
        }
        if out == before {
            return out;
        }
    }
}

/// The triangles at a corner, in order from the edge after it to the edge before it.
fn around(corner: usize, count: usize, filling: &[Corners]) -> Vec<usize> {
    // Distances along the loop from the corner to the other two corners, the nearer one first.
    let others = |t: usize| {
        let mut far = filling[t].map(|k| (k + count - corner) % count);
        far.sort_unstable();
        [far[1], far[2]]
    };
    let mut around: Vec<usize> = (0..filling.len())
        .filter(|&t| filling[t].contains(&corner))
        .collect();
    around.sort_by_key(|&t| others(t));
    let side_by_side = around
        .windows(2)
        .all(|two| others(two[0])[1] == others(two[1])[0]);
    let (first, last) = (around[0], around[around.len() - 1]);
    assert!(
        side_by_side && others(first)[0] == 1 && others(last)[1] == count - 1,
        "corner {corner} of {filling:?}"
    );
    around
}
