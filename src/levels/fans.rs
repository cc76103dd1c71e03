//! The triangles at each vertex of a mesh in memory.

/// The triangles at each vertex, in one list.
#[derive(Debug, Default)]
pub(super) struct Fans {
    starts: Vec<u32>,
    triangles: Vec<u32>,
}

impl Fans {
    pub fn of(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        let mut fans = Self::default();
        fans.renew(vertices, triangles);
        fans
    }

    /// Those of other triangles, in the same memory.
    pub fn renew(&mut self, vertices: usize, triangles: &[[u32; 3]]) {
        let Self {
            starts,
            triangles: all,
        } = self;
        starts.clear();
        starts.resize(vertices + 1, 0);
        let corners = triangles.as_flattened();
        corners.iter().for_each(|v| starts[*v as usize] += 1);
        let mut sum = 0;
        for start in &mut *starts {
            sum += *start;
            *start = sum;
        }
        all.resize(corners.len(), 0);
        for (triangle, corners) in triangles.iter().enumerate().rev() {
            for v in corners.iter().rev() {
                let start = &mut starts[*v as usize];
                *start -= 1;
                all[*start as usize] = triangle as u32;
            }
        }
    }

    pub fn at(&self, vertex: u32) -> &[u32] {
        let [from, to] = [0, 1].map(|n| self.starts[vertex as usize + n] as usize);
        &self.triangles[from..to]
    }
}
