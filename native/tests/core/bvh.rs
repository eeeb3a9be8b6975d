// SPDX-License-Identifier: GPL-3.0-or-later
//! The tree is valid, shallow, and the same every time, whatever it is built of.

use crate::common::*;
use photon_stream_native::bvh::{self, MAX_DEPTH};
use photon_stream_native::trace::Tree;

fn check(mesh: &Mesh) -> u32 {
    let bvh = build(mesh);
    let corners = corners(mesh, &bvh);
    assert_eq!(bvh.order.len() + bvh.skipped_not_finite + bvh.skipped_degenerate, mesh.triangles.len());
    let mut order = bvh.order.clone();
    order.sort_unstable();
    order.dedup();
    assert_eq!(order.len(), bvh.order.len());
    Tree::new(&bvh.nodes, &corners).unwrap();
    let depth = depth(&bvh, &corners);
    assert!(depth <= MAX_DEPTH, "{depth}");
    depth
}

#[test]
fn ordinary_meshes() {
    let mut random = Random(1);
    assert!(check(&sphere(60, 1.0, [0.0; 3])) < 30);
    assert!(check(&soup(10_000, 0.05, &mut random)) < 40);
    for count in 0..40 {
        check(&soup(count, 0.5, &mut random));
    }
}

#[test]
fn no_triangle_and_one_triangle() {
    let none = build(&Mesh { vertices: vec![], triangles: vec![] });
    let missing = [bvh::EMPTY, bvh::EMPTY, bvh::EMPTY, -1.0, -bvh::EMPTY, -bvh::EMPTY, -bvh::EMPTY, 0.0];
    assert_eq!(none.nodes, [missing, missing].concat());
    let mesh =
        Mesh { vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], triangles: vec![[0, 1, 2]] };
    let one = build(&mesh);
    assert_eq!(one.nodes, [&[0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 1.0], &missing[..]].concat());
    let mut rays = RayList::default();
    for direction in [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [1.0, 1.0, -1.0], [-0.0, 1e-30, -1.0]] {
        rays.push([0.25, 0.25, 0.5], direction);
    }
    let hits: Vec<_> = trace(&mesh, &rays).iter().map(|hit| hit.map(|hit| hit.0)).collect();
    assert_eq!(hits, [Some(0), None, None, Some(0)]);
    assert_eq!(misses(&Mesh { vertices: vec![], triangles: vec![] }, &rays), 4);
}

#[test]
fn a_hundred_thousand_duplicates() {
    let mut mesh = sphere(2, 1.0, [0.0; 3]);
    mesh.triangles = vec![mesh.triangles[0]; 100_000];
    assert!(check(&mesh) < 20);
}

/// Each triangle twice the size of the one before: SAH would peel them off one by one.
#[test]
fn sizes_that_grow_exponentially() {
    let mut mesh = Mesh { vertices: vec![], triangles: vec![] };
    for exponent in -95..95 {
        let s = 2f32.powi(exponent);
        let first = mesh.vertices.len() as i32;
        mesh.vertices.extend([[s, 0.0, 0.0], [1.5 * s, 0.0, 0.0], [s, s / 2.0, 0.0]]);
        mesh.triangles.extend([[first, first + 1, first + 2]; 200]);
    }
    assert!(check(&mesh) <= MAX_DEPTH);
}

#[test]
fn extreme_coordinates() {
    let mut random = Random(5);
    for scale in [1e-44f32, 1e-38, 1e-20, 1e20, 9e29] {
        let mut mesh = soup(1000, 0.1, &mut random);
        for x in mesh.vertices.iter_mut().flatten() {
            *x = (*x * scale).clamp(-1e30, 1e30);
        }
        check(&mesh);
        let mut rays = RayList::default();
        for _ in 0..1000 {
            rays.push(random.point().map(|x| 0.9 * x * scale), random.direction());
        }
        trace(&mesh, &rays);
    }
}

#[test]
fn bad_triangles_leave_the_others_identical() {
    let good = sphere(20, 1.0, [0.0; 3]);
    let mut mesh = Mesh { vertices: good.vertices.clone(), triangles: vec![] };
    let first_bad = mesh.vertices.len() as i32;
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1.1e30] {
        mesh.vertices.push([0.0, bad, 0.0]);
    }
    let mut kept = Vec::new();
    for (i, triangle) in good.triangles.iter().enumerate() {
        match i % 7 {
            0 => mesh.triangles.push([triangle[0], first_bad + i as i32 % 4, triangle[1]]),
            1 => mesh.triangles.push([triangle[0], triangle[1], triangle[0]]),
            _ => {}
        }
        kept.push(mesh.triangles.len() as u32);
        mesh.triangles.push(*triangle);
    }
    let (clean, dirty) = (build(&good), build(&mesh));
    assert_eq!(dirty.nodes, clean.nodes);
    let renumbered: Vec<_> = clean.order.iter().map(|&i| kept[i as usize]).collect();
    assert_eq!(dirty.order, renumbered);
    assert_eq!(dirty.skipped_not_finite, good.triangles.len().div_ceil(7));
    assert_eq!(dirty.skipped_not_finite + dirty.skipped_degenerate, mesh.triangles.len() - kept.len());
}

#[test]
fn triangles_without_area_are_degenerate() {
    let vertices = vec![[0.0; 3], [1.0, 2.0, 3.0], [2.0, 4.0, 6.0], [0.0; 3], [1.0, 2.0, 3.0001]];
    let bvh = bvh::build(&vertices, &[[0, 1, 2], [0, 3, 1], [2, 2, 2], [0, 1, 4]]).unwrap();
    assert_eq!((bvh.order, bvh.skipped_degenerate, bvh.skipped_not_finite), (vec![3], 3, 0));
}

#[test]
fn bad_indices_are_refused() {
    let mesh = sphere(50, 1.0, [0.0; 3]);
    let count = mesh.vertices.len() as i32;
    for (row, column, value) in [(0, 0, -1), (4000, 2, count), (9000, 1, i32::MIN), (77, 1, i32::MAX)] {
        let mut triangles = mesh.triangles.clone();
        triangles[row][column] = value;
        triangles[9500][0] = -7;
        let error = bvh::build(&mesh.vertices, &triangles).unwrap_err();
        assert_eq!(error.0, format!("triangles[{row}, {column}] = {value} is outside [0, {count})"));
    }
    let many = vec![[0; 3]; bvh::MAX_TRIANGLES + 1];
    assert!(bvh::build(&[[0.0; 3]], &many).unwrap_err().0.contains("16777216"));
}

#[test]
fn the_same_on_any_number_of_threads() {
    let mesh = sphere(160, 1.0, [0.0; 3]); // More than PARALLEL_PASS triangles.
    let reference = build(&mesh);
    for threads in [1, 2, 3, 7] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        for _ in 0..3 {
            assert!(pool.install(|| build(&mesh)) == reference, "{threads} threads");
        }
    }
}

#[test]
fn trees_that_are_none_are_refused() {
    let mesh = sphere(4, 1.0, [0.0; 3]);
    let bvh = build(&mesh);
    let corners = corners(&mesh, &bvh);
    assert!(Tree::new(&[], &corners).is_err());
    assert!(Tree::new(&bvh.nodes[..15], &corners).is_err());
    assert!(Tree::new(&bvh.nodes, &corners[1..]).is_err());
    let inner = (0..bvh.nodes.len()).find(|&i| i % 8 == 7 && bvh.nodes[i] == 0.0).unwrap();
    for (at, value) in
        [(inner - 4, 0.0), (inner - 4, 1e7), (inner - 4, 1.5), (inner - 4, f32::NAN), (inner, -1.0)]
    {
        let mut nodes = bvh.nodes.clone();
        nodes[at] = value;
        let error = Tree::new(&nodes, &corners).err().expect("refused");
        assert!(error.0.starts_with(&format!("nodes[{}, {}]", at / 16, (inner - 4) % 16)), "{error}");
    }
    // A chain of more levels than the stack holds.
    let mut nodes = Vec::new();
    for i in 0..63 {
        nodes.extend([0.0, 0.0, 0.0, (i + 1) as f32, 1.0, 1.0, 1.0, 0.0]);
        nodes.extend([0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]);
    }
    nodes[62 * 16 + 3] = -1.0;
    assert!(Tree::new(&nodes, &corners).is_err());
    nodes.truncate(62 * 16);
    nodes[61 * 16 + 3] = -1.0;
    Tree::new(&nodes, &corners).unwrap();
}
