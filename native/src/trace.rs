// SPDX-License-Identifier: GPL-3.0-or-later
//! Traces rays through the tree of [`crate::bvh::build`], made eight wide: the GLSL finds the same
//! hits.

use rayon::prelude::*;

use crate::InvalidInput;
use crate::bvh::{CHILDREN, MAX_DEPTH, NODE_FLOATS};
use crate::lanes::{Lanes, widest};
use crate::watertight::{Hit, Ray, Triangle};
use crate::wide::{Lifted, Stack, Wide};

const RAYS_A_TASK: usize = 512;
/// Beyond any scene, as in glsl/lib/constants.glsl; what rays are, as in glsl/lib/ray_bits.glsl.
pub const T_MAX: f32 = 3.0e38;
const RAY_CAMERA: u8 = 1;
const RAY_TRANSMISSION: u8 = 8;
const RAYS_OF_LOBES: u8 = 2 + 4 + RAY_TRANSMISSION;
/// Says of a ray that it ends where a walk below a surface has come out.
pub(crate) const EXIT: u8 = RAYS_OF_LOBES + 2;
const ALL_RAYS: u8 = 63;

/// Rays as parallel arrays of one length.
#[derive(Clone, Copy)]
pub struct Rays<'a> {
    pub origins: &'a [[f32; 3]],
    /// Need not be unit vectors; distances are in lengths of the direction.
    pub directions: &'a [[f32; 3]],
    /// A hit lies in 0 < t < t_max.
    pub t_max: &'a [f32],
    /// Position of a triangle that the ray passes through, -1 for none.
    pub skip: &'a [i32],
}

impl Rays<'_> {
    /// # Errors
    /// Arrays of different lengths, a `skip` that is neither -1 nor a triangle.
    pub fn check(&self, triangle_count: usize) -> Result<(), InvalidInput> {
        let count = self.origins.len();
        for (name, length) in
            [("directions", self.directions.len()), ("t_max", self.t_max.len()), ("skip", self.skip.len())]
        {
            if length != count {
                return Err(InvalidInput(format!("{name} has {length} rows, but origins has {count}")));
            }
        }
        let bad = |&skip: &i32| skip < -1 || skip as i64 >= triangle_count as i64;
        match self.skip.par_iter().with_min_len(1 << 14).position_first(bad) {
            None => Ok(()),
            Some(row) => {
                let value = self.skip[row];
                Err(InvalidInput(format!("skip[{row}] = {value} is outside [-1, {triangle_count})")))
            }
        }
    }

    /// Calls `trace(ray, t_max, skip)` for every ray that can hit anything.
    pub(crate) fn map<T: Send + Sync + Clone>(
        &self,
        miss: T,
        trace: impl Fn(&Ray, f32, i32) -> Option<T> + Sync,
    ) -> Vec<T> {
        (0..self.origins.len())
            .into_par_iter()
            .with_min_len(RAYS_A_TASK)
            .map(|i| {
                // False for NaN.
                let ray =
                    if self.t_max[i] > 0.0 { Ray::new(self.origins[i], self.directions[i]) } else { None };
                ray.and_then(|ray| trace(&ray, self.t_max[i], self.skip[i])).unwrap_or_else(|| miss.clone())
            })
            .collect()
    }
}

/// Which triangles rays meet.
#[derive(Clone, Copy)]
pub struct Visible<'a> {
    /// A bit for each class of rays that meets a triangle, in leaf order; empty: all meet all.
    pub bits: &'a [u8],
    /// The classes that the rays are of.
    pub rays: u8,
    /// Whether each ray says itself of which class it is, by how far it goes (glsl/lib/reach.glsl).
    pub by_reach: bool,
}

impl Visible<'static> {
    pub const TO_ALL: Visible<'static> = Visible { bits: &[], rays: u8::MAX, by_reach: false };
}

impl Visible<'_> {
    /// What a ray that goes so far meets.
    #[inline(always)]
    fn to_ray(self, t_max: f32) -> Self {
        if !self.by_reach {
            return self;
        }
        if (T_MAX / t_max + 0.5) as u32 == u32::from(EXIT) {
            return Visible { rays: ALL_RAYS, ..self };
        }
        let is_of_eye = t_max < T_MAX / f32::from(EXIT);
        let sent = if is_of_eye { RAY_CAMERA } else { ((T_MAX / t_max + 0.5) as u8).saturating_sub(1) };
        let rays = if sent & RAY_TRANSMISSION != 0 { RAY_TRANSMISSION } else { sent };
        Visible { rays, ..self }
    }

    #[inline(always)]
    fn meets(&self, position: i32) -> bool {
        self.bits.is_empty() || self.bits[position as usize] & self.rays != 0
    }
}

/// A tree for tracing, from a node array that has been checked: every reference is in range, and
/// a traversal ends.
pub struct Tree {
    wide: Wide,
    numbers: Vec<u32>,
}

impl Tree {
    /// Read `nodes` as laid out by [`crate::bvh::build`]; `corners` are the triangles in leaf order.
    ///
    /// # Errors
    /// No node; a reference or count that is out of range or not an integer; an inner node that
    /// does not follow its parent or has two; more than [`MAX_DEPTH`] levels.
    pub fn new(nodes: &[f32], corners: &[Triangle]) -> Result<Tree, InvalidInput> {
        let (nodes, rest) = nodes.as_chunks::<NODE_FLOATS>();
        if nodes.is_empty() || !rest.is_empty() {
            return Err(InvalidInput(format!("nodes: expected rows of {NODE_FLOATS} floats, at least one")));
        }
        // Of a node that has a parent, or is the root; else 0.
        let mut depths = vec![0u32; nodes.len()];
        depths[0] = 1;
        for (row, node) in nodes.iter().enumerate() {
            for at in CHILDREN {
                let inner = child_of(row, at, node, nodes.len(), corners.len())?;
                if let Some((reference, 0)) = inner {
                    // Nodes that follow their only parent form a tree: a traversal ends.
                    let depth = depths[row] + 1;
                    if depths[reference] > 0 || depth > MAX_DEPTH {
                        return Err(bad_child(row, at, node));
                    }
                    depths[reference] = depth;
                }
            }
        }
        let numbers = (0..corners.len() as u32).collect();
        Ok(Tree { wide: Wide::new(nodes, corners), numbers })
    }

    /// Give triangles other numbers than their positions: of two that a ray hits at the same distance the
    /// smaller one's is the closest hit. Those of the scene make hits the same in every tree of it.
    #[must_use]
    pub fn numbered(self, numbers: Vec<u32>) -> Tree {
        assert_eq!(numbers.len(), self.numbers.len(), "a number for each triangle");
        Tree { numbers, ..self }
    }

    /// The closest hit of a ray: the triangle's position in leaf order and where it is hit. Of
    /// triangles at the same distance, the one of the smallest number. It meets those alone that `meets` is
    /// true of, by their positions.
    #[inline(always)]
    pub(crate) fn closest<L: Lanes>(
        &self,
        ray: &Ray,
        t_max: f32,
        skip: i32,
        meets: impl Fn(i32) -> bool,
        stack: &mut Stack,
    ) -> Option<(i32, Hit)> {
        let mut best: Option<(i32, Hit)> = None;
        self.wide.traverse::<L>(ray, t_max, skip, stack, |position, hit, limit| {
            let closer = match best {
                None => hit.t < limit,
                Some((other, _)) => {
                    let before = || self.numbers[position as usize] < self.numbers[other as usize];
                    hit.t < limit || (hit.t == limit && before())
                }
            };
            let closer = closer && meets(position);
            if closer {
                best = Some((position, hit));
            }
            Some(if closer { hit.t } else { limit })
        });
        best
    }

    /// Some hit of a ray.
    #[inline(always)]
    pub(crate) fn any<L: Lanes>(
        &self,
        ray: &Ray,
        t_max: f32,
        skip: i32,
        visible: Visible,
        stack: &mut Stack,
    ) -> Option<(i32, Hit)> {
        let mut found = None;
        self.wide.traverse::<L>(ray, t_max, skip, stack, |position, hit, limit| {
            found = (hit.t < limit && visible.meets(position)).then_some((position, hit));
            found.is_none().then_some(limit)
        });
        found
    }

    /// [`Wide::crossing`]
    #[inline(always)]
    pub(crate) fn crossing<L: Lanes>(
        &self,
        disc: &Lifted,
        stack: &mut Stack,
        most: u32,
        visit: impl FnMut(i32, [f32; 3]),
    ) -> bool {
        self.wide.crossing::<L>(disc, stack, most, visit)
    }

    /// The closest hits of rays. The caller has checked them.
    pub fn trace(&self, rays: &Rays) -> Vec<Option<(i32, Hit)>> {
        self.hits(rays, false)
    }

    /// Whether rays hit anything. The caller has checked them.
    pub fn occluded(&self, rays: &Rays) -> Vec<bool> {
        self.hits(rays, true).iter().map(Option::is_some).collect()
    }

    fn hits(&self, rays: &Rays, any: bool) -> Vec<Option<(i32, Hit)>> {
        let join = |[x, y, z]: [f32; 3], w: f32| [x, y, z, w];
        let origins: Vec<_> = rays.origins.iter().zip(rays.skip).map(|(&o, &s)| join(o, s as f32)).collect();
        let directions: Vec<_> = rays.directions.iter().zip(rays.t_max).map(|(&d, &t)| join(d, t)).collect();
        let mut hits = vec![None; origins.len()];
        self.trace_records(&origins, &directions, any, Visible::TO_ALL, &mut hits, |hit| hit);
        hits
    }

    /// Trace rays laid out as the renderer's streams: origins and the position of a triangle that
    /// each passes through, or -1; directions and how far each goes. `any` stops at some hit.
    /// The caller has checked that `visible` has a triangle's bits for each.
    pub fn trace_records<T: Send>(
        &self,
        origins: &[[f32; 4]],
        directions: &[[f32; 4]],
        any: bool,
        visible: Visible,
        out: &mut [T],
        convert: impl Fn(Option<(i32, Hit)>) -> T + Sync,
    ) {
        out.par_chunks_mut(RAYS_A_TASK)
            .zip(origins.par_chunks(RAYS_A_TASK))
            .zip(directions.par_chunks(RAYS_A_TASK))
            .for_each(|((out, origins), directions)| {
                let mut hits = [None; RAYS_A_TASK];
                let found = &mut hits[..out.len()];
                trace_chunk(self, origins, directions, any, visible, found);
                for (out, hit) in out.iter_mut().zip(&*found) {
                    *out = convert(*hit);
                }
            });
    }
}

widest! {
    fn trace_chunk<L>(
        tree: &Tree,
        origins: &[[f32; 4]],
        directions: &[[f32; 4]],
        any: bool,
        visible: Visible,
        hits: &mut [Option<(i32, Hit)>],
    ) {
        let mut stack = Stack::new();
        for ((&[ox, oy, oz, skip], &[dx, dy, dz, t_max]), hit) in origins.iter().zip(directions).zip(hits) {
            *hit = None;
            let visible = visible.to_ray(t_max);
            // False for NaN.
            if t_max > 0.0
                && let Some(ray) = Ray::new([ox, oy, oz], [dx, dy, dz])
            {
                *hit = if any {
                    tree.any::<L>(&ray, t_max, skip as i32, visible, &mut stack)
                } else {
                    tree.closest::<L>(&ray, t_max, skip as i32, |at| visible.meets(at), &mut stack)
                };
            }
        }
    }
}

/// The reference and count of the child that begins at column `at` of a node; None if it is missing.
///
/// # Errors
/// They are out of range or not integers, or refer to an inner node that does not follow.
pub(crate) fn child_of(
    row: usize,
    at: usize,
    node: &[f32; NODE_FLOATS],
    node_count: usize,
    triangle_count: usize,
) -> Result<Option<(usize, usize)>, InvalidInput> {
    let (reference, count) = (node[at + 3], node[at + 7]);
    if (reference, count) == (-1.0, 0.0) {
        return Ok(None);
    }
    match read_child(reference, count, node_count, triangle_count) {
        Some((reference, count)) if count > 0 || reference > row => Ok(Some((reference, count))),
        _ => Err(bad_child(row, at, node)),
    }
}

fn read_child(
    reference: f32,
    count: f32,
    node_count: usize,
    triangle_count: usize,
) -> Option<(usize, usize)> {
    let integer = |x: f32| (x.fract() == 0.0 && x.abs() < 16_777_216.0).then_some(x as i64);
    let (reference, count) = (integer(reference)?, integer(count)?);
    let in_range = match count {
        0 => reference < node_count as i64,
        _ => count > 0 && reference + count <= triangle_count as i64,
    };
    (reference >= 0 && in_range).then_some((reference as usize, count as usize))
}

fn bad_child(row: usize, column: usize, node: &[f32; NODE_FLOATS]) -> InvalidInput {
    InvalidInput(format!(
        "nodes[{row}, {}] = {}, nodes[{row}, {}] = {} do not refer to triangles, nor to a later node that has no other parent and is at most \
         {MAX_DEPTH} levels deep",
        column + 3,
        node[column + 3],
        column + 7,
        node[column + 7]
    ))
}
