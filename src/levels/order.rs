//! The order of triangles: each lies beside one of the last, as far as it can be, so that the codec of triangles needs
//! little more than a byte for each.

/// Triangles beside the last ones that are looked at.
const NEAR: usize = 12;

/// Vertices that the codec remembers.
const RECENT: u32 = 12;

/// The triangles at each vertex.
struct Fans {
    starts: Vec<u32>,
    triangles: Vec<u32>,
}

impl Fans {
    fn of(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        let mut starts = vec![0; vertices + 1];
        let corners = triangles.as_flattened();
        corners.iter().for_each(|v| starts[*v as usize] += 1);
        let mut sum = 0;
        for start in &mut starts {
            sum += *start;
            *start = sum;
        }
        let mut all = vec![0; corners.len()];
        for (corner, v) in corners.iter().enumerate().rev() {
            let start = &mut starts[*v as usize];
            *start -= 1;
            all[*start as usize] = corner as u32 / 3;
        }
        Self {
            starts,
            triangles: all,
        }
    }

    fn at(&self, vertex: u32) -> &[u32] {
        let [from, to] = [0, 1].map(|n| self.starts[vertex as usize + n] as usize);
        &self.triangles[from..to]
    }
}

/// The triangles of a mesh with so many vertices, in another order.
pub(super) fn of(vertices: usize, triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let fans = Fans::of(vertices, triangles);
    let mut done = vec![false; triangles.len()];
    // When each vertex was met, counted in vertices.
    let (mut met, mut clock) = (vec![0; vertices], RECENT);
    let mut near: Vec<u32> = Vec::new();
    let mut out = Vec::with_capacity(triangles.len());
    for first in 0..triangles.len() as u32 {
        near.push(first);
        while let Some(last) = near.last() {
            if done[*last as usize] {
                near.pop();
                continue;
            }
            let from = near.len().saturating_sub(NEAR);
            let is_open = |t: &&u32| !done[**t as usize];
            let is_known = |t: &&u32| {
                let corners = triangles[**t as usize].iter();
                corners.clone().all(|v| met[*v as usize] + RECENT > clock)
            };
            let open = || near[from..].iter().rev().filter(is_open);
            let Some(next) = open().find(is_known).or_else(|| open().next()) else {
                break;
            };
            let corners = triangles[*next as usize];
            done[*next as usize] = true;
            out.push(corners);
            for v in corners {
                if met[v as usize] + RECENT <= clock {
                    clock += 1;
                    met[v as usize] = clock;
                }
            }
            for n in 0..3 {
                let (a, b) = (corners[n], corners[(n + 1) % 3]);
                let beside = fans
                    .at(a)
                    .iter()
                    .filter(|t| !done[**t as usize] && triangles[**t as usize].contains(&b));
                near.extend(beside);
            }
        }
    }
    out
}
