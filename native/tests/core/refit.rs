// SPDX-License-Identifier: GPL-3.0-or-later
//! A refitted tree has the boxes and the hits of its triangles, wherever they went, or there is none.

use crate::common::*;
use photon_stream_native::bvh::{self, Bvh};
use photon_stream_native::refit::{Refitted, refit};
use photon_stream_native::trace::Tree;
use photon_stream_native::watertight::Hit;

fn refitted(old: &Bvh, mesh: &Mesh) -> Option<Refitted> {
    let order: Vec<_> = old.order.iter().map(|&i| i as i32).collect();
    refit(&old.nodes, &order, &mesh.vertices, &mesh.triangles).unwrap()
}

const FAN: usize = 1000;

/// The tree of `old` about the triangles of `mesh`.
fn moved(old: &Bvh, mesh: &Mesh) -> Bvh {
    Bvh { nodes: refitted(old, mesh).expect("the same triangles").nodes, ..old.clone() }
}

/// Hits with the triangles' numbers in the scene, and whether there is any.
fn hits(mesh: &Mesh, bvh: &Bvh, rays: &RayList) -> (Vec<Option<(u32, Hit)>>, Vec<bool>) {
    let tree = Tree::new(&bvh.nodes, &corners(mesh, bvh)).unwrap().numbered(bvh.order.clone());
    let found = tree.trace(&rays.view());
    let number = |position: i32| bvh.order[position as usize];
    let found = found.iter().map(|hit| hit.map(|(position, hit)| (number(position), hit))).collect();
    (found, tree.occluded(&rays.view()))
}

/// Triangles that tell trees apart: large and small ones, needles, a sphere with shared edges, twins in one
/// place, and a heap of others almost there.
fn mixture(random: &mut Random) -> Mesh {
    let mut mesh = sphere(20, 0.8, [0.1, 0.0, -0.1]);
    let mut add = |other: Mesh| {
        let first = mesh.vertices.len() as i32;
        mesh.vertices.extend(other.vertices);
        mesh.triangles.extend(other.triangles.iter().map(|t| t.map(|index| index + first)));
    };
    for size in [1.0, 0.1, 0.01] {
        add(soup(150, size, random));
    }
    let mut needles = soup(200, 0.7, random);
    for triangle in needles.vertices.chunks_exact_mut(3) {
        let [_, b, c] = triangle else { unreachable!() };
        *c = std::array::from_fn(|k| b[k] + 1e-5 * c[k]);
    }
    add(needles);
    let heap = soup(1, 0.6, random);
    for _ in 0..150 {
        let shift = 1e-6 * random.unit();
        let vertices = heap.vertices.iter().map(|p| p.map(|x| x + shift)).collect();
        add(Mesh { vertices, triangles: heap.triangles.clone() });
    }
    // At its middle many of a fan are hit at one distance but for rounding, which is large on long triangles.
    let middle = random.point().map(|x| 0.5 * x);
    let mut fan = Mesh { vertices: vec![], triangles: vec![] };
    for i in 0..FAN as i32 {
        let (along, across) = (random.direction(), random.direction());
        let first: [f32; 3] = std::array::from_fn(|k| middle[k] + 1e-6 * across[k]);
        let second = std::array::from_fn(|k| first[k] + along[k]);
        let third = std::array::from_fn(|k| first[k] + along[k] + 0.04 * across[k]);
        fan.vertices.extend([first, second, third]);
        fan.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    add(fan);
    let twins: Vec<_> = mesh.triangles.iter().step_by(7).copied().collect();
    mesh.triangles.extend(twins);
    mesh
}

/// Rays anywhere, at edges and vertices, along the planes of triangles, and along the axes.
fn rays_at(mesh: &Mesh, count: usize, random: &mut Random) -> RayList {
    let mut rays = RayList::default();
    for i in 0..count {
        let triangle = mesh.triangles[random.below(mesh.triangles.len())];
        let [a, b, c] = triangle.map(|index| mesh.vertices[index as usize]);
        let (s, r) = (random.unit(), random.unit());
        let on = |s: f32, r: f32| -> [f32; 3] {
            std::array::from_fn(|k| a[k] + s * (b[k] - a[k]) + r * (c[k] - a[k]))
        };
        let from = random.point();
        let to = match i % 6 {
            0 => random.point(),
            1 => on(s, 0.0),
            2 => a.map(|x| x + 1e-7 * random.unit()),
            _ => on(s * (1.0 - r), r),
        };
        match i % 6 {
            // Almost in the triangle's plane.
            3 => {
                let origin = on(2.0 * random.unit() - 3.0, r);
                let origin = std::array::from_fn(|k| origin[k] + 1e-6 * from[k]);
                rays.push(origin, std::array::from_fn(|k| to[k] - origin[k]));
            }
            4 => {
                let axis = random.below(3);
                let mut origin = to;
                origin[axis] = 2.0 * (random.below(2) as f32) - 1.0;
                rays.push(origin, std::array::from_fn(|k| to[k] - origin[k]));
            }
            _ => rays.push(from, std::array::from_fn(|k| to[k] - from[k])),
        }
    }
    rays
}

#[test]
fn every_tree_has_the_same_hits() {
    let mut random = Random(11);
    let rest = mixture(&mut random);
    let built = build(&rest);
    for deformation in ["none", "bend", "shuffle", "flat"] {
        let mut mesh = Mesh { vertices: rest.vertices.clone(), triangles: rest.triangles.clone() };
        for vertex in &mut mesh.vertices {
            let [x, y, z] = *vertex;
            match deformation {
                "bend" => *vertex = [x + 0.3 * (4.0 * y).sin(), y, z * (1.0 + 0.5 * x)],
                "shuffle" => *vertex = [17.3 * x, 17.3 * y, 17.3 * z].map(|x| 2.0 * (x - x.floor()) - 1.0),
                // Everything within 1e-5: a heap of triangles that rounding can't tell apart.
                "flat" => *vertex = [x, y, 1e-5 * z + 0.3 * x],
                _ => {}
            }
        }
        // Some tear into triangles without area.
        let (mut fresh, mut tree) = (build(&mesh), built.clone());
        if fresh.order.len() < built.order.len() {
            let good: Vec<_> = fresh.order.iter().map(|&i| mesh.triangles[i as usize]).collect();
            mesh.triangles = good.clone();
            fresh = build(&mesh);
            tree = build(&Mesh { vertices: rest.vertices.clone(), triangles: good });
        }
        let other = moved(&tree, &mesh);
        depth(&other, &corners(&mesh, &other));
        assert!(deformation == "none" || other.order != fresh.order);
        let rays = rays_at(&mesh, 150_000, &mut random);
        let (one, another) = (hits(&mesh, &fresh, &rays), hits(&mesh, &other, &rays));
        assert!(one.1.iter().filter(|&&hit| hit).count() > 75_000);
        let differ = one.0.iter().zip(&another.0).filter(|(a, b)| a != b).count();
        assert_eq!(differ, 0, "{deformation}");
        assert_eq!(one.1, another.1);
        assert!(one.0.iter().zip(&one.1).all(|(hit, &any)| hit.is_some() == any));
    }
}

#[test]
fn boxes_fit_and_the_cost_tells_how_well() {
    let mut random = Random(5);
    let mut mesh = soup(5000, 0.05, &mut random);
    let bvh = build(&mesh);
    let same = refitted(&bvh, &mesh).unwrap();
    assert!(same.nodes == bvh.nodes && (same.cost / bvh.cost - 1.0).abs() < 1e-12);
    for vertex in &mut mesh.vertices {
        *vertex = vertex.map(|x| 5.0 - 1000.0 * x);
    }
    let larger = refitted(&bvh, &mesh).unwrap();
    assert!((larger.cost / bvh.cost - 1.0).abs() < 1e-4, "{}", larger.cost);
    mesh.vertices = soup(5000, 0.05, &mut random).vertices;
    let elsewhere = refitted(&bvh, &mesh).unwrap();
    assert!(elsewhere.cost > 10.0 * bvh.cost, "{} {}", elsewhere.cost, bvh.cost);
    let back = refitted(&Bvh { nodes: elsewhere.nodes, ..bvh.clone() }, &soup(5000, 0.05, &mut Random(5)));
    let back = back.unwrap();
    assert!(back.nodes == bvh.nodes);
    assert!((back.cost / bvh.cost - 1.0).abs() < 1e-12);
    // In a large array, too, where the work is divided.
    let large = sphere(200, 1.0, [0.0; 3]);
    let bvh = build(&large);
    assert!(refitted(&bvh, &large).unwrap().nodes == bvh.nodes);
}

#[test]
fn other_triangles_to_skip_need_another_tree() {
    let mesh = sphere(20, 1.0, [0.0; 3]);
    let bvh = build(&mesh);
    for bad in [[f32::NAN; 3], [0.0, f32::INFINITY, 0.0], [1.1e30, 0.0, 0.0], mesh.vertices[100]] {
        let mut vertices = mesh.vertices.clone();
        vertices[101] = bad;
        let broken = Mesh { vertices, triangles: mesh.triangles.clone() };
        assert!(build(&broken).order.len() < bvh.order.len());
        assert_eq!(refitted(&bvh, &broken), None);
        // And the other way round.
        assert_eq!(refitted(&build(&broken), &mesh), None);
        // While they stay bad, it may be in another way.
        let was = build(&broken);
        let still = refitted(&was, &broken).unwrap();
        let counts = (still.skipped_not_finite, still.skipped_degenerate);
        assert_eq!(counts, (was.skipped_not_finite, was.skipped_degenerate));
    }
}

#[test]
fn nothing_to_refit() {
    let none = Mesh { vertices: vec![], triangles: vec![] };
    let bvh = build(&none);
    assert_eq!(refitted(&bvh, &none).unwrap().nodes, bvh.nodes);
    let one = soup(1, 0.5, &mut Random(1));
    let bvh = build(&one);
    assert_eq!(refitted(&bvh, &one).unwrap().nodes, bvh.nodes);
}

#[test]
fn errors_name_what_is_wrong() {
    let mesh = sphere(4, 1.0, [0.0; 3]);
    let bvh = bvh::build(&mesh.vertices, &mesh.triangles).unwrap();
    let order: Vec<_> = bvh.order.iter().map(|&i| i as i32).collect();
    let error = |nodes: &[f32], order: &[i32], vertices: &[[f32; 3]]| {
        refit(nodes, order, vertices, &mesh.triangles).unwrap_err().0
    };
    assert!(error(&bvh.nodes, &order, &mesh.vertices[1..]).contains("is outside [0, 25)"));
    for bad in [-1, 48, order[0]] {
        let mut order = order.clone();
        order[7] = bad;
        let text = error(&bvh.nodes, &order, &mesh.vertices);
        assert!(text.starts_with(&format!("order[7] = {bad} is outside [0, 48) or")), "{text}");
    }
    assert!(error(&bvh.nodes[1..], &order, &mesh.vertices).contains("expected rows of 16"));
    for (at, value) in [(3, 0.0), (3, 1e9), (7, 1e9), (7, 0.5)] {
        let mut nodes = bvh.nodes.clone();
        nodes[at] = value;
        assert!(error(&nodes, &order, &mesh.vertices).starts_with("nodes[0, 3] = "));
    }
}
