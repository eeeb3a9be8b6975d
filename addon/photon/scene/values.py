# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene as the renderer sees it: plain frozen data, no Blender.

World space, lengths in metres, linear RGB.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from .camera import Camera
from .checks import BLACK, check_finite
from .displacement import Displacement
from .images import Image, Texture
from .lights import FOUND_BY, LIT, MOST_LINKED_SETS, Light, point_light, spot_light, world_light
from .materials import Lobe, Material, phong
from .media import NO_MEDIUM, Medium
from .moving import ARRAYS, Moving, check_moving
from .programs import Program, read_program, read_varying
from .visibility import ALL_RAYS, CATCHER, CAUSTICS, HOLDOUT

SNAPSHOT_VERSION = 7
TERMINATOR = 0.1  # of Scene.terminators, as Blender has it of new objects ("Geometry Offset")


def _empty(shape: tuple[int, ...], dtype: Any) -> Any:
    return field(default_factory=lambda: np.zeros(shape, dtype))


@dataclass(frozen=True)
class Scene:
    """Triangles, materials, lights and one camera.

    Triangles may hold NaN, be degenerate, or there may be none: the renderer skips and counts
    them. `surface` tells apart surfaces that must not exchange photons (one number an object).
    """

    camera: Camera
    lights: tuple[Light, ...] = ()
    materials: tuple[Material, ...] = ()
    vertices: NDArray[np.float64] = _empty((0, 3), np.float64)  # (V, 3) [m]
    triangles: NDArray[np.int32] = _empty((0, 3), np.int32)  # (T, 3) indices into vertices
    # (T, 3, 3), interpolated as they are; a triangle's longest is unit.
    corner_normals: NDArray[np.float32] = _empty((0, 3, 3), np.float32)
    # (T, 3, 3) of any length and sign, interpolated as they are; zero: none is needed. Anisotropic
    # lobes turn with them. (0, 3, 3): nothing is anisotropic.
    corner_tangents: NDArray[np.float32] = _empty((0, 3, 3), np.float32)
    material: NDArray[np.int32] = _empty((0,), np.int32)  # (T,) index into materials
    surface: NDArray[np.int32] = _empty((0,), np.int32)  # (T,) index into surfaces
    surfaces: tuple[str, ...] = ()  # object names
    images: tuple[Image, ...] = ()
    textures: tuple[Texture, ...] = ()  # of programs
    # (S,) bits of visibility.py. (0,): all rays meet all surfaces.
    visible: NDArray[np.uint8] = _empty((0,), np.uint8)
    # (S,) cosines to a light below which shadow rays begin on the smooth surface that the triangles
    # stand for, and not on these; 0: nowhere. (0,): TERMINATOR.
    terminators: NDArray[np.float32] = _empty((0,), np.float32)
    # (T, A, 3, 4) that programs ask for, interpolated, such as UV maps. (T, 0, 3, 4): none do.
    corner_attributes: NDArray[np.float32] = _empty((0, 0, 3, 4), np.float32)
    # (T,) of triangles that are not smooth; (0,): all may be. It matters to what is displaced.
    flat: NDArray[np.bool_] = _empty((0,), np.bool_)
    # (S,) which set of surfaces that lights tell apart each is in, and bits of the sets that what
    # it emits does not light. (0,): 0.
    linked: NDArray[np.uint8] = _empty((0,), np.uint8)
    excludes: NDArray[np.uint16] = _empty((0,), np.uint16)
    # (S, 2) how long sides of triangles of displaced surfaces may be: [px], and [m]; 0: as they
    # are. (0, 2): that is everywhere.
    dicing: NDArray[np.float32] = _empty((0, 2), np.float32)
    # (S, 6, 4): the transform from world space to the object's, three rows; its colour; its place
    # in world space and random number; its index, and zeros. (0, 6, 4): no program asks.
    objects: NDArray[np.float64] = _empty((0, 6, 4), np.float64)
    moving: tuple[Moving, ...] = ()  # what does not stand still where it is
    # How open the shutter is meanwhile, at even instants; (): all the time the same.
    shutter: tuple[float, ...] = ()
    air: Medium = NO_MEDIUM  # everywhere, also where others are
    caustics: tuple[str, ...] = CAUSTICS  # by which lobes' light they fall on diffuse surfaces
    light_groups: tuple[str, ...] = ()  # whose light is told apart
    surface_groups: tuple[
        str, ...
    ] = ()  # (S,) of these, or "", to which what it emits belongs; (): ""

    @property
    def media(self) -> tuple[Medium, ...]:
        """That which is everywhere, and those of materials."""
        return (self.air, *(material.medium for material in self.materials))

    @property
    def programs(self) -> Iterator[tuple[str, Program]]:
        """All, each with whose it is."""
        yield "scene.air", self.air.program
        for material in self.materials:
            yield from ((f"material {material.name!r}", x) for x in material.programs)

    @property
    def emitters(self) -> tuple[Light, ...]:
        """The lights that have any power."""
        return tuple(light for light in self.lights if max(light.power) > 0.0)

    def check(self) -> None:
        """Raise SceneError if arrays do not fit together or a value is outside its range."""
        self._check_arrays()
        self._check_indices()
        if not ((self.terminators >= 0.0) & (self.terminators <= 1.0)).all():
            raise SceneError("scene.terminators: a cosine is outside [0, 1]")
        if (self.visible & ~np.uint8(ALL_RAYS | HOLDOUT | CATCHER)).any():
            raise SceneError(f"scene.visible: {int(self.visible.max())} has bits of no ray")
        if (self.linked >= MOST_LINKED_SETS).any() or (self.excludes >> MOST_LINKED_SETS).any():
            raise SceneError(f"scene.linked: there are more than {MOST_LINKED_SETS} sets")
        if set(self.caustics) - set(CAUSTICS):
            raise SceneError(f"scene.caustics: {self.caustics} are not of {', '.join(CAUSTICS)}")
        if len(self.surface_groups) not in (0, len(self.surfaces)):
            count = len(self.surface_groups)
            raise SceneError(f"scene.surface_groups: {count} of {len(self.surfaces)} surfaces")
        self.camera.check()
        for image in self.images:
            image.check()
        for texture in self.textures:
            texture.check()
        for light in self.lights:
            light.check()
            for number in light.images:
                if number not in range(len(self.images)):
                    raise SceneError(
                        f"light {light.name!r}: image {number} is none of {len(self.images)}"
                    )
        for material in self.materials:
            material.check()
        self.air.check("scene.air")
        if self.air.glows:
            raise SceneError("scene.air: what is everywhere emits nothing")
        check_moving(self.moving, len(self.vertices), self.triangles)
        check_finite("scene.shutter", self.shutter, 0.0)
        if self.moving and self.camera.motion and self.camera.motion.shutter != self.shutter:
            raise SceneError("scene.shutter is not the camera's")

    def _check_arrays(self) -> None:
        """Their shapes and types."""
        count = len(self.triangles)
        tangents = count if len(self.corner_tangents) else 0
        visible = len(self.surfaces) if len(self.visible) else 0
        terminators = len(self.surfaces) if len(self.terminators) else 0
        attributes = self.corner_attributes.shape[1:2]
        flat = count if len(self.flat) else 0
        dicing = len(self.surfaces) if len(self.dicing) else 0
        objects = len(self.surfaces) if len(self.objects) else 0
        for name, shape, dtype in (
            ("vertices", (len(self.vertices), 3), np.float64),
            ("triangles", (count, 3), np.int32),
            ("corner_normals", (count, 3, 3), np.float32),
            ("corner_tangents", (tangents, 3, 3), np.float32),
            ("material", (count,), np.int32),
            ("surface", (count,), np.int32),
            ("visible", (visible,), np.uint8),
            ("linked", (len(self.surfaces) if len(self.linked) else 0,), np.uint8),
            ("excludes", (len(self.surfaces) if len(self.excludes) else 0,), np.uint16),
            ("terminators", (terminators,), np.float32),
            ("corner_attributes", (count if any(attributes) else 0, *attributes, 3, 4), np.float32),
            ("flat", (flat,), np.bool_),
            ("dicing", (dicing, 2), np.float32),
            ("objects", (objects, 6, 4), np.float64),
        ):
            array = getattr(self, name)
            if array.shape != shape or array.dtype != dtype:
                raise SceneError(
                    f"scene.{name}: expected {np.dtype(dtype).name}{list(shape)}, "
                    f"got {array.dtype.name}{list(array.shape)}"
                )

    def _check_indices(self) -> None:
        for name, limit in (
            ("triangles", len(self.vertices)),
            ("material", len(self.materials)),
            ("surface", len(self.surfaces)),
        ):
            array = getattr(self, name)
            bad = (array < 0) | (array >= limit)
            if bad.any():
                where = tuple(int(i) for i in np.argwhere(bad)[0])
                raise SceneError(
                    f"scene.{name}{list(where)} = {int(array[where])} is outside [0, {limit})"
                )

    def save(self, path: str | Path) -> None:
        """Write the snapshot as an .npz file (arrays, and one JSON text for the rest); SceneError
        if a medium has a grid, in place of its program."""
        if any(medium.grid for medium in self.media):
            raise SceneError(f"{path}: media that were asked on grids cannot be saved")
        header = {
            "version": SNAPSHOT_VERSION,
            "camera": _plain(self.camera),
            "lights": [_plain(light) for light in self.lights],
            "materials": [_plain(material) for material in self.materials],
            "surfaces": list(self.surfaces),
            "images": [image.name for image in self.images],
            "textures": [[x.name, x.is_srgb, x.tile] for x in self.textures],
            "moving": [one.header() for one in self.moving],
            "shutter": list(self.shutter),
            "air": _plain(self.air),
            "caustics": list(self.caustics),
            "light_groups": list(self.light_groups),
            "surface_groups": list(self.surface_groups),
        }
        arrays = {name: getattr(self, name) for name in (*_ARRAYS, *_LATER)}
        arrays |= {f"image{number}": image.pixels for number, image in enumerate(self.images)}
        arrays |= {f"texture{number}": x.pixels for number, x in enumerate(self.textures)}
        for number, one in enumerate(self.moving):
            arrays |= {f"moving{number}_{name}": getattr(one, name) for name in ARRAYS}
        with open(path, "wb") as file:
            np.savez(file, header=np.array(json.dumps(header)), **arrays)

    @staticmethod
    def load(path: str | Path) -> Scene:
        """Read a snapshot; raise SceneError naming the file if it is not one."""
        try:
            with open(path, "rb") as file, np.load(file, allow_pickle=False) as data:
                scene = _read(data)
                scene.check()
        except FileNotFoundError:
            raise SceneError(f"{path}: no such file") from None
        except SceneError as error:
            raise SceneError(f"{path}: {error}") from error
        except Exception as error:  # numpy, zipfile and json raise a dozen kinds for damaged files
            raise SceneError(f"{path}: not a Photon Stream scene snapshot ({error})") from error
        return scene


def _read(data: Any) -> Scene:
    """A Scene from the arrays of a snapshot; raises whatever a malformed one leads to."""
    header = json.loads(str(data["header"]))
    version = header["version"]
    if version not in _READERS:
        raise SceneError(
            f"snapshot version {version}, this Photon Stream reads {', '.join(map(str, _READERS))}"
        )
    read_light, read_material = _READERS[version]
    lights = tuple(read_light(_tuples(light)) for light in header["lights"])
    background = tuple(header.get("background", BLACK))  # before version 3
    if any(background):
        lights += (world_light("World", background),)
    return Scene(
        camera=Camera.read(header["camera"]),
        lights=lights,
        materials=tuple(read_material(_tuples(m)) for m in header["materials"]),
        surfaces=tuple(header["surfaces"]),
        images=tuple(
            Image(name, data[f"image{number}"])
            for number, name in enumerate(header.get("images", ()))
        ),
        textures=tuple(
            Texture(name, data[f"texture{number}"], bool(is_srgb), int(tile))
            for number, (name, is_srgb, tile) in enumerate(header.get("textures", ()))
        ),
        moving=tuple(
            Moving.read(one, {name: data[f"moving{number}_{name}"] for name in ARRAYS})
            for number, one in enumerate(header.get("moving", ()))
        ),
        shutter=tuple(header.get("shutter", ())),
        air=Medium.read(header["air"]) if "air" in header else NO_MEDIUM,
        caustics=tuple(header.get("caustics", CAUSTICS)),
        light_groups=tuple(header.get("light_groups", ())),
        surface_groups=tuple(header.get("surface_groups", ())),
        **{name: data[name] for name in (*_ARRAYS, *(name for name in _LATER if name in data))},
    )


def _read_material(values: dict[str, Any]) -> Material:
    lobes = tuple(map(_read_lobe, values["lobes"]))
    program = read_program(values.get("program", ()))  # before version 5 there are none
    varying = read_varying(values.get("varying", {}))
    own = {"lobes": lobes, "program": program, "varying": varying}
    displacement = Displacement.read(values.get("displacement"))
    # At first media absorbed light alone.
    medium = Medium(tuple(values.pop("absorption", BLACK)))
    medium = Medium.read(values["medium"]) if "medium" in values else medium
    return Material(**values | own | {"displacement": displacement, "medium": medium})


def _read_lobe(values: dict[str, Any]) -> Lobe:
    own = {"parameters": _tuples(values["parameters"])}
    return Lobe(**_tuples(values) | own | {"varying": read_varying(values.get("varying", {}))})


def _read_light(values: dict[str, Any]) -> Light:
    profile = tuple(map(tuple, values["profile"]))
    return Light(**values | {"parameters": _tuples(values["parameters"]), "profile": profile})


def _read_light_6(values: dict[str, Any]) -> Light:
    """Before media were told from surfaces that reflect."""
    return _found_by_media(_read_light(values))


def _found_by_media(light: Light) -> Light:
    found = set(light.found_by)
    return light if found.isdisjoint(("diffuse", "glossy")) else _found_by(light, "media")


def _read_light_5(values: dict[str, Any]) -> Light:
    """Before what lets through was told from what reflects."""
    return _found_by_both(_read_light(values))


def _found_by_both(light: Light) -> Light:
    passing = {"diffuse": "translucent", "glossy": "transmission", "chains": "passing"}
    more = (passing[who] for who in light.found_by if who in passing)
    return _found_by_media(_found_by(light, *more))


def _found_by(light: Light, *more: str) -> Light:
    return replace(light, found_by=tuple(x for x in FOUND_BY if x in {*light.found_by, *more}))


def _read_light_3(values: dict[str, Any]) -> Light:
    """Before spheres might be soft, and cones stretched."""
    new = {"point": {"soft": 0.0}, "spot": {"soft": 0.0, "stretch_x": 1.0, "stretch_y": 1.0}}
    parameters = _tuples(values["parameters"]) | new.get(values["kind"], {})
    return _found_by_both(Light(**values | {"parameters": parameters}))


def _read_light_1(values: dict[str, Any]) -> Light:
    """What Photon Stream 0.1 wrote: two kinds, all fields of both; lights were not seen."""
    name, position, power, radius = (values[x] for x in ("name", "position", "power", "radius"))
    light = point_light(name, position, power, radius)
    if values["kind"] != "POINT":
        size, blend = values["spot_size"], values["spot_blend"]
        light = spot_light(
            name, position, power, values["direction"], size=size, blend=blend, radius=radius
        )
    return replace(light, found_by=LIT)


def _read_material_1(values: dict[str, Any]) -> Material:
    """What Photon Stream 0.1 wrote: one specular lobe, or the zeros of one."""
    lobe = phong(values["specular"], values["exponent"])
    return Material(values["name"], values["diffuse"], (lobe,) if lobe.reflects else ())


# By the version of a snapshot.
_READERS: dict[int, tuple[Callable[..., Light], Callable[..., Material]]] = {
    1: (_read_light_1, _read_material_1),
    2: (_read_light_3, _read_material),
    3: (_read_light_3, _read_material),
    4: (_read_light_5, _read_material),
    5: (_read_light_5, _read_material),
    6: (_read_light_6, _read_material),
    7: (_read_light, _read_material),
}


_ARRAYS = ("vertices", "triangles", "corner_normals", "material", "surface")
_LATER = (
    "corner_tangents",
    "visible",
    "linked",
    "excludes",
    "terminators",
    "corner_attributes",
    "flat",
    "dicing",
    "objects",
)  # which older files don't have


def _plain(value: Any) -> Any:
    """A value, and the fields of a record, as JSON; its own Infinity is what Python reads back."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    if is_dataclass(value):
        return {name: _plain(item) for name, item in vars(value).items()}
    if isinstance(value, Mapping):
        return {name: _plain(item) for name, item in value.items()}
    return value


def _tuples(values: dict[str, Any]) -> dict[str, Any]:
    return {name: tuple(v) if isinstance(v, list) else v for name, v in values.items()}
