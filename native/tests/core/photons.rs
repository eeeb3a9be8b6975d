// SPDX-License-Identifier: GPL-3.0-or-later
//! The sort equals a naive stable sort.

use crate::common::*;
use photon_stream_native::photons::{Grid, sort};

fn naive(positions: &[f32], stride: usize, grid: &Grid) -> (Vec<u32>, Vec<u32>) {
    let cell = |p: &[f32]| {
        let i: [usize; 3] = std::array::from_fn(|k| {
            let i = ((p[k] - grid.origin[k]) / grid.cell_size).floor();
            i.clamp(0.0, grid.cells[k] as f32 - 1.0) as usize
        });
        (i[2] * grid.cells[1] + i[1]) * grid.cells[0] + i[0]
    };
    let cells: Vec<usize> = positions.chunks_exact(stride).map(cell).collect();
    let mut order: Vec<u32> = (0..cells.len() as u32).collect();
    order.sort_by_key(|&i| cells[i as usize]);
    let mut start = vec![0; grid.cells.iter().product::<usize>() + 1];
    for cell in cells {
        start[cell + 1] += 1;
    }
    for i in 1..start.len() {
        start[i] += start[i - 1];
    }
    (start, order)
}

#[test]
fn equals_a_naive_stable_sort() {
    let mut random = Random(1);
    for (count, stride, cells) in [
        (0, 3, [1, 1, 1]),
        (1, 4, [3, 2, 1]),
        (1000, 3, [1, 1, 1]),
        (5000, 4, [7, 5, 3]),
        (70_000, 3, [10, 10, 10]),
        (300_000, 4, [33, 65, 20]),
        (200_000, 3, [128, 100, 90]),
    ] {
        // The grid covers less than the photons, which are clamped to it.
        let grid = Grid { origin: [-0.9, -0.8, -0.7], cell_size: 1.7 / cells[0] as f32, cells };
        let positions: Vec<f32> = (0..count * stride).map(|_| 2.0 * random.unit() - 1.0).collect();
        assert!(sort(&positions, stride, &grid).unwrap() == naive(&positions, stride, &grid), "{cells:?}");
    }
}

#[test]
fn far_positions_are_clamped() {
    let grid = Grid { origin: [0.0; 3], cell_size: 1e-3, cells: [4, 4, 4] };
    let positions = [f32::MAX, -f32::MAX, f32::MAX, -0.0, -1e-9, 0.5];
    assert!(sort(&positions, 3, &grid).unwrap() == naive(&positions, 3, &grid));
}

#[test]
fn bad_input_is_refused() {
    let grid = Grid { origin: [0.0; 3], cell_size: 1.0, cells: [4, 4, 4] };
    let text = |positions: &[f32], grid: &Grid| sort(positions, 3, grid).unwrap_err().0;
    let mut positions = vec![0.5; 3 * 100_000];
    positions[3 * 99_999] = f32::NAN;
    assert_eq!(text(&positions, &grid), "positions[99999, 0] = NaN is not finite");
    positions[3 * 70_000 + 2] = f32::INFINITY;
    assert_eq!(text(&positions, &grid), "positions[70000, 2] = inf is not finite");
    assert!(text(&[], &Grid { cell_size: 0.0, ..grid }).contains("cell_size = 0"));
    assert!(text(&[], &Grid { cell_size: f32::NAN, ..grid }).contains("cell_size = NaN"));
    assert!(text(&[], &Grid { origin: [0.0, f32::NAN, 0.0], ..grid }).contains("origin[1] = NaN"));
    assert!(text(&[], &Grid { cells: [4, 0, 4], ..grid }).contains("cells[1] = 0"));
    assert!(text(&[], &Grid { cells: [512, 512, 513], ..grid }).contains("134217728"));
    assert!(text(&[], &Grid { cells: [usize::MAX, 2, 2], ..grid }).contains("cells"));
    assert!(text(&[0.0; 4], &grid).contains("rows"));
}

#[test]
fn the_same_on_any_number_of_threads() {
    let mut random = Random(2);
    let grid = Grid { origin: [0.0; 3], cell_size: 0.01, cells: [100, 100, 100] };
    let positions: Vec<f32> = (0..600_000).map(|_| random.unit()).collect();
    let reference = sort(&positions, 3, &grid).unwrap();
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert!(pool.install(|| sort(&positions, 3, &grid)).unwrap() == reference);
    }
}
