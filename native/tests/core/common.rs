// SPDX-License-Identifier: GPL-3.0-or-later
//! Meshes, random numbers and shorthands that the tests share.

use photon_stream_native::bvh::{self, Bvh};
use photon_stream_native::trace::{Rays, Tree};
use photon_stream_native::watertight::{Hit, Triangle};

pub struct Mesh {
    pub vertices: Vec<[f32; 3]>,
    pub triangles: Vec<[i32; 3]>,
}

/// SplitMix64 (Steele, Lea & Flood 2014).
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u64 << 24) as f32
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// In [-1, 1)^3.
    pub fn point(&mut self) -> [f32; 3] {
        [0; 3].map(|_| 2.0 * self.unit() - 1.0)
    }

    pub fn direction(&mut self) -> [f32; 3] {
        loop {
            let p = self.point();
            let square = p.iter().map(|x| x * x).sum::<f32>();
            if square > 0.01 && square < 1.0 {
                return p.map(|x| x / square.sqrt());
            }
        }
    }
}

/// A closed sphere of 2 * rings * (2 * rings - 1) triangles that share their vertices.
pub fn sphere(rings: usize, radius: f64, centre: [f64; 3]) -> Mesh {
    let segments = 2 * rings;
    let place = |theta: f64, phi: f64| {
        let unit = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()];
        std::array::from_fn(|k| (centre[k] + radius * unit[k]) as f32)
    };
    let mut vertices = vec![place(0.0, 0.0)];
    for ring in 1..rings {
        for segment in 0..segments {
            let phi = std::f64::consts::TAU * segment as f64 / segments as f64;
            vertices.push(place(std::f64::consts::PI * ring as f64 / rings as f64, phi));
        }
    }
    vertices.push(place(std::f64::consts::PI, 0.0));
    let last = vertices.len() - 1;
    let at = |ring: usize, segment: usize| match ring {
        0 => 0,
        ring if ring == rings => last as i32,
        ring => (1 + (ring - 1) * segments + segment % segments) as i32,
    };
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for segment in 0..segments {
            let (a, b) = (at(ring, segment), at(ring, segment + 1));
            let (c, d) = (at(ring + 1, segment), at(ring + 1, segment + 1));
            if ring > 0 {
                triangles.push([a, c, b]);
            }
            if ring + 1 < rings {
                triangles.push([b, c, d]);
            }
        }
    }
    Mesh { vertices, triangles }
}

/// Unconnected triangles of about the given size in [-1, 1]^3.
pub fn soup(count: usize, size: f32, random: &mut Random) -> Mesh {
    let mut mesh = Mesh { vertices: Vec::new(), triangles: Vec::new() };
    for i in 0..count as i32 {
        let centre = random.point();
        for _ in 0..3 {
            let offset = random.point();
            mesh.vertices.push(std::array::from_fn(|k| centre[k] + size * offset[k]));
        }
        mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    mesh
}

pub fn build(mesh: &Mesh) -> Bvh {
    bvh::build(&mesh.vertices, &mesh.triangles).unwrap()
}

/// The triangles in leaf order.
pub fn corners(mesh: &Mesh, bvh: &Bvh) -> Vec<Triangle> {
    bvh.order.iter().map(|&i| mesh.triangles[i as usize].map(|v| mesh.vertices[v as usize])).collect()
}

#[derive(Default)]
pub struct RayList {
    pub origins: Vec<[f32; 3]>,
    pub directions: Vec<[f32; 3]>,
    pub t_max: Vec<f32>,
    pub skip: Vec<i32>,
}

impl RayList {
    pub fn push(&mut self, origin: [f32; 3], direction: [f32; 3]) {
        self.origins.push(origin);
        self.directions.push(direction);
        self.t_max.push(f32::INFINITY);
        self.skip.push(-1);
    }

    pub fn view(&self) -> Rays<'_> {
        Rays { origins: &self.origins, directions: &self.directions, t_max: &self.t_max, skip: &self.skip }
    }
}

pub fn trace(mesh: &Mesh, rays: &RayList) -> Vec<Option<(i32, Hit)>> {
    let bvh = build(mesh);
    let corners = corners(mesh, &bvh);
    let tree = Tree::new(&bvh.nodes, &corners).unwrap();
    rays.view().check(corners.len()).unwrap();
    let hits = tree.trace(&rays.view());
    let occluded = tree.occluded(&rays.view());
    assert!(hits.iter().zip(&occluded).all(|(hit, &occluded)| hit.is_some() == occluded));
    hits
}

pub fn misses(mesh: &Mesh, rays: &RayList) -> usize {
    trace(mesh, rays).iter().filter(|hit| hit.is_none()).count()
}

/// Most inner nodes on a path; panics unless every triangle lies in one leaf of at most MAX_LEAF,
/// and inside the bounds of that leaf and of every node above it.
pub fn depth(bvh: &Bvh, corners: &[Triangle]) -> u32 {
    let mut seen = vec![0; bvh.order.len()];
    let unbounded = ([f32::NEG_INFINITY; 3], [f32::INFINITY; 3]);
    let mut stack = vec![(0, 1, unbounded.0, unbounded.1)];
    let mut deepest = 0;
    while let Some((node, depth, low, high)) = stack.pop() {
        deepest = deepest.max(depth);
        for side in [0, 8] {
            let child = &bvh.nodes[16 * node + side..][..8];
            let (reference, count) = (child[3], child[7] as usize);
            if reference < 0.0 {
                assert!(node == 0 && count == 0 && child[0] == bvh::EMPTY && child[4] == -bvh::EMPTY);
                continue;
            }
            let min: [f32; 3] = std::array::from_fn(|k| child[k].max(low[k]));
            let max: [f32; 3] = std::array::from_fn(|k| child[k + 4].min(high[k]));
            if count == 0 {
                stack.push((reference as usize, depth + 1, min, max));
            }
            assert!(count <= bvh::MAX_LEAF);
            for position in reference as usize..reference as usize + count {
                seen[position] += 1;
                for corner in &corners[position] {
                    assert!((0..3).all(|k| min[k] <= corner[k] && corner[k] <= max[k]));
                }
            }
        }
    }
    assert!(seen.iter().all(|&n| n == 1));
    deepest
}
