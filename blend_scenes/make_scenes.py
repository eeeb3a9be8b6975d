# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the scenes beside this script, all or those named, or in the folder given with -o.

Run it with bpy 4.2, the oldest Blender that Photon Stream supports: what Blender 5 saves,
Blender 4.2 to 4.4 cannot open.

    python3.11 -m venv build/bpy42 && build/bpy42/bin/pip install bpy==4.2.23 "numpy<2"
    build/bpy42/bin/python blend_scenes/make_scenes.py [SCENE ...]

The three Cornell boxes are rooms of 10 x 10 x 10 units: x from -5 (left) to 5, y from -5 (open
front) to 5, z from 0 (floor) to 10. The others are closed rooms in metres, seen from within.
Objects stand SUNK deep in the floor, so that no two faces are coplanar. Every light is a delta
light, and what a camera sees, directly or in a flat mirror, is diffuse or a Phong lobe, unless a
docstring says otherwise, and but for the scenes of lit_scenes.py, glass_scenes.py and kitchen.py.
"""

from __future__ import annotations

import argparse
import atexit
import math
import sys
from pathlib import Path

import bpy
from glass_scenes import (
    frosted_glass,
    glass_bulb,
    glass_in_mirror,
    pool,
    ring,
    sunlit_window,
    wine_glass,
)
from kitchen import kitchen
from lit_scenes import daylight, studio
from mathutils import Vector
from scene_lights import point_light, spotlight
from scene_parts import (
    SUNK,
    PhotonStreamStub,
    block,
    box,
    camera,
    closed_room,
    empty_scene,
    lathe,
    material,
    mesh_object,
    room,
    sheet,
    sphere,
    use_phong,
    wall_with_doorway,
)


def cornell_box() -> None:
    """The test scene of Marino & Abbate: k_d 0.2, k_s 0.1 as a broad lobe, spot in the ceiling."""
    camera()
    use_phong()
    exponent = 10.0  # of the Phong lobe: n = 2 / a^2 - 2 with a = roughness^2
    roughness = (2 / (exponent + 2)) ** 0.25
    grey = material("Grey", (0.2,) * 3, (0.1,) * 3, roughness)
    room(grey, grey, grey)
    box("Box", grey, (2.8, 2.8, 5.0), (-1.9, 1.7), 18)
    sphere("Sphere", grey, 1.6, (2.1, -0.6, 1.6 - SUNK), 4)
    spotlight(4500, (0, -1.5, 9.9), (0, -1.5, 0), cone=150, blend=0.5)


def cornell_classic() -> None:
    """Coloured walls, two boxes, diffuse only."""
    camera()
    white, red, green = wall_paints()
    room(white, red, green)
    box("Tall box", white, (3.0, 3.0, 6.0), (-1.8, 1.6), 18)
    box("Short box", white, (3.0, 3.0, 3.0), (1.9, -1.5), -17)
    spotlight(1800, (0, -1.5, 9.9), (0, -1.5, 0), cone=140, blend=0.5)


def cornell_mirror() -> None:
    """A mirror sphere that hangs in the room, above the spot's cone.

    No light falls on the mirror directly: such a caustic of a point-like light is what Cycles
    cannot find, and the two renderers' pictures would not be comparable.
    """
    camera()
    white, red, green = wall_paints()
    mirror = material("Mirror", glossy=(0.9, 0.9, 0.9))
    room(white, red, green)
    box("Box", white, (3.0, 3.0, 4.0), (1.5, 1.0), -17)
    ball = sphere("Mirror sphere", mirror, 1.7, (-2.6, 2.0, 7.1), 5)
    lamp = spotlight(2400, (1.8, -1.5, 9.9), (1.8, -1.5, 0), cone=92, blend=0.5)
    bpy.context.view_layer.update()
    to_ball = ball.location - lamp.location
    axis = lamp.matrix_world.to_quaternion() @ Vector((0, 0, -1))
    nearest = axis.angle(to_ball) - math.asin(1.7 / to_ball.length)
    assert nearest > lamp.data.spot_size / 2 + math.radians(1), "the spot lights the mirror"


def wall_paints() -> tuple[bpy.types.Material, bpy.types.Material, bpy.types.Material]:
    return (
        material("White", (0.7, 0.7, 0.7)),
        material("Red", (0.63, 0.065, 0.05)),
        material("Green", (0.14, 0.45, 0.09)),
    )


def mirror_caustic() -> None:
    """A bowl on a column, its rippled water a mirror: the caustic falls on wall and ceiling.

    The water lies above the camera, which sees what it reflects, but not the water.
    """
    plaster = material("Plaster", (0.72, 0.70, 0.66))
    ochre = material("Ochre", (0.62, 0.36, 0.13))
    teal = material("Teal", (0.10, 0.30, 0.32))
    wood = material("Wood", (0.38, 0.22, 0.12))
    stone = material("Stone", (0.55, 0.53, 0.50))
    closed_room((-2, 0, 0), (2, 4.6, 3.2), wood, plaster, (teal, ochre, plaster, plaster))
    column = [(0, 0), (0.34, 0), (0.34, 0.10), (0.20, 0.20), (0.155, 0.45), (0.14, 1.15)]
    bowl = [(0.22, 1.25), (0.50, 1.36), (0.66, 1.56), (0.66, 1.60), (0.61, 1.60), (0.58, 1.50)]
    lathe("Fountain", stone, [*column, *bowl, (0, 1.40)], (-0.35, 2.6, -SUNK))
    waves = [
        (16.0, 3.0, 0.3),
        (13.0, 10.0, 1.9),
        (19.0, -8.0, 4.0),
        (4.0, 9.0, 2.6),
        (9.0, -5.0, 0),
    ]

    def ripple(x: float, y: float) -> float:
        return sum(7e-4 * math.sin(a * x + b * y + c) for a, b, c in waves)

    water = material("Water", glossy=(0.9, 0.9, 0.9))
    sheet("Water", water, 0.60, ripple, (-0.35, 2.6, 1.55))
    block("Bench", wood, (-0.75, -0.2, -SUNK), (0.75, 0.2, 0.42), (0.95, 3.9, 0))
    block("Chest", teal, (-0.3, -0.25, -SUNK), (0.3, 0.25, 0.55), (1.35, 2.3, 0), 24)
    ball = sphere("Ball", ochre, 0.22, (-1.45, 3.7, 0.22 - SUNK), 4)
    ball.data.name = "Ball"
    spotlight(1000, (-1.5, 0.4, 3.0), (0.1, 2.9, 1.2), cone=64, blend=0.6)
    camera((0.55, 0.12, 1.35), (-0.05, 4.0, 1.52), lens=25)


def caustic_in_mirror() -> None:
    """A polished dish on a high shelf throws a caustic behind the camera: a mirror shows it."""
    plaster = material("Plaster", (0.70, 0.69, 0.66))
    blue = material("Blue", (0.14, 0.22, 0.42))
    rose = material("Rose", (0.60, 0.28, 0.24))
    wood = material("Wood", (0.40, 0.24, 0.13))
    frame = material("Frame", (0.16, 0.11, 0.07))
    steel = material("Steel", glossy=(0.85, 0.85, 0.85))
    glass = material("Looking glass", glossy=(0.92, 0.92, 0.92))
    closed_room((-2, 0, 0), (2, 4, 3.1), wood, plaster, (blue, rose, plaster, plaster))

    # The looking glass on the far wall, in a frame of four bars.
    low, high, near = (-1.15, 0.75), (1.15, 2.45), 3.95
    mesh_object(
        "Looking glass",
        [glass],
        [(low[0], near, low[1]), (high[0], near, low[1]), (high[0], near, high[1]),
         (low[0], near, high[1])],
        [(0, 1, 2, 3)],
    )  # fmt: skip
    bar = 0.09
    for name, a, b in (
        ("Bar left", (low[0] - bar, low[1] - bar), (low[0], high[1] + bar)),
        ("Bar right", (high[0], low[1] - bar), (high[0] + bar, high[1] + bar)),
        ("Bar below", (low[0], low[1] - bar), (high[0], low[1])),
        ("Bar above", (low[0], high[1]), (high[0], high[1] + bar)),
    ):
        block(name, frame, (a[0], near - 0.04, a[1]), (b[0], 4 + SUNK, b[1]))

    dish = (1.15, 2.3, 1.32)
    block("Cabinet", wood, (-0.42, -0.36, -SUNK), (0.42, 0.36, 1.32), (*dish[:2], 0), -14)
    bowl = [(0, 0), (0.18, 0), (0.20, 0.03), (0.38, 0.12), (0.38, 0.14), (0.36, 0.14), (0, 0.03)]
    lathe("Dish", frame, bowl, (*dish[:2], dish[2] - 0.005))

    def hollow(x: float, y: float) -> float:
        return 0.05 * x * x + 0.10 * y * y + 0.09 * x * (x * x - 3 * y * y) + 0.04 * x * y

    sheet("Polish", steel, 0.365, hollow, (*dish[:2], dish[2] + 0.10))
    block("Table", frame, (-0.55, -0.32, 0.66), (0.55, 0.32, 0.71), (-1.25, 2.9, 0), 12)
    block("Leg", frame, (-0.06, -0.06, -SUNK), (0.06, 0.06, 0.67), (-1.25, 2.9, 0), 12)
    sphere("Globe", rose, 0.17, (-1.4, 2.95, 0.71 + 0.17 - 0.003), 4)
    block("Book", blue, (-0.16, -0.11, 0.71 - 0.002), (0.16, 0.11, 0.77), (-1.02, 2.85, 0), 28)
    spotlight(900, (1.55, 3.8, 2.15), (0.95, 2.3, 1.25), cone=80, blend=0.5)
    camera((-0.35, 0.3, 1.28), (0.0, 4.0, 1.45), lens=26)


def door_ajar() -> None:
    """A spotlit room next door: its light reaches this one through a door's gap alone."""
    wall = material("Wall", (0.72, 0.70, 0.65))
    floor = material("Floor", (0.42, 0.27, 0.15))
    paint = material("Door paint", (0.62, 0.63, 0.60))
    blue = material("Blue", (0.16, 0.26, 0.46))
    red = material("Red", (0.55, 0.12, 0.09))
    dark = material("Dark", (0.13, 0.09, 0.07))
    near, far, left, right, top = 3.9, 4.02, -0.75, 0.15, 2.05  # the partition and its doorway
    grid = {"x": (-2, left, right, 2), "z": (0, top, 2.7)}
    closed_room((-2, 0, 0), (2, near, 2.7), floor, wall, (wall, blue, wall, None))
    wall_with_doorway("Partition", wall, near, **grid)
    closed_room((-2, far, 0), (2, 6.6, 2.7), floor, wall, (wall, wall, None, wall), "Next room")
    wall_with_doorway("Next room's partition", wall, far, **grid)
    closed_room(
        (left, near, 0), (right, far, top), floor, paint, (paint, paint, None, None), "Doorway"
    )
    leaf = right - left - 0.006
    block("Door", paint, (0, -0.04, 0.006), (leaf, 0, top - 0.006), (left + 0.003, near, 0), -13)
    sphere(
        "Knob", dark, 0.035, (left + 0.93 * leaf * 0.974, near - 0.93 * leaf * 0.225 - 0.075, 1), 3
    )

    block("Table top", dark, (-0.5, -0.35, 0.42), (0.5, 0.35, 0.46), (0.95, 2.55, 0), -14)
    for x in (-0.44, 0.44):
        block("Side", dark, (x - 0.03, -0.30, -SUNK), (x + 0.03, 0.30, 0.43), (0.95, 2.55, 0), -14)
    sphere("Orange", red, 0.11, (0.75, 2.6, 0.46 + 0.11 - 0.002), 4)
    vase = [(0, 0), (0.07, 0), (0.11, 0.10), (0.09, 0.22), (0.04, 0.30), (0.055, 0.36), (0, 0.33)]
    lathe("Vase", blue, vase, (1.2, 2.45, 0.46 - 0.002))
    block("Seat", red, (-0.4, -0.4, -SUNK), (0.4, 0.4, 0.40), (-1.35, 2.3, 0), 20)
    block("Back", red, (-0.4, 0.3, 0.1), (0.4, 0.44, 0.95), (-1.35, 2.3, 0), 20)
    block("Frame", dark, (0.65, near - 0.03, 1.15), (1.55, near + SUNK, 1.85))
    block("Picture", blue, (0.71, near - 0.035, 1.21), (1.49, near, 1.79))
    spotlight(16000, (0.9, 5.4, 2.55), (-1.3, 6.3, 1.0), cone=70, blend=0.5)
    camera((0.55, 0.15, 1.45), (-0.12, 4.0, 1.08), lens=25)


def many_lights() -> None:
    """A gallery under twenty-four small spotlights and sixteen bulbs on two cords."""
    wall = material("Wall", (0.66, 0.65, 0.62))
    floor = material("Floor", (0.30, 0.22, 0.16))
    stone = material("Stone", (0.60, 0.58, 0.55))
    dark = material("Dark", (0.10, 0.09, 0.09))
    paints = [
        material(f"Paint {i}", colour)
        for i, colour in enumerate(
            [(0.60, 0.15, 0.10), (0.16, 0.33, 0.52), (0.62, 0.45, 0.12), (0.18, 0.42, 0.20),
             (0.42, 0.18, 0.42), (0.12, 0.45, 0.45)]
        )
    ]  # fmt: skip
    closed_room((-3, 0, 0), (3, 7, 3.2), floor, wall, (wall, wall, wall, wall))
    for side in (-1, 1):
        for i in range(3):
            y = 2.0 + 1.9 * i
            paint = paints[(i + 3 * (side > 0)) % 6]
            low, high = sorted((side * 3.01, side * 2.95))
            block("Picture", paint, (low, y - 0.6, 1.1), (high, y + 0.6, 2.1))
            for step in (-0.35, 0.35):
                spotlight(34, (side * 2.1, y + step, 3.1), (side * 3, y + 0.5 * step, 1.5), 46, 0.6,
                          (1.0, 0.86, 0.68))  # fmt: skip
    for i in range(2):
        x = -1.25 + 2.5 * i
        block("Picture", paints[4 - i], (x - 0.7, 6.95, 1.0), (x + 0.7, 7.01, 2.2))
        for step in (-0.4, 0.4):
            spotlight(40, (x + step, 6.0, 3.1), (x + 0.5 * step, 7, 1.5), 50, 0.6, (1, 0.86, 0.68))
    urn = [(0, 0), (0.10, 0), (0.17, 0.16), (0.15, 0.30), (0.07, 0.38), (0.10, 0.44), (0, 0.41)]
    for i, (x, y) in enumerate([(-1.3, 2.6), (1.35, 3.0), (-0.9, 4.8), (1.0, 5.3)]):
        block("Plinth", stone, (-0.22, -0.22, -SUNK), (0.22, 0.22, 0.85), (x, y, 0), 15 * i + 8)
        if i % 2:
            sphere("Ball", paints[i], 0.2, (x, y, 0.85 + 0.2 - 0.003), 3)
        else:
            lathe("Urn", paints[i + 2], urn, (x, y, 0.85 - 0.003), 32)
        for step in (-0.5, 0.5):
            spotlight(45, (x + step, y - 0.6, 3.1), (x, y, 0.9), 30, 0.5, (0.85, 0.92, 1.0))
    block("Bench", dark, (-0.8, -0.22, -SUNK), (0.8, 0.22, 0.42), (0.1, 3.7, 0), 4)
    for row in range(2):
        for i in range(8):
            t = i / 7
            sag = 0.35 * (4 * t * (t - 1))
            point_light(3.5, (-2.6 + 5.2 * t, 3.3 + 2.2 * row, 2.95 + sag), (1.0, 0.62, 0.30))
    camera((0.3, 0.2, 1.6), (0.0, 5.0, 1.35), lens=25)


def glossy_room() -> None:
    """A closed room whose every surface is a broad Phong lobe, lit by one spotlight."""

    def glossy(name: str, diffuse, lobe, exponent: float):
        return material(name, diffuse, lobe, (2 / (exponent + 2)) ** 0.25)

    use_phong()
    wall = glossy("Lacquer", (0.30, 0.29, 0.27), (0.25, 0.25, 0.25), 12)
    green = glossy("Green lacquer", (0.07, 0.26, 0.14), (0.22, 0.24, 0.22), 18)
    floor = glossy("Parquet", (0.22, 0.12, 0.06), (0.34, 0.32, 0.30), 40)
    brass = glossy("Brass", (0.10, 0.07, 0.02), (0.66, 0.50, 0.24), 60)
    black = glossy("Black lacquer", (0.03, 0.03, 0.03), (0.35, 0.35, 0.35), 30)
    red = glossy("Red lacquer", (0.42, 0.05, 0.04), (0.25, 0.20, 0.20), 25)
    closed_room((-2, 0, 0), (2, 4.5, 2.8), floor, wall, (green, wall, wall, wall))
    for i in range(4):
        low, high = (0.6, 3.0 + 0.35 * i, -SUNK), (2 + SUNK, 4.5 + SUNK, 0.22 * (i + 1))
        block("Step", wall, low, high)
    sphere("Brass ball", brass, 0.45, (-0.95, 3.0, 0.45 - SUNK), 4)
    block("Chest", red, (-0.45, -0.3, -SUNK), (0.45, 0.3, 0.6), (0.35, 2.2, 0), 28)
    vase = [(0, 0), (0.12, 0), (0.20, 0.20), (0.17, 0.42), (0.07, 0.60), (0.11, 0.72), (0, 0.66)]
    lathe("Vase", brass, vase, (0.3, 2.2, 0.6 - 0.003))
    block("Screen", black, (-0.03, -0.6, -SUNK), (0.03, 0.6, 1.7), (-1.45, 2.0, 0), -25)
    spotlight(800, (0.3, 1.6, 2.7), (-0.1, 3.0, 0), cone=120, blend=0.6)
    camera((0.1, 0.15, 1.45), (-0.05, 4.0, 1.0), lens=24)


SCENES = (
    cornell_box,
    cornell_classic,
    cornell_mirror,
    mirror_caustic,
    caustic_in_mirror,
    door_ajar,
    many_lights,
    glossy_room,
    studio,
    daylight,
    kitchen,
    wine_glass,
    pool,
    ring,
    glass_in_mirror,
    sunlit_window,
    glass_bulb,
    frosted_glass,
)


def main() -> None:
    here = Path(__file__).resolve().parent
    parser = argparse.ArgumentParser(description="Make the scenes.")
    parser.add_argument("scene", nargs="*", help="default: all")
    parser.add_argument("-o", "--output", type=Path, default=here, metavar="FOLDER")
    arguments = parser.parse_args()
    folder = arguments.output
    if bpy.app.version >= (4, 3) and folder.resolve() == here:
        sys.exit(f"This is bpy {bpy.app.version_string}; save with 4.2 (see the top of this file).")
    folder.mkdir(parents=True, exist_ok=True)
    bpy.utils.register_class(PhotonStreamStub)
    atexit.register(bpy.utils.unregister_class, PhotonStreamStub)  # else bpy crashes at exit
    for make in SCENES:
        if arguments.scene and make.__name__ not in arguments.scene:
            continue
        empty_scene()
        make()
        path = folder / f"{make.__name__}.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path.resolve()), compress=True)


if __name__ == "__main__":
    main()
