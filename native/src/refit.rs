// SPDX-License-Identifier: GPL-3.0-or-later
//! Moves the boxes of a BVH with its triangles, from the leaves up, as long as these are the same.

use rayon::prelude::*;

use crate::InvalidInput;
use crate::bounds::Bounds;
use crate::bvh::{CHILDREN, NODE_FLOATS, PASS_CHUNK, Skip, box_at, box_of, check_indices, cost};
use crate::trace::child_of;

/// A BVH of triangles that have moved.
#[derive(Debug, Clone, PartialEq)]
pub struct Refitted {
    /// The old ones, references and all, with other boxes.
    pub nodes: Vec<f32>,
    pub skipped_not_finite: usize,
    pub skipped_degenerate: usize,
    /// As [`crate::bvh::Bvh::cost`].
    pub cost: f64,
}

/// Fit the boxes of a BVH to triangles whose vertices have moved.
///
/// `nodes` and `order` are what [`crate::bvh::build`] made of `triangles` and other vertices; a refitted
/// tree can be refitted again. None if other triangles have to be skipped now.
///
/// # Errors
/// A vertex index outside `vertices`; an `order` of other triangles; references of `nodes` out of range or
/// not to a later node. Whether they form one tree is not looked at.
pub fn refit(
    nodes: &[f32],
    order: &[i32],
    vertices: &[[f32; 3]],
    triangles: &[[i32; 3]],
) -> Result<Option<Refitted>, InvalidInput> {
    check_indices(triangles, vertices.len())?;
    let corners = |triangle: &[i32; 3]| triangle.map(|index| vertices[index as usize]);
    let skipped = skipped_by(order, triangles.len())?;
    let (mut not_finite, mut degenerate) = (0, 0);
    for (triangle, _) in triangles.iter().zip(&skipped).filter(|(_, skipped)| **skipped) {
        match box_of(&corners(triangle)) {
            Err(Skip::NotFinite) => not_finite += 1,
            Err(Skip::Degenerate) => degenerate += 1,
            Ok(_) => return Ok(None),
        }
    }

    let mut nodes = nodes.to_vec();
    let (rows, rest) = nodes.as_chunks_mut::<NODE_FLOATS>();
    if rows.is_empty() || !rest.is_empty() {
        return Err(InvalidInput(format!("nodes: expected rows of {NODE_FLOATS} floats, at least one")));
    }
    let count = rows.len();
    let fit_leaves = |(chunk, nodes): (usize, &mut [[f32; NODE_FLOATS]])| {
        let mut areas = 0.0;
        for (offset, node) in nodes.iter_mut().enumerate() {
            for at in CHILDREN {
                let child = child_of(chunk * PASS_CHUNK + offset, at, node, count, order.len());
                let (first, count) = child.map_err(Stop::Invalid)?.unwrap_or((0, 0));
                if count > 0 {
                    let mut bounds = Bounds::EMPTY;
                    for &triangle in &order[first..first + count] {
                        let own =
                            box_of(&corners(&triangles[triangle as usize])).map_err(|_| Stop::Skipped)?;
                        bounds = bounds.union(&own);
                        areas += own.half_area();
                    }
                    set_box(node, at, &bounds);
                }
            }
        }
        Ok(areas)
    };
    let areas: Result<Vec<f64>, Stop> = rows.par_chunks_mut(PASS_CHUNK).enumerate().map(fit_leaves).collect();
    let areas: f64 = match areas {
        Err(Stop::Skipped) => return Ok(None),
        Err(Stop::Invalid(error)) => return Err(error),
        Ok(areas) => areas.iter().sum(),
    };
    fit_inner(rows);
    let cost = cost(&nodes) / areas;
    Ok(Some(Refitted { nodes, skipped_not_finite: not_finite, skipped_degenerate: degenerate, cost }))
}

enum Stop {
    Invalid(InvalidInput),
    /// A triangle has to be skipped that was not.
    Skipped,
}

/// Which of so many triangles an order leaves out.
pub(crate) fn skipped_by(order: &[i32], count: usize) -> Result<Vec<bool>, InvalidInput> {
    let mut skipped = vec![true; count];
    for (position, &triangle) in order.iter().enumerate() {
        let is_new = usize::try_from(triangle).ok().and_then(|t| skipped.get_mut(t)).map(std::mem::take);
        if is_new != Some(true) {
            return Err(InvalidInput(format!(
                "order[{position}] = {triangle} is outside [0, {count}) or there twice"
            )));
        }
    }
    Ok(skipped)
}

/// Fit the boxes about inner nodes to their children's.
fn fit_inner(nodes: &mut [[f32; NODE_FLOATS]]) {
    // Children follow their parents.
    for row in (0..nodes.len()).rev() {
        for at in CHILDREN {
            if nodes[row][at + 7] == 0.0 && nodes[row][at + 3] >= 0.0 {
                let child = &nodes[nodes[row][at + 3] as usize];
                let bounds = CHILDREN.map(|at| box_at(child, at));
                set_box(&mut nodes[row], at, &bounds[0].union(&bounds[1]));
            }
        }
    }
}

fn set_box(node: &mut [f32; NODE_FLOATS], at: usize, bounds: &Bounds) {
    node[at..at + 3].copy_from_slice(&bounds.min[..3]);
    node[at + 4..at + 7].copy_from_slice(&bounds.max[..3]);
}
