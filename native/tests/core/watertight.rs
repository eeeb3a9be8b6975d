// SPDX-License-Identifier: GPL-3.0-or-later
//! No ray slips out of a closed mesh, and hits agree with float64.

use crate::common::*;
use photon_stream_native::{brute_force, trace::Tree};

const SCALES: [f64; 5] = [1e-4, 1e-2, 1.0, 1e3, 1e6];

/// A million by default; PHOTON_STREAM_RAYS sets another number.
fn ray_count() -> usize {
    std::env::var("PHOTON_STREAM_RAYS").map_or(1_000_000, |n| n.parse().unwrap())
}

#[test]
fn random_rays_out_of_a_closed_mesh_all_hit() {
    let mut random = Random(1);
    for (scale, centre) in SCALES.into_iter().map(|s| (s, [0.0; 3])).chain([(1.0, [1e3, -5e3, 2e3])]) {
        let mesh = sphere(40, scale, centre.map(|c| c * scale));
        let mut rays = RayList::default();
        for _ in 0..ray_count() / 6 {
            let p = random.point();
            let origin = std::array::from_fn(|k| ((centre[k] + 0.5 * p[k] as f64) * scale) as f32);
            rays.push(origin, random.direction());
        }
        assert_eq!(misses(&mesh, &rays), 0, "scale {scale}");
    }
}

#[test]
fn rays_at_edges_and_vertices_all_hit() {
    let mut random = Random(2);
    for scale in SCALES {
        let mesh = sphere(40, scale, [0.0; 3]);
        let mut rays = RayList::default();
        for i in 0..ray_count() / 5 {
            let origin = random.point().map(|x| 0.5 * x * scale as f32);
            let triangle = mesh.triangles[random.below(mesh.triangles.len())];
            let corner = random.below(3);
            let a = mesh.vertices[triangle[corner] as usize];
            let b = mesh.vertices[triangle[(corner + 1) % 3] as usize];
            // A vertex, or a point on an edge.
            let s = if i % 2 == 0 { 0.0 } else { random.unit() };
            let target: [f32; 3] = std::array::from_fn(|k| a[k] + s * (b[k] - a[k]));
            rays.push(origin, std::array::from_fn(|k| target[k] - origin[k]));
        }
        assert_eq!(misses(&mesh, &rays), 0, "scale {scale}");
    }
}

/// Here the rays meet edges and vertices exactly: all numbers are small integers.
#[test]
fn axis_parallel_rays_through_a_grid_of_edges_all_hit() {
    let n = 16;
    let mut mesh = Mesh { vertices: Vec::new(), triangles: Vec::new() };
    for (x, y) in (0..=n).flat_map(|y| (0..=n).map(move |x| (x, y))) {
        mesh.vertices.push([x as f32, y as f32, 0.0]);
    }
    for (x, y) in (0..n).flat_map(|y| (0..n).map(move |x| (x, y))) {
        let a = y * (n + 1) + x;
        mesh.triangles.extend([[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]);
    }
    let mut rays = RayList::default();
    for (x, y) in (0..=2 * n).flat_map(|y| (0..=2 * n).map(move |x| (x, y))) {
        rays.push([x as f32 / 2.0, y as f32 / 2.0, 1.0], [0.0, 0.0, -1.0]);
        rays.push([x as f32 / 2.0, y as f32 / 2.0, -3.0], [-0.0, 0.0, 2.0]);
    }
    let hits = trace(&mesh, &rays);
    assert!(hits.iter().step_by(2).all(|hit| hit.unwrap().1.t == 1.0));
    assert!(hits.iter().skip(1).step_by(2).all(|hit| hit.unwrap().1.t == 1.5));
}

/// Compare with float64 where it is sure, i.e. away from edges; return the number of hits compared.
fn agree_with_float64(mesh: &Mesh, rays: &RayList, edge: f64) -> usize {
    let bvh = build(mesh);
    let corners = corners(mesh, &bvh);
    let tree = Tree::new(&bvh.nodes, &corners).unwrap();
    let hits = tree.trace(&rays.view());
    let exact = brute_force::trace(&corners, &rays.view());
    let mut compared = 0;
    for (i, (hit, exact)) in hits.iter().zip(&exact).enumerate() {
        let near_edge = |(_, _, u, v): (i32, f64, f64, f64)| u.min(v).min(1.0 - u - v) < edge;
        if exact.is_some_and(near_edge) {
            continue;
        }
        let Some((position, t, u, v)) = *exact else {
            // A hit that float64 misses lies on an edge.
            if let Some((_, hit)) = hit {
                let inside = (hit.u.min(hit.v).min(1.0 - hit.u - hit.v)) as f64;
                assert!(inside < edge, "ray {i}: {hit:?}, but float64 finds none");
            }
            continue;
        };
        let (found, hit) = hit.unwrap_or_else(|| panic!("ray {i} misses, float64 finds {exact:?}"));
        if (hit.t as f64) < t * (1.0 - 1e-3) || found != position {
            let inside = (hit.u.min(hit.v).min(1.0 - hit.u - hit.v)) as f64;
            assert!(inside < edge, "ray {i}: {found} {hit:?}, float64: {exact:?}");
            continue;
        }
        let difference = ((hit.t as f64 - t) / t).abs().max((hit.u as f64 - u).abs());
        assert!(difference.max((hit.v as f64 - v).abs()) < edge, "ray {i}: {hit:?}, float64: {exact:?}");
        compared += 1;
    }
    compared
}

#[test]
fn agrees_with_brute_force() {
    let mut random = Random(3);
    let mesh = soup(1000, 0.3, &mut random);
    let mut rays = RayList::default();
    for _ in 0..20_000 {
        rays.push(random.point().map(|x| 1.5 * x), random.direction());
    }
    let compared = agree_with_float64(&mesh, &rays, 1e-3);
    assert!(compared > 5000, "{compared}");
}

/// 1e-4 to 1e-7 as wide as long: a determinant test with a fixed epsilon loses them.
#[test]
fn needles_agree_with_float64() {
    for (seed, width) in [1e-4f32, 1e-5, 1e-6, 1e-7].into_iter().enumerate() {
        let mut random = Random(seed as u64);
        let mut compared = 0;
        for _ in 0..500 {
            let (a, along, across) = (random.point(), random.direction(), random.direction());
            let b = std::array::from_fn(|k| a[k] + along[k]);
            let c = std::array::from_fn(|k| a[k] + width * across[k]);
            let mesh = Mesh { vertices: vec![a, b, c], triangles: vec![[0, 1, 2]] };
            if build(&mesh).order.is_empty() {
                continue;
            }
            let mut rays = RayList::default();
            for _ in 0..20 {
                let (s, r) = (random.unit(), random.unit());
                let (u, v) = if s + r < 1.0 { (s, r) } else { (1.0 - s, 1.0 - r) };
                let target: [f32; 3] = std::array::from_fn(|k| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]));
                let d = random.direction();
                let normal: [f32; 3] = std::array::from_fn(|k| {
                    let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                    along[i] * across[j] - along[j] * across[i]
                });
                // At grazing angles the rounding of corners shows in any algorithm.
                if (0..3).map(|k| d[k] * normal[k]).sum::<f32>().abs() < 0.2 {
                    continue;
                }
                rays.push(std::array::from_fn(|k| target[k] - d[k]), d);
            }
            let bvh = build(&mesh);
            let corners = corners(&mesh, &bvh);
            let hits = Tree::new(&bvh.nodes, &corners).unwrap().trace(&rays.view());
            let exact = brute_force::trace(&corners, &rays.view());
            for (hit, exact) in hits.iter().zip(&exact) {
                // Translation rounds corners by 1e-7, which is a needle's width here: whether it
                // is hit may differ, where it is hit may not.
                if let (Some((_, hit)), Some((_, t, u, _))) = (hit, exact) {
                    assert!((hit.t as f64 - t).abs() < 1e-5, "width {width}: {hit:?} {exact:?}");
                    assert!((hit.u as f64 - u).abs() < 1e-5, "width {width}: {hit:?} {exact:?}");
                    compared += 1;
                }
            }
        }
        assert!(compared > 100, "width {width}: {compared}");
    }
}

/// Needles and the ray in units of their width: nothing is rounded away, so hits must be equal.
#[test]
fn needles_near_the_origin_agree_with_float64() {
    let mut random = Random(9);
    for width in [1e-4f32, 1e-8, 1e-12, 1e-16] {
        let mesh = Mesh {
            vertices: vec![[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, width, 0.0]],
            triangles: vec![[0, 1, 2]],
        };
        let mut rays = RayList::default();
        for _ in 0..5000 {
            let (x, y) = (2.0 * random.unit() - 1.0, 1.5 * width * (random.unit() - 0.2));
            rays.push([x, y, 1.0], [0.0, 0.0, -1.0]);
        }
        assert!(agree_with_float64(&mesh, &rays, 1e-4) > 500, "width {width}");
    }
}

#[test]
fn useless_rays_miss() {
    let mesh = sphere(10, 1.0, [0.0; 3]);
    let mut rays = RayList::default();
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for k in 0..3 {
            let (mut origin, mut direction) = ([0.0; 3], [0.0, 1.0, 0.0]);
            origin[k] = bad;
            rays.push(origin, [0.0, 1.0, 0.0]);
            direction[k] = bad;
            rays.push([0.0; 3], direction);
        }
    }
    rays.push([0.0; 3], [0.0; 3]);
    rays.push([0.0; 3], [-0.0, 0.0, 1e-40]);
    for t_max in [0.0, -1.0, f32::NAN, f32::NEG_INFINITY, 0.5] {
        rays.push([0.0; 3], [0.0, 1.0, 0.0]);
        *rays.t_max.last_mut().unwrap() = t_max;
    }
    assert_eq!(misses(&mesh, &rays), rays.origins.len());
}

#[test]
fn skip_and_t_max_bound_the_search() {
    let quad = |z: f32| [[-1.0, -1.0, z], [3.0, -1.0, z], [-1.0, 3.0, z]];
    let mesh = Mesh { vertices: [quad(1.0), quad(2.0)].concat(), triangles: vec![[0, 1, 2], [3, 4, 5]] };
    let bvh = build(&mesh);
    let first = bvh.order.iter().position(|&i| i == 0).unwrap() as i32;
    let mut rays = RayList::default();
    for (t_max, skip) in [(9.0, -1), (9.0, first), (1.0, -1), (1.5, first), (2.5, 1 - first)] {
        rays.push([0.0; 3], [0.0, 0.0, 1.0]);
        *rays.t_max.last_mut().unwrap() = t_max;
        *rays.skip.last_mut().unwrap() = skip;
    }
    let distances: Vec<_> = trace(&mesh, &rays).iter().map(|hit| hit.map(|hit| hit.1.t)).collect();
    assert_eq!(distances, [Some(1.0), Some(2.0), None, None, Some(1.0)]);
    rays.skip[3] = 2;
    assert!(rays.view().check(2).unwrap_err().0.contains("skip[3] = 2"));
}

/// Coincident triangles: the smallest position wins, whatever the order of traversal.
#[test]
fn ties_go_to_the_smallest_position() {
    let mut random = Random(4);
    let triangle = [[-1.0, -1.0, 0.0], [2.0, -1.0, 0.0], [-1.0, 2.0, 0.0]];
    let mesh = Mesh { vertices: triangle.to_vec(), triangles: vec![[0, 1, 2]; 50] };
    let mut rays = RayList::default();
    for _ in 0..1000 {
        let origin = random.point().map(|x| 0.3 * x);
        let side = if random.unit() < 0.5 { 1.0 } else { -1.0 };
        rays.push([origin[0], origin[1], side], [0.0, 0.0, -side]);
    }
    assert!(trace(&mesh, &rays).iter().all(|hit| hit.unwrap().0 == 0));
}
