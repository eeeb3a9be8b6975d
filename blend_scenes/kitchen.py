# SPDX-License-Identifier: GPL-3.0-or-later
"""A kitchen in which things stand on, in and against each other; make_scenes.py makes it.

Sizes are in metres. A window to the left of the picture and a lamp over the table light it.
"""

from __future__ import annotations

from types import SimpleNamespace

import bpy
import surfaces as s
from kitchen_parts import (
    BACK,
    BLUE,
    BREAD,
    COUNTER_TOP,
    DARK,
    FRONT,
    GREEN,
    LEFT,
    OAK,
    PINE,
    RED,
    RIGHT,
    SHELF,
    TABLE,
    TABLE_TOP,
    TABLE_TURN,
    TOP,
    again,
    boxes,
    coloured,
    on_table,
    softened,
    tube,
    turned,
    unwrap,
)
from kitchen_things import basket, book, cloth, cup, fruit, on_counter, plant, tea_and_books
from scene_lights import lamp
from scene_parts import SUNK, block, camera, closed_room, mesh_object, sphere


def kitchen() -> None:
    """A laid table, a counter with a shelf above it, crates and a plant in the corner."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 640, 480
    m = materials()
    walls(m)
    counter(m)
    on_counter(m)
    shelf(m)
    table(m)
    cloth(m.gingham, -0.40, 0.10, 0.40, 0.20)
    fruit(m)
    tea_and_books(m)
    basket(m, on_table(-0.55, -0.02, -0.001))
    chair("Chair, left", m, (-0.62, 1.02, 0), 8.0)
    chair("Chair, right", m, (0.80, 0.42, 0), -72.0)
    corner(m)
    plant(m, (-1.50, 1.05))
    picture(m, -0.82, 1.50)
    lights(m)
    for obj in scene.objects:  # as Blender has it by default
        obj.cycles.shadow_terminator_geometry_offset = 0.1
    camera((0.72, -1.72, 1.47), (-0.17, 1.0, 0.86), lens=30)


def materials() -> SimpleNamespace:
    """Those that more than one thing wears, and the larger graphs."""
    cloudy = [(0.3, (0.84, 0.84, 0.84)), (0.7, (1, 1, 1))]
    baked = [(0.35, (0.30, 0.20, 0.12)), (0.55, (0.70, 0.60, 0.5)), (0.72, (1, 1, 1))]
    return SimpleNamespace(
        long=s.wood("Wood", "X"),
        high=s.wood("Upright wood", "Z"),
        plaster=s.dimpled("Plaster", 1.7, 38.0, 0.0035, cloudy, 0.9),
        clay=s.dimpled("Clay", 14.0, 60.0, 0.002, cloudy, 0.8),
        crust=s.dimpled("Crust", 28.0, 34.0, 0.008, baked, 0.65),
        straw=s.dimpled("Straw", 45.0, 110.0, 0.004, baked, 0.7),
        peel=s.dimpled("Peel", 20.0, 190.0, 0.0022, cloudy, 0.36),
        fabric=s.dimpled("Book cloth", 120.0, 160.0, 0.0008, cloudy, 0.7),
        apple=s.apple_skin("Apple skin"),
        gingham=s.gingham("Gingham", (0.86, 0.84, 0.80), (0.68, 0.26, 0.24), 25.0),
        glaze=s.glaze("Glaze", (0.62, 0.60, 0.54), 0.62, 0.88),
        enamel=s.plain("Enamel", RED, 0.5, **{"Coat Weight": 1.0, "Coat Roughness": 0.16}),
        paint=s.plain("White paint", (0.66, 0.64, 0.58), 0.45),
        sage=s.plain("Sage paint", (0.15, 0.17, 0.12), 0.42),
        iron=s.plain("Iron", (0.035, 0.035, 0.035), 0.45),
        paper=s.plain("Paper", (0.70, 0.65, 0.54), 0.9),
        leaf=s.printed("Leaf", s.leaf_picture(), 0.42, cut_out=True),
        stalk=s.plain("Stalk", (0.13, 0.13, 0.05), 0.6),
    )


def walls(m) -> None:
    terracotta = (0.47, 0.21, 0.12), (0.33, 0.14, 0.085), (0.30, 0.26, 0.22)
    floor = s.bricks("Terracotta", "XY", (0.30, 0.30), 0.0, 0.007, terracotta, 0.42)
    walls = [m.plaster] * 4
    room = closed_room((LEFT, FRONT, 0), (RIGHT, BACK, TOP), floor, m.plaster, walls)
    coloured(room, (0.74, 0.68, 0.57))
    white = (0.80, 0.80, 0.76), (0.70, 0.73, 0.70), (0.50, 0.48, 0.44)
    tiles = s.bricks("Tiles", "XZ", (0.16, 0.08), 0.5, 0.004, white, 0.22)
    block("Tiled wall", tiles, (0.02, BACK - 0.012, 0.85), (RIGHT + SUNK, BACK + SUNK, 1.43))
    boxes("Skirting", m.paint, [
        ((LEFT - SUNK, BACK - 0.018, -SUNK), (0.05, BACK + SUNK, 0.10)),
        ((LEFT - SUNK, FRONT - SUNK, -SUNK), (LEFT + 0.018, BACK - 0.017, 0.10)),
    ])  # fmt: skip


def counter(m) -> None:
    """Cupboards and drawers along the wall under a wooden top."""
    left, right, front = 0.08, RIGHT + SUNK, BACK - 0.56
    block("Plinth", m.iron, (left + 0.03, front + 0.06, -SUNK), (right, BACK + SUNK, 0.10))
    boxes("Cupboards", m.sage, [((left, front, 0.09), (right, BACK + SUNK, 0.87))])
    top = (left - 0.025, front - 0.035, 0.865), (right, BACK + SUNK, COUNTER_TOP)
    boxes("Counter top", m.long, [top], colour=OAK, edge=0.005)
    wide, doors, knob = (RIGHT - left) / 4, [], None
    for i in range(4):
        a, b = left + wide * i + 0.004, left + wide * (i + 1) - 0.004
        for low, high in ((0.12, 0.655), (0.665, 0.85)):
            doors.append(((a, front - 0.020, low), (b, front + 0.002, high)))
            doors.append(((a + 0.05, front - 0.026, low + 0.045),
                          (b - 0.05, front - 0.018, high - 0.045)))  # fmt: skip
            at = (a + b) / 2, front - 0.038, high - 0.022 if high < 0.7 else (low + high) / 2
            knob = again(knob, at) if knob else sphere("Knob", m.iron, 0.015, at, 3)
    boxes("Doors", m.sage, doors, edge=0.003)


def shelf(m) -> None:
    """Above the tiles: books, cups, bowls."""
    left, right = 0.28, RIGHT + SUNK
    board = (left, BACK - 0.21, SHELF), (right, BACK + SUNK, SHELF + 0.028)
    boxes("Shelf", m.long, [board], colour=OAK)
    irons = []
    for x in (0.48, 1.45):
        irons.append(((x, BACK - 0.18, SHELF - 0.018), (x + 0.03, BACK + SUNK, SHELF + 0.001)))
        irons.append(((x, BACK - 0.016, SHELF - 0.16), (x + 0.03, BACK + SUNK, SHELF)))
    boxes("Brackets", m.iron, irons)
    z, x = SHELF + 0.0265, 0.36
    for thick, high, ink in (
        (0.022, 0.20, (0.10, 0.16, 0.25)), (0.034, 0.185, (0.36, 0.10, 0.06)),
        (0.028, 0.215, (0.50, 0.42, 0.26)), (0.018, 0.19, (0.09, 0.20, 0.14)),
        (0.040, 0.205, (0.28, 0.17, 0.09)), (0.024, 0.18, (0.45, 0.33, 0.10)),
    ):  # fmt: skip
        book(m, ink, (thick, 0.14, high), (x + thick / 2, BACK - 0.082, z))
        x += thick + 0.0015
    parts = cup(m, (0.74, BACK - 0.11, z), 200, BLUE)
    for x, y, turn in ((0.86, 0.10, 250.0), (0.985, 0.12, 215.0)):
        for part in parts:
            again(part, (x, BACK - y, z), turn)
    outside = [(0, 0), (0.04, 0), (0.045, 0.006), (0.085, 0.045), (0.098, 0.08), (0.094, 0.081)]
    at = (1.20, BACK - 0.108, z)
    one = turned(
        "Small bowl", m.glaze, [*outside, (0.078, 0.045), (0.04, 0.014), (0, 0.011)], at, GREEN
    )
    again(one, (*at[:2], z + 0.022), 30)
    book(m, (0.28, 0.17, 0.09), (0.17, 0.14, 0.03), (1.60, BACK - 0.105, z), 7.0, lying=True)
    book(
        m,
        (0.10, 0.16, 0.25),
        (0.17, 0.14, 0.03),
        (1.60, BACK - 0.105, z + 0.0295),
        -8.0,
        lying=True,
    )


def table(m) -> None:
    """Five boards on a frame with four legs."""
    half, deep, at = 0.70, 0.40, (*TABLE, 0)
    wide, under = 2 * deep / 5, TABLE_TOP - 0.031
    for i in range(5):
        low, high = -deep + wide * i + 0.0008, -deep + wide * (i + 1) - 0.0008
        board = (-half, low, TABLE_TOP - 0.032), (half, high, TABLE_TOP)
        boxes("Table board", m.long, [board], at, TABLE_TURN, OAK, 0.002)
    aprons, (x, y) = [], (half - 0.09, deep - 0.075)
    for a in (-1, 1):
        aprons.append(((a * x - 0.011, -y, 0.63), (a * x + 0.011, y, under)))
        aprons.append(((-x, a * y - 0.011, 0.63), (x, a * y + 0.011, under)))
        for b in (-1, 1):
            low, high = (
                (a * x - 0.034, b * y - 0.034, -0.002),
                (a * x + 0.034, b * y + 0.034, under),
            )
            boxes("Table leg", m.high, [(low, high)], at, TABLE_TURN, OAK)
    boxes("Aprons", m.long, aprons, at, TABLE_TURN, OAK)


def chair(name: str, m, at, turn: float) -> None:
    """Of square timber; its back to +y."""
    half, seat = 0.20, 0.455
    upright, across = [], [
        ((-half + 0.03, -half + 0.008, 0.24), (half - 0.03, -half + 0.028, 0.265)),
        ((-half - 0.012, -half - 0.012, seat - 0.02), (half + 0.012, half - 0.034, seat)),
    ]  # fmt: skip
    for x in (-half + 0.02, half - 0.02):
        upright.append(((x - 0.018, -half, -0.002), (x + 0.018, -half + 0.036, seat - 0.019)))
        upright.append(((x - 0.018, half - 0.036, -0.002), (x + 0.018, half, 0.93)))
        across.append(((x - 0.010, -half + 0.03, 0.20), (x + 0.010, half - 0.03, 0.225)))
    for z in (0.60, 0.72, 0.84):
        across.append(((-half + 0.03, half - 0.026, z), (half - 0.03, half - 0.010, z + 0.06)))
    boxes(name, m.high, upright, at, turn, OAK)
    boxes(f"{name}: seat", m.long, across, at, turn, OAK)


def corner(m) -> None:
    """Crates on each other in the corner, and boxes of cardboard beside them."""
    x, y, z, thick, wide = 0.21, 0.15, 0.24, 0.011, 0.068
    slats = [((-x, -y, 0), (x, y, thick))]
    for a in (-1, 1):
        for b in (-1, 1):
            low, high = sorted((a * (x - 0.001), a * (x - 0.028)))
            near, far = sorted((b * (y - 0.001), b * (y - 0.028)))
            slats.append(((low, near, 0.003), (high, far, z)))
        for low in (0.006, 0.088, 0.170):
            near, far = sorted((a * y, a * (y + thick)))
            slats.append(((-x - thick, near, low), (x + thick, far, low + wide)))
            near, far = sorted((a * x, a * (x + thick)))
            slats.append(((near, -y, low), (far, y, low + wide)))
    crate = boxes("Crate", m.long, slats, (-1.42, BACK - 0.24, -0.001), 3, PINE, 0.002)
    again(crate, (-1.40, BACK - 0.25, 0.2375), -5)
    again(crate, (-1.44, BACK - 0.23, 0.476), 8)
    earthy = coloured(
        softened(sphere("Potato", m.crust, 0.046, (-1.40, BACK - 0.26, 0.53), 1)), BREAD
    )
    places = [(-0.11, 0.02, 0.53), (-0.20, -0.04, 0.53), (0.06, 0.06, 0.52)]
    places += [(-0.15, 0.09, 0.535), (-0.06, -0.07, 0.53), (-0.04, 0.02, 0.59)]
    for i, place in enumerate(places):
        other = again(earthy, (-1.36 + place[0], BACK - 0.24 + place[1], place[2]), 50.0 * i)
        other.scale = (1.25, 0.9, 0.85)
    for low, high, turn in ((-0.002, 0.25, -7), (0.249, 0.39, 14)):
        x, y = (0.17, 0.13) if turn < 0 else (0.11, 0.09)
        at = (-0.93, BACK - 0.19, 0)
        boxes("Box", m.fabric, [((-x, -y, low), (x, y, high))], at, turn, (0.44, 0.30, 0.17))


def picture(m, x: float, z: float) -> None:
    """A framed landscape on the wall."""
    wide, high, bar, y = 0.29, 0.22, 0.03, BACK - 0.028
    bars = [
        ((x - wide - bar, y, z - high - bar), (x + wide + bar, BACK + SUNK, z - high)),
        ((x - wide - bar, y, z + high), (x + wide + bar, BACK + SUNK, z + high + bar)),
        ((x - wide - bar, y, z - high - 0.001), (x - wide, BACK + SUNK, z + high + 0.001)),
        ((x + wide, y, z - high - 0.001), (x + wide + bar, BACK + SUNK, z + high + 0.001)),
    ]
    boxes("Frame", m.long, bars, colour=DARK)
    mount = (
        (x - wide - 0.002, BACK - 0.008, z - high - 0.002),
        (x + wide + 0.002, BACK + SUNK, z + high + 0.002),
    )
    block("Passe-partout", m.paper, *mount)
    a, b, y = wide - 0.05, high - 0.04, BACK - 0.0095
    corners = [(x - a, y, z - b), (x + a, y, z - b), (x + a, y, z + b), (x - a, y, z + b)]
    print_ = mesh_object("Print", [s.printed("Print", s.landscape(), 0.8)], corners, [(0, 1, 2, 3)])
    unwrap(print_, [(0, 0), (1, 0), (1, 1), (0, 1)])


def lights(m) -> None:
    """A window, out of sight, and a lamp over the table."""
    low, high, y0, y1 = 0.95, 2.15, -1.35, 0.35
    middle, inner = (y0 + y1) / 2, LEFT + 0.09
    bars = [
        ((LEFT - SUNK, a, c), (inner, b, d))
        for a, b, c, d in (
            (y0 - 0.07, y1 + 0.07, low - 0.07, low),
            (y0 - 0.07, y1 + 0.07, high, high + 0.07),
            (y0 - 0.07, y0, low - 0.001, high + 0.001),
            (y1, y1 + 0.07, low - 0.001, high + 0.001),
            (middle - 0.025, middle + 0.025, low - 0.001, high + 0.001),
        )
    ]
    boxes("Window frame", m.paint, bars)
    at = (LEFT + 0.02, middle, (low + high) / 2)
    lamp("AREA", "Window", at, (0, *at[1:]), energy=95, shape="RECTANGLE",
         size=high - low, size_y=y1 - y0, color=(0.88, 0.94, 1.0))  # fmt: skip
    x, y, z = *on_table(-0.02, 0.02)[:2], 1.80
    outside = [(0.190, 0.004), (0.202, 0.0), (0.198, 0.035), (0.125, 0.117), (0.055, 0.150)]
    shade = s.plain("Shade", (0.10, 0.13, 0.11), 0.35)
    turned("Shade", shade, [*outside, (0.045, 0.17), (0.045, 0.20), (0, 0.203)], (x, y, z))
    white = s.plain("Shade's inside", (0.78, 0.77, 0.72), 0.7)
    inside = [(0.196, 0.003), (0.185, 0.032), (0.112, 0.106), (0.04, 0.132), (0, 0.134)]
    turned("Shade's inside", white, inside, (x, y, z))
    cord = tube(
        "Cord", m.iron, lambda t: (0, 0, 0.19 + t * (TOP - z - 0.18)), lambda t: 0.004, 1, 6
    )
    cord.location = (x, y, z)
    # A disc in the shade's mouth: of a bulb in a white shade path tracers are noisy for hours.
    lamp("AREA", "Lamp", (x, y, z + 0.03), (x, y, 0), energy=14, shape="DISK", size=0.34,
         color=(1.0, 0.78, 0.52))  # fmt: skip
