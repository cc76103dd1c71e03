//! Meshes to check.

use super::naive::Mesh;

/// A grid of `n` × `m` squares; `wrap` selects the sides that are glued, `twist` turns the second seam.
pub fn grid(n: i64, m: i64, wrap: [bool; 2], twist: bool) -> Mesh {
    let (rows, columns) = (n + i64::from(!wrap[0]), m + i64::from(!wrap[1]));
    let id = |i: i64, j: i64| {
        let i = if twist && j >= columns {
            rows - 1 - i
        } else {
            i
        };
        (i % rows) * columns + j % columns
    };
    let mut mesh = Mesh::default();
    for i in 0..rows {
        for j in 0..columns {
            mesh.positions
                .push([i as f64, j as f64, (i * i + 3 * j * j) as f64]);
        }
    }
    for i in 0..n {
        for j in 0..m {
            let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
            mesh.faces.extend([vec![a, b, c], vec![a, c, d]]);
        }
    }
    mesh
}

pub fn tetrahedron() -> Mesh {
    let positions = vec![
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
    ];
    let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]].map(|f| f.to_vec());
    Mesh {
        positions,
        faces: faces.to_vec(),
    }
}

pub fn cube() -> Mesh {
    let corner = |i: usize| [(i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64];
    let quads: [[i64; 4]; 6] = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let halves = quads
        .iter()
        .flat_map(|&[a, b, c, d]| [vec![a, b, c], vec![a, c, d]]);
    Mesh {
        positions: (0..8).map(corner).collect(),
        faces: halves.collect(),
    }
}

/// A cylinder of rings closed by two poles.
pub fn sphere(n: i64, rings: i64) -> Mesh {
    let mut mesh = grid(rings, n, [false, true], false);
    let south = mesh.positions.len() as i64;
    mesh.positions.extend([[-5.0, 0.0, 1.0], [50.0, 0.0, 1.0]]);
    for j in 0..n {
        let top = rings * n;
        mesh.faces.push(vec![south, j, (j + 1) % n]);
        mesh.faces.push(vec![south + 1, top + (j + 1) % n, top + j]);
    }
    mesh
}

pub fn both(mut a: Mesh, b: Mesh) -> Mesh {
    let shift = a.positions.len() as i64;
    a.positions.extend(b.positions);
    a.faces.extend(
        b.faces
            .iter()
            .map(|f| f.iter().map(|v| v + shift).collect()),
    );
    a
}

/// Distributes the ids over the whole mesh, so that no triangle is local.
pub fn shuffled(mesh: &Mesh) -> Mesh {
    let n = mesh.positions.len() as i64;
    let step = (7..)
        .find(|s| (2..=n).all(|d| n % d != 0 || s % d != 0))
        .unwrap();
    let mut out = mesh.clone();
    for (i, p) in mesh.positions.iter().enumerate() {
        out.positions[(i as i64 * step % n) as usize] = *p;
    }
    for v in out.faces.iter_mut().flatten() {
        *v = *v * step % n;
    }
    out
}
