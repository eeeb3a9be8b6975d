# SPDX-License-Identifier: GPL-3.0-or-later
"""Small scenes in plain numpy, for tests that need no Blender."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from addon.photon.scene import (
    BLACK,
    MIRROR,
    Camera,
    Light,
    Material,
    Scene,
    phong,
    point_light,
    spot_light,
    world_light,
)
from addon.photon.stage.geometry import Mesh
from addon.photon.stage.upload import texels_of


def plain_material(
    name: str,
    diffuse: Any = (0.8, 0.8, 0.8),
    specular: Any = (0.0, 0.0, 0.0),
    exponent: float = MIRROR,
) -> Material:
    """The paper's: k_d, and k_s of a mirror or of a Phong lobe."""
    return Material(name, diffuse, (phong(specular, exponent),) if any(specular) else ())


def plain_light(
    name: str,
    kind: str,
    position: Any,
    power: Any,
    direction: Any = (0.0, 0.0, -1.0),
    radius: float = 0.0,
    spot_size: float = math.pi / 4,
    spot_blend: float = 0.15,
) -> Light:
    """A point light, or a spotlight as Blender's by default."""
    if kind == "POINT":
        return point_light(name, position, power, radius)
    return spot_light(
        name, position, power, direction, size=spot_size, blend=spot_blend, radius=radius
    )


def backdrop(radiance: Any) -> tuple[Light, ...]:
    """A world that is seen and lights nothing; none if it is black."""
    found_by = ("camera", "chains", "passing")
    return (world_light("backdrop", radiance, found_by),) if any(radiance) else ()


def with_cone(light: Light, size: float) -> Light:
    """A spotlight of another width [rad]."""
    old = light.parameters
    blend = 1.0 - old["inner"] / old["outer"]
    return plain_light(
        light.name, "SPOT", light.position, light.power, light.direction, old["radius"], size, blend
    )


def emitted_flux(light: Light) -> NDArray[np.float64]:
    """Flux per channel [W] that a plain light emits (not P: the cone cuts it off)."""
    outer, inner = (light.parameters.get(name, 2.0) for name in ("outer", "inner"))
    return np.asarray(light.power, np.float64) * (outer + inner) / 4.0


def corners_of(mesh: Mesh) -> NDArray[np.float32]:
    """(T, 3, 4) of its triangles, in tree order; the fourth are their other numbers."""
    return texels_of(mesh.triangles).reshape(-1, 3, 4)


GREY = plain_material("grey", (0.5, 0.5, 0.5))
DIM = plain_material(
    "dim", (1e-3,) * 3
)  # hardly reflects: what falls on it at first is all there is
UNIT_INTENSITY = 4 * math.pi  # [W]: I = 1 W/sr


def camera(
    eye: Sequence[float],
    target: Sequence[float],
    fov: float = 60.0,
    aspect: float = 1.0,
    **kwargs: Any,
) -> Camera:
    """A perspective camera; `fov` [deg] is the whole vertical angle."""
    back = np.subtract(eye, target).astype(float)
    back /= np.linalg.norm(back)
    up = (0.0, 0.0, 1.0) if abs(back[2]) < 0.99 else (0.0, 1.0, 0.0)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2] = right, np.cross(back, right), back
    matrix[:3, 3] = eye
    half = np.tan(np.radians(fov) / 2)
    return Camera("PERSP", matrix, (-half * aspect, half * aspect, -half, half), **kwargs)


@dataclass
class Builder:
    """Collects triangle meshes into a Scene."""

    vertices: list[Any] = field(default_factory=list)
    triangles: list[Any] = field(default_factory=list)
    normals: list[Any] = field(default_factory=list)
    material: list[Any] = field(default_factory=list)
    surface: list[Any] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    count: int = 0

    def add(
        self, vertices: Any, triangles: Any, material: int = 0, name: str = "", normals: Any = None
    ) -> Builder:
        """Add one object; `normals` (V, 3) makes it smooth."""
        vertices, triangles = np.asarray(vertices, float), np.asarray(triangles, np.int32)
        self.vertices.append(vertices)
        self.triangles.append(triangles + self.count)
        self.count += len(vertices)
        corners = vertices[triangles]
        if normals is None:
            flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            with np.errstate(invalid="ignore"):
                flat /= np.linalg.norm(flat, axis=1, keepdims=True)
            self.normals.append(np.repeat(flat[:, None], 3, axis=1))
        else:
            self.normals.append(np.asarray(normals)[triangles])
        self.material.append(np.full(len(triangles), material))
        self.surface.append(np.full(len(triangles), len(self.names)))
        self.names.append(name or f"object{len(self.names)}")
        return self

    def quad(self, a: Any, b: Any, c: Any, d: Any, material: int = 0, name: str = "") -> Builder:
        return self.add([a, b, c, d], [[0, 1, 2], [0, 2, 3]], material, name)

    def box(
        self, low: Any, high: Any, material: int = 0, name: str = "", skip: str = ""
    ) -> Builder:
        """An axis-aligned box with outward normals; `skip` leaves out faces, e.g. "-y"."""
        (x0, y0, z0), (x1, y1, z1) = low, high
        faces = {
            "-x": [(x0, y0, z0), (x0, y0, z1), (x0, y1, z1), (x0, y1, z0)],
            "+x": [(x1, y0, z0), (x1, y1, z0), (x1, y1, z1), (x1, y0, z1)],
            "-y": [(x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1)],
            "+y": [(x0, y1, z0), (x0, y1, z1), (x1, y1, z1), (x1, y1, z0)],
            "-z": [(x0, y0, z0), (x0, y1, z0), (x1, y1, z0), (x1, y0, z0)],
            "+z": [(x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)],
        }
        kept = [corners for side, corners in faces.items() if side not in skip.split()]
        vertices = np.array(kept).reshape(-1, 3)
        quads = np.arange(len(vertices)).reshape(-1, 4)
        return self.add(
            vertices, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]), material, name
        )

    def sphere(
        self,
        centre: Any,
        radius: float,
        material: int = 0,
        name: str = "",
        subdivisions: int = 4,
        smooth: bool = True,
    ) -> Builder:
        vertices, triangles = icosphere(subdivisions)
        return self.add(
            vertices * radius + centre, triangles, material, name, vertices if smooth else None
        )

    def scene(
        self,
        view: Camera,
        lights: Sequence[Light] = (),
        materials: Sequence[Material] = (GREY,),
        background: Any = BLACK,
        **kwargs: Any,
    ) -> Scene:
        """The collected triangles as a Scene, before a world that is seen and lights nothing."""

        def joined(parts: list[Any], shape: tuple[int, ...], dtype: Any) -> Any:
            return np.concatenate(parts).astype(dtype) if parts else np.zeros(shape, dtype)

        return Scene(
            camera=view,
            lights=(*lights, *backdrop(background)),
            materials=tuple(materials),
            vertices=joined(self.vertices, (0, 3), np.float64),
            triangles=joined(self.triangles, (0, 3), np.int32),
            corner_normals=joined(self.normals, (0, 3, 3), np.float32),
            material=joined(self.material, (0,), np.int32),
            surface=joined(self.surface, (0,), np.int32),
            surfaces=tuple(self.names),
            **kwargs,
        )


def icosphere(subdivisions: int) -> tuple[Any, Any]:
    """Unit vertices (V, 3) and outward triangles (20 * 4^n, 3)."""
    g = (1 + 5**0.5) / 2
    vertices = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g)]
    vertices += [(0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    points = np.array(vertices) / np.linalg.norm(vertices[0])
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4)]
    faces += [(11, 10, 2), (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8)]
    faces += [(3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    triangles = np.array(faces)
    for _ in range(subdivisions):
        edges = np.sort(
            np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]),
            axis=1,
        )
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        middle = points[unique].sum(axis=1)
        middle /= np.linalg.norm(middle, axis=1, keepdims=True)
        ab, bc, ca = inverse.reshape(3, -1) + len(points)
        a, b, c = triangles.T
        triangles = np.concatenate(
            [np.stack(t, 1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        )
        points = np.concatenate([points, middle])
    return points, triangles


def closed_sphere(diffuse: float, specular: float = 0.0) -> Scene:
    """A closed unit sphere with a point light of I = 1 W/sr at its centre, seen from inside."""
    material = plain_material("wall", (diffuse,) * 3, (specular,) * 3)
    light = plain_light("light", "POINT", (0, 0, 0), (UNIT_INTENSITY,) * 3)
    view = camera((0, 0.6, 0), (0.3, -1, 0.2), 80)
    return Builder().sphere((0, 0, 0), 1.0, subdivisions=5).scene(view, [light], [material])


def orthographic(centre: Any, right: Any, up: Any, size: float) -> Camera:
    """Looks against right x up at a square window `size` wide."""
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = (
        right,
        up,
        np.cross(right, up),
        centre,
    )
    return Camera("ORTHO", matrix, (-size / 2, size / 2, -size / 2, size / 2))


def lit_plate() -> tuple[Scene, float]:
    """A plate [-1, 1]^2 at z = 0 under uniform irradiance, and that irradiance [W/m^2]."""
    distance, half_angle = 2000.0, math.atan(1.6 / 2000.0)
    power = 4 * math.pi * distance**2  # E = I / d^2 = 1
    light = plain_light(
        "far", "SPOT", (0, 0, distance), (power,) * 3, spot_size=2 * half_angle, spot_blend=0.0
    )
    view = orthographic((0, 0, 1), (1, 0, 0), (0, 1, 0), 2.0)
    plate = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0))
    return plate.scene(view, [light], [plain_material("white", (0.5,) * 3)]), 1.0


def cornell(mirror: bool = False, lobe: bool = False, bulb: bool = False) -> Scene:
    """A small Cornell box: coloured walls, a box and a sphere, one spotlight; perhaps a bulb, seen
    and much brighter than what it lights."""
    white = plain_material("white", (0.7, 0.7, 0.7))
    if lobe:
        white = plain_material("white", (0.2, 0.2, 0.2), (0.1, 0.1, 0.1), 10.0)
    red, green = plain_material("red", (0.6, 0.1, 0.1)), plain_material("green", (0.1, 0.6, 0.1))
    chrome = plain_material("chrome", (0.0, 0.0, 0.0), (0.9, 0.9, 0.9))
    b = Builder()
    room = [
        (0, 0, 0),
        (10, 0, 0),
        (10, 10, 0),
        (0, 10, 0),
        (0, 0, 10),
        (10, 0, 10),
        (10, 10, 10),
        (0, 10, 10),
    ]
    p = [np.array(v, float) for v in room]
    b.quad(p[0], p[1], p[2], p[3], 0, "floor").quad(p[4], p[7], p[6], p[5], 0, "ceiling")
    b.quad(p[2], p[6], p[7], p[3], 0, "back").quad(p[0], p[3], p[7], p[4], 1, "left").quad(
        p[1], p[5], p[6], p[2], 2, "right"
    )
    b.box((1.5, 5.5, -0.01), (4.5, 8.0, 5.5), 0, "box")
    b.sphere((7.0, 4.0, 1.7), 1.7, 3 if mirror else 0, "sphere")
    light = plain_light(
        "spot", "SPOT", (5, 5, 9.9), (3000, 3000, 3000), spot_size=2.0944, spot_blend=0.5
    )
    lights = [light, point_light("bulb", (3, 3, 7), (2000,) * 3, 0.7)][: 1 + bulb]
    return b.scene(camera((5, -13, 5), (5, 0, 5), 42), lights, [white, red, green, chrome])


def hills(quads: int) -> Scene:
    """A rough ground of `quads` by `quads` smooth quads, and a wall, under a spotlight."""
    x, y = np.meshgrid(*[np.linspace(-2, 2, quads + 1)] * 2)
    rough = np.random.default_rng(quads).random(x.shape) / quads
    ground = np.stack([x, y, 0.15 * np.sin(5 * x) * np.cos(4 * y) + rough], -1).reshape(-1, 3)
    at = np.arange(len(ground)).reshape(x.shape)
    a, b, c, d = (at[i : i - 1 or None, j : j - 1 or None].ravel() for i, j in _CORNERS)
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    up = np.zeros_like(ground)
    up[:, 2] = 1.0
    wall = [(-2, 2, -1), (2, 2, -1), (2, 2, 3), (-2, 2, 3)]
    light = plain_light("spot", "SPOT", (0, 0, 4), (500, 500, 500), spot_size=1.2)
    built = Builder().add(ground, triangles, 0, "ground", up).quad(*wall, name="wall")
    return built.scene(camera((0, -5, 3), (0, 0, 0)), [light])


_CORNERS = ((0, 0), (0, 1), (1, 1), (1, 0))


def random_room(seed: int) -> Scene:
    """A room of 8 x 8 x 6 with three to six boxes and spheres and one to three lights, by chance.

    Half of the rooms are open to the sky or to one side; of the things in them some are mirrors and
    some wear a Phong lobe.
    """
    rng = np.random.default_rng(seed)

    def colour(low: float, high: float) -> tuple[float, ...]:
        return tuple(rng.uniform(low, high, 3).round(3).tolist())

    walls = [plain_material(f"wall{i}", colour(0.1, 0.8)) for i in range(3)]
    things = []
    for i in range(int(rng.integers(3, 7))):
        kind = rng.choice(["diffuse", "mirror", "lobe"], p=[0.6, 0.2, 0.2])
        diffuse = colour(0.1, 0.8)
        if kind == "mirror":
            things.append(plain_material(f"mirror{i}", (0.0, 0.0, 0.0), colour(0.6, 0.9)))
        elif kind == "lobe":
            half = tuple(0.5 * x for x in diffuse)
            things.append(
                plain_material(f"lobe{i}", half, colour(0.1, 0.4), float(rng.uniform(3, 60)))
            )
        else:
            things.append(plain_material(f"diffuse{i}", diffuse))
    built = Builder()
    side = rng.choice(["", "+z", "+x", "+y"], p=[0.5, 0.2, 0.15, 0.15])
    room = [f for f in ("-z", "+z", "-x", "+x", "+y") if f != side]  # the camera looks in from -y
    faces = ("-x", "+x", "-y", "+y", "-z", "+z")
    for face in room:
        others = " ".join(f for f in faces if f != face)
        material = {"-x": 1, "+x": 2}.get(face, 0)
        built.box((-4, -4, 0), (4, 4, 6), material, f"wall {face}", skip=others)
    for i, thing in enumerate(things):
        at, size = rng.uniform((-3, -2.5), (3, 3)), rng.uniform(0.4, 1.3)
        if rng.random() < 0.5:
            height = rng.uniform(0.5, 3.0)
            low, high = (*(at - size), 0.0), (*(at + size), height)
            built.box(low, high, 3 + i, f"box {thing.name}", skip="-z")
        else:
            centre = (*at, rng.uniform(size, 5.9 - size))
            built.sphere(centre, size, 3 + i, f"ball {thing.name}", subdivisions=3)
    lights = []
    for i in range(int(rng.integers(1, 4))):
        power = tuple(float(x) for x in rng.uniform(200, 1000) * rng.uniform(0.7, 1.0, 3))
        position = (*rng.uniform((-3.5, -3.5), (3.5, 3.5)), rng.uniform(4.5, 5.9))
        if rng.random() < 0.6:
            to = np.array((*rng.uniform((-3, -3), (3, 3)), 0.0)) - position
            direction = tuple(to / np.linalg.norm(to))
            size, blend = rng.uniform(0.6, 2.4), rng.uniform(0.0, 1.0)
            lights.append(
                plain_light(
                    f"spot{i}", "SPOT", position, power, direction, spot_size=size, spot_blend=blend
                )
            )
        else:
            lights.append(plain_light(f"point{i}", "POINT", position, power))
    background = colour(0.0, 0.3) if side else BLACK
    view = camera((rng.uniform(-2, 2), -10.5, rng.uniform(2, 4)), (0, 0, 2.8), 44)
    return built.scene(view, lights, [*walls, *things], background=background)


__all__ = [
    "DIM",
    "GREY",
    "UNIT_INTENSITY",
    "Builder",
    "camera",
    "closed_sphere",
    "cornell",
    "corners_of",
    "emitted_flux",
    "hills",
    "icosphere",
    "lit_plate",
    "orthographic",
    "plain_light",
    "plain_material",
    "random_room",
    "replace",
    "with_cone",
]
