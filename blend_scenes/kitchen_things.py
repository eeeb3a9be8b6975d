# SPDX-License-Identifier: GPL-3.0-or-later
"""What stands about in the kitchen. Where a thing rests on another it sinks in a little."""

from __future__ import annotations

import math

import bpy
import numpy as np
import surfaces as s
from kitchen_parts import (
    BACK,
    BLUE,
    BREAD,
    CLAY,
    COUNTER_TOP,
    EARTH,
    OAK,
    PINE,
    TABLE_TURN,
    again,
    boxes,
    coloured,
    on_table,
    softened,
    tube,
    turned,
    unwrap,
)
from mathutils import Matrix, Vector
from scene_parts import block, mesh_object, sphere


def on_counter(m) -> None:
    """A pot, a board against the wall, spoons in a jar, plates."""
    z = COUNTER_TOP - 0.001
    at = (0.52, BACK - 0.27, z)
    body = [(0, 0), (0.110, 0), (0.119, 0.008), (0.12, 0.07), (0.12, 0.138), (0.127, 0.145)]
    turned("Pot", m.enamel, [*body, (0.115, 0.145), (0.114, 0.02), (0, 0.015)], at)
    lid = [(0.112, 0.144), (0.122, 0.146), (0.121, 0.152), (0.08, 0.170), (0.016, 0.177)]
    turned("Lid", m.enamel, [*lid, (0.011, 0.187), (0.024, 0.198), (0.018, 0.21), (0, 0.211)], at)

    def half_ring(t: float) -> tuple[float, float, float]:
        return 0, 0.045 * math.cos(math.pi * t), 0.035 * math.sin(math.pi * t) - 0.004

    for side in (-1, 1):
        bar = tube("Handle", m.enamel, half_ring, lambda t: 0.007)
        bar.location = at[0] + side * 0.118, at[1], z + 0.112
        bar.rotation_euler = 0, math.radians(side * 90), 0
    board = boxes(
        "Board", m.high, [((-0.13, -0.009, 0), (0.13, 0.009, 0.34))], colour=OAK, edge=0.006
    )
    board.location = 0.93, BACK - 0.085, z - 0.001
    board.rotation_euler = math.radians(-10), 0, 0
    at = (1.22, BACK - 0.20, z)
    jar = [(0, 0), (0.055, 0), (0.060, 0.006), (0.062, 0.06), (0.060, 0.12), (0.058, 0.126)]
    turned("Jar", m.glaze, [*jar, (0.054, 0.122), (0.054, 0.02), (0, 0.02)], at, BLUE)
    for i, turn in enumerate((20, 150, 265)):
        spoon(m, (*at[:2], z + 0.022), turn, 0.21 + 0.02 * i)
    rim = [(0, 0), (0.055, 0), (0.06, 0.004), (0.10, 0.011), (0.112, 0.016), (0.110, 0.0185)]
    at = (1.50, BACK - 0.24, z)
    plate = turned("Plate", m.glaze, [*rim, (0.07, 0.011), (0, 0.0065)], at, BLUE)
    for i in range(1, 6):
        again(plate, (at[0] + 0.003 * (i % 2), at[1], z + 0.0070 * i), 40.0 * i)


def spoon(m, at, turn: float, length: float) -> None:
    """A stick with a round end that leans in a jar, from the middle of its bottom."""
    a = math.radians(turn)
    aim = Vector((0.40 * math.cos(a), 0.40 * math.sin(a), 1)).normalized()
    stand = Matrix.Translation(at) @ aim.to_track_quat("Z", "Y").to_matrix().to_4x4()
    stick = tube("Spoon", m.clay, lambda t: (0, 0, length * t), lambda t: 0.006, 2, 6, PINE)
    end = softened(sphere("Spoon's end", m.clay, 0.026, (0, 0, 0), 1))
    stick.matrix_world = stand
    end.matrix_world = (
        stand @ Matrix.Translation((0, 0, length)) @ Matrix.Diagonal((1, 0.45, 1.3, 1))
    )
    coloured(end, PINE)


def book(m, ink, size, at, turn: float = 0.0, lying: bool = False) -> None:
    """Two boards and a back about its pages: upright with its back to the front, or lying."""
    thick, deep, high = (size[2], size[1], size[0]) if lying else size
    x, y, t = thick / 2, deep / 2, 0.0022
    covers = [
        ((-x, -y, 0), (-x + t, y, high)),
        ((x - t, -y, 0), (x, y, high)),
        ((-x, -y - t, 0), (x, -y + t, high)),
    ]
    pages = (-x + t / 2, -y + t / 2, 0.004), (x - t / 2, y - 0.004, high - 0.004)
    stand = Matrix.Translation(at) @ Matrix.Rotation(math.radians(turn), 4, "Z")
    if lying:
        stand @= Matrix.Translation((-high / 2, 0, x)) @ Matrix.Rotation(math.pi / 2, 4, "Y")
    for obj in (
        boxes("Book's cover", m.fabric, covers, colour=ink, edge=0.0007),
        block("Book's pages", m.paper, *pages),
    ):
        obj.matrix_world = stand


def cup(m, at, turn: float, band) -> list[bpy.types.Object]:
    outside = [(0, 0), (0.024, 0), (0.028, 0.004), (0.037, 0.03), (0.040, 0.075), (0.0385, 0.077)]
    inside = [(0.037, 0.073), (0.034, 0.03), (0.022, 0.009), (0, 0.007)]

    def ear(t: float) -> tuple[float, float, float]:
        out = math.sin(math.pi * t)
        return 0, 0.036 + 0.027 * out, 0.021 + 0.040 * t + 0.004 * out

    parts = [
        turned("Cup", m.glaze, [*outside, *inside], colour=band),
        tube("Cup's handle", m.glaze, ear, lambda t: 0.0052, colour=(0.62, 0.60, 0.54)),
    ]
    for part in parts:
        part.location, part.rotation_euler = at, (0, 0, math.radians(turn))
    return parts


def cloth(mat, low: float, high: float, deep: float, drop: float) -> None:
    """Across the table from x = low to high, hanging over both of its edges in folds."""
    bend, gap = 0.012, 0.0014
    flat, curve = deep - bend + gap, math.pi / 2 * bend
    whole, columns = flat + curve + drop, 24
    half = [*np.linspace(0, flat, 6), flat + curve / 2, *np.linspace(flat + curve, whole, 9)]
    rows = [-far for far in half[:0:-1]] + half
    corners, uv = [], []
    for along in rows:
        far = abs(along)
        angle = min(max(far - flat, 0) / bend, math.pi / 2)
        hang = max(far - flat - curve, 0)
        y = min(far, flat) + bend * math.sin(angle)
        z = gap - bend * (1 - math.cos(angle)) - hang
        for k in range(columns + 1):
            x = low + (high - low) * k / columns
            fold = 0.5 + 0.5 * math.sin(2 * math.pi * x / 0.12 + 1.3 * math.sin(9 * x) + along)
            out = s.smooth(hang / 0.08) * 0.022 * fold + 0.02 * hang
            corners.append((x, math.copysign(y + out, along), z))
            uv.append((x - low, along))
    wide = columns + 1
    faces = [
        (i * wide + k, i * wide + k + 1, (i + 1) * wide + k + 1, (i + 1) * wide + k)
        for i in range(len(rows) - 1) for k in range(columns)
    ]  # fmt: skip
    obj = softened(mesh_object("Cloth", [mat], corners, faces, smooth=True))
    unwrap(obj, uv)
    obj.location, obj.rotation_euler = on_table(0, 0), (0, 0, math.radians(TABLE_TURN))


def fruit(m) -> None:
    """Oranges, apples and a lemon in a bowl and beside it; each is a little in the next."""
    bowl = [(0, 0), (0.062, 0), (0.068, 0.007), (0.120, 0.034), (0.152, 0.075), (0.149, 0.078)]
    x, y, z = at = on_table(-0.17, 0.03, 0.001)
    turned("Bowl", m.glaze, [*bowl, (0.115, 0.041), (0.06, 0.014), (0, 0.011)], at, BLUE)
    r, sun = 0.040, (0.76, 0.25, 0.014)
    orange = coloured(sphere("Orange", m.peel, r, (x + 0.066, y - 0.020, z + 0.0655), 3), sun)
    for place in ((-0.008, 0.068, 0.0655), (0.004, 0.002, 0.110)):
        again(orange, [a + b for a, b in zip(at, place, strict=True)], 100)
    again(orange, on_table(0.20, -0.30, r - 0.0006), 45)
    skin = [
        (0, 0.012),
        (0.008, 0.005),
        (0.020, 0.0),
        (0.034, 0.014),
        (0.0395, 0.036),
        (0.034, 0.061),
    ]
    core = [(0.020, 0.0715), (0.008, 0.066), (0, 0.056)]
    apple = turned("Apple", m.apple, [*skin, *core])
    stalk = tube("Stalk", m.stalk, lambda t: (0, 0.004 * t * t, 0.056 + 0.024 * t),
                 lambda t: 0.0015 + 0.0006 * t, 3, 6)  # fmt: skip
    for i, (place, turn, lean) in enumerate((
        ((x - 0.072, y - 0.010, z + 0.024), 20, -14),
        ((x - 0.002, y - 0.071, z + 0.027), 130, 16),
        (on_table(-0.36, -0.315, -0.0008), 70, 0),
    )):  # fmt: skip
        for part in (apple, stalk):
            one = again(part, place) if i else part
            one.location, one.rotation_euler = place, (math.radians(lean), 0, math.radians(turn))
    tips = [(0, 0), (0.007, 0.001), (0.015, 0.010), (0.028, 0.028), (0.031, 0.045), (0.027, 0.064)]
    lemon = turned("Lemon", m.peel, [*tips, (0.015, 0.082), (0.007, 0.091), (0, 0.092)],
                   on_table(0.115, -0.232, 0.0290), (0.78, 0.60, 0.05))  # fmt: skip
    lemon.rotation_euler = math.radians(88), 0, math.radians(-62)


def tea_and_books(m) -> None:
    saucer = [(0, 0), (0.032, 0), (0.036, 0.003), (0.068, 0.012), (0.070, 0.0145), (0.04, 0.008)]
    turned("Saucer", m.glaze, [*saucer, (0, 0.006)], on_table(0.30, -0.17, -0.0005), BLUE)
    cup(m, on_table(0.30, -0.17, 0.0055), 205, BLUE)
    turned("Tea", s.plain("Tea", (0.10, 0.028, 0.006), 0.2), [(0.0375, 0.066), (0.02, 0.0661),
           (0, 0.0661)], on_table(0.30, -0.17, 0.0))  # fmt: skip
    z = -0.0008
    for high, deep, thick, turn, ink in (
        (0.235, 0.165, 0.030, 16.0, (0.09, 0.17, 0.16)),
        (0.215, 0.150, 0.024, -6.0, (0.42, 0.30, 0.12)),
        (0.185, 0.130, 0.032, 27.0, (0.33, 0.07, 0.06)),
    ):
        book(m, ink, (high, deep, thick), on_table(0.47, 0.17, z), TABLE_TURN + turn, lying=True)
        z += thick - 0.0004


def basket(m, at) -> None:
    """Coiled of straw, with loaves in it."""
    straw, rows = (0.52, 0.35, 0.15), 8
    coils = [
        (0.092 + 0.026 * i / rows / 2 + 0.005 * (i % 2), 0.004 + 0.0065 * i)
        for i in range(2 * rows + 1)
    ]
    inside = [(0.110, 0.106), (0.104, 0.06), (0.088, 0.014), (0, 0.010)]
    turned("Basket", m.straw, [(0, 0), (0.090, 0), *coils, *inside], at, straw, 12)

    def thick(t: float) -> float:
        return 0.033 * math.sqrt(max(1e-3, 1 - (2 * t - 1) ** 4))

    one = tube("Loaf", m.crust, lambda t: (0, 0, 0.30 * t), thick, 9, 10, BREAD)
    x, y, z = at
    leans = ((0.042, 0.022, -8, 14, 30), (-0.030, 0.036, 9, -5, 80), (-0.010, -0.046, 12, 4, 190))
    for i, (dx, dy, *angles) in enumerate(leans):
        part = again(one, at) if i else one
        part.location = x + dx, y + dy, z + 0.012
        part.rotation_euler = [math.radians(angle) for angle in angles]


def plant(m, at) -> None:
    """A pot of leaves, cut out of rectangles by their picture's alpha."""
    outside = [(0, -0.002), (0.105, -0.002), (0.112, 0.01), (0.145, 0.228), (0.160, 0.23)]
    inside = [(0.163, 0.275), (0.150, 0.276), (0.140, 0.24), (0, 0.24)]
    turned("Plant pot", m.clay, [*outside, *inside], (*at, 0), CLAY)
    turned("Earth", m.crust, [(0.150, 0.252), (0.08, 0.262), (0, 0.258)], (*at, 0), EARTH)
    corners, faces, uv, rng = [], [], [], np.random.default_rng(5)
    for i in range(46):
        share = i / 45
        lean = 0.20 + 0.9 * rng.random() * (1 - 0.5 * share)
        length, roll = 0.20 + 0.06 * rng.random(), rng.uniform(-0.4, 0.4)
        frond(corners, faces, uv, 2.39996 * i, 0.28 + 0.62 * share**0.8, lean, length, roll)
    leaves = mesh_object("Leaves", [m.leaf], corners, faces, smooth=True)
    unwrap(leaves, uv)
    leaves.location = (*at, 0)
    for i in range(5):
        stem = tube("Stem", m.stalk, lambda t: (0, 0.055 * t + 0.02 * t * t, 0.25 + 0.66 * t),
                    lambda t: 0.008 - 0.005 * t, 3, 6)  # fmt: skip
        stem.location, stem.rotation_euler = (*at, 0), (0, 0, 2 * math.pi * i / 5)


def frond(corners: list, faces: list, uv: list, azimuth, high, lean, length, roll) -> None:
    """Add a leaf: a strip of the picture that grows outwards and bends down."""
    first, steps = len(corners), 5
    outward = Vector((math.cos(azimuth), math.sin(azimuth), 0))
    side, up = Vector((-outward.y, outward.x, 0)), Vector((0, 0, 1))
    place = outward * 0.05 + up * high
    for i in range(steps + 1):
        pitch = math.pi / 2 - lean - 1.15 * i / steps
        if i:
            place = place + (outward * math.cos(pitch) + up * math.sin(pitch)) * length / steps
        face = up * math.cos(pitch) - outward * math.sin(pitch)
        across = (side * math.cos(roll) + face * math.sin(roll)) * 0.30 * length
        corners += [place - across, place + across]
        uv += [(0, i / steps), (1, i / steps)]
        if i < steps:
            a = first + 2 * i
            faces.append((a, a + 1, a + 3, a + 2))
