// SPDX-License-Identifier: GPL-3.0-or-later
//! Which triangles of a surface meet at which edges.

use rayon::prelude::*;

use crate::InvalidInput;
use crate::bvh::check_indices;

/// Bits of a vertex's number in an edge's key, of which the lowest bit is the edge's direction.
const BITS: u32 = 31;

/// An edge as a triangle passes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Edge {
    key: u64,
    pub(crate) triangle: u32,
    /// Which corner of the triangle it begins at.
    pub(crate) corner: u8,
}

impl Edge {
    /// Whether it is passed from the lower vertex to the higher.
    pub(crate) fn is_upwards(&self) -> bool {
        self.key & 1 == 1
    }

    /// The lower of its vertices.
    pub(crate) fn vertex(&self) -> u32 {
        (self.key >> (1 + BITS)) as u32
    }
}

/// Triangles whose corners in one place on one surface are one vertex, and their edges in order.
pub(crate) struct Edges {
    pub(crate) corners: Vec<[u32; 3]>,
    edges: Vec<Edge>,
}

impl Edges {
    /// # Errors
    /// An index outside the vertices; as many surfaces as triangles were not given.
    pub(crate) fn of(
        vertices: &[[f32; 3]],
        triangles: &[[i32; 3]],
        surfaces: &[i32],
    ) -> Result<Edges, InvalidInput> {
        if surfaces.len() != triangles.len() {
            let (n, m) = (surfaces.len(), triangles.len());
            return Err(InvalidInput(format!("surfaces has {n} numbers, but there are {m} triangles")));
        }
        check_indices(triangles, vertices.len())?;
        let places = places(vertices, triangles, surfaces);
        let corners: Vec<[u32; 3]> =
            triangles.iter().map(|triangle| triangle.map(|vertex| places[vertex as usize])).collect();
        let mut edges: Vec<Edge> = corners
            .iter()
            .zip(0..)
            .filter(|([a, b, c], _)| a != b && b != c && c != a)
            .flat_map(|(&[a, b, c], triangle)| {
                [(a, b, 0), (b, c, 1), (c, a, 2)].map(|(from, to, corner)| Edge {
                    key: key_of(from, to),
                    triangle,
                    corner,
                })
            })
            .collect();
        edges.par_sort_unstable();
        Ok(Edges { corners, edges })
    }

    /// For each edge how triangles pass it.
    pub(crate) fn passed(&self) -> impl Iterator<Item = &[Edge]> {
        self.edges.chunk_by(|one, other| one.key >> 1 == other.key >> 1)
    }
}

/// Of each vertex the one that stands for all in its place on its surface.
fn places(vertices: &[[f32; 3]], triangles: &[[i32; 3]], surfaces: &[i32]) -> Vec<u32> {
    let mut owner = vec![-1i32; vertices.len()];
    for (triangle, &surface) in triangles.iter().zip(surfaces) {
        triangle.iter().for_each(|&vertex| owner[vertex as usize] = surface);
    }
    let key = |vertex: u32| {
        let [x, y, z] = vertices[vertex as usize].map(|x| (x + 0.0).to_bits()); // -0 is 0
        (owner[vertex as usize], x, y, z)
    };
    let mut order: Vec<u32> = (0..vertices.len() as u32).collect();
    order.par_sort_unstable_by_key(|&vertex| (key(vertex), vertex));
    let mut places = vec![0; vertices.len()];
    for same in order.chunk_by(|&one, &other| key(one) == key(other)) {
        same.iter().for_each(|&vertex| places[vertex as usize] = same[0]);
    }
    places
}

/// An edge without its direction, but for the lowest bit.
fn key_of(from: u32, to: u32) -> u64 {
    let (low, high) = (u64::from(from.min(to)), u64::from(from.max(to)));
    low << (1 + BITS) | high << 1 | u64::from(from < to)
}
