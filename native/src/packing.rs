// SPDX-License-Identifier: GPL-3.0-or-later
//! Unit vectors in one float, as glsl/lib/packing.glsl has them.

/// A unit vector in one float (glsl/lib/packing.glsl).
pub(crate) fn pack_direction(n: [f32; 3]) -> f32 {
    let length = n[0].abs() + n[1].abs() + n[2].abs();
    let [x, y, z] = n.map(|x| x / length);
    let [x, y] = if z >= 0.0 { [x, y] } else { folded([x, y]) };
    let [x, y] = [x, y].map(|e| ((e * 0.5 + 0.5) * 4095.0 + 0.5).floor());
    x * 4096.0 + y
}

/// A flux that carries a packed direction in the last bits of its channels.
pub(crate) fn flux_with_direction(flux: [f32; 3], direction: [f32; 3]) -> [f32; 3] {
    let code = pack_direction(direction) as u32;
    std::array::from_fn(|k| {
        let last = code >> (16 - 8 * k) & 0xff;
        f32::from_bits(flux[k].max(1.0e-30).to_bits() & !0xff | last)
    })
}

/// The direction of [`flux_with_direction`].
pub(crate) fn direction_with_flux(flux: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = flux.map(|channel| channel.to_bits() & 0xff);
    unpack_direction((x << 16 | y << 8 | z) as f32)
}

/// The other half of the octahedron.
fn folded(e: [f32; 2]) -> [f32; 2] {
    let sign = |v: f32| if v >= 0.0 { 1.0 } else { -1.0 };
    [(1.0 - e[1].abs()) * sign(e[0]), (1.0 - e[0].abs()) * sign(e[1])]
}

/// The unit vector of [`pack_direction`].
pub(crate) fn unpack_direction(code: f32) -> [f32; 3] {
    let whole = code as u32; // as codes are; and floor is a function call on the oldest processors
    let e = [whole >> 12, whole & 4095].map(|q| q as f32 / 4095.0 * 2.0 - 1.0);
    let z = 1.0 - e[0].abs() - e[1].abs();
    let [x, y] = if z < 0.0 { folded(e) } else { e };
    let length = (x * x + y * y + z * z).sqrt();
    [x / length, y / length, z / length]
}

/// The same, but rounded once, at the end: which portals are found can hang on the last bits.
#[cfg(feature = "python")]
pub(crate) fn unpack_direction_exactly(code: f32) -> [f32; 3] {
    let whole = code as u32;
    let [x, y] = [whole >> 12, whole & 4095].map(|q| f64::from(q) / 4095.0 * 2.0 - 1.0);
    let z = 1.0 - x.abs() - y.abs();
    let sign = |v: f64| if v >= 0.0 { 1.0 } else { -1.0 };
    let [x, y] = if z < 0.0 { [(1.0 - y.abs()) * sign(x), (1.0 - x.abs()) * sign(y)] } else { [x, y] };
    let length = (x * x + y * y + z * z).sqrt();
    [x, y, z].map(|v| (v / length) as f32)
}
