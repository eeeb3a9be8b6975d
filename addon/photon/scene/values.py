# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene as the renderer sees it: plain frozen data, no Blender.

World space, lengths in metres, linear RGB.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from .camera import Camera
from .checks import BLACK, RGB, check_finite
from .images import Image, Texture
from .lights import Light, point_light, spot_light, world_light
from .moving import ARRAYS, Moving, check_moving
from .programs import Program, Varying, check_program, read_program, read_varying
from .visibility import ALL_RAYS, CATCHER, CAUSTICS, HOLDOUT

SNAPSHOT_VERSION = 5
MIRROR = np.inf  # Phong exponent of a perfect mirror
GLASS = ("glass", "ggx_glass", "dispersive_glass", "ggx_dispersive_glass")
# Kinds of lobes whose colour is their reflectance head-on: black ones reflect at grazing angles.
COATS = ("coat", "bent_coat")  # whose colour is their tint
FRESNEL_LOBES = (*COATS, "ggx_dielectric", "ggx_metal", *GLASS)
TRANSPARENT = "transparent"  # light goes straight on
# Kinds that gather no photons, however rough they are.
SEND_RAYS = ("mirror", *GLASS, "bent_coat", "translucent", TRANSPARENT)
TERMINATOR = 0.1  # of Scene.terminators, as Blender has it of new objects ("Geometry Offset")
ALPHAS = ("alpha", "alpha_x", "alpha_y")  # parameters of microfacets


def _empty(shape: tuple[int, ...], dtype: Any) -> Any:
    return field(default_factory=lambda: np.zeros(shape, dtype))


@dataclass(frozen=True)
class Lobe:
    """A lobe of one of the kinds of glsl/bsdf, whose files say what colour and parameters are."""

    kind: str
    colour: RGB
    parameters: Mapping[str, float | RGB] = field(default_factory=dict)
    weight: float = 1.0  # times all that it reflects
    # The albedo of what it lies over, which has what the lobe lets through.
    covered: RGB = BLACK
    # Its colour, weight, covered or parameters that the material's program gives in place of those.
    varying: Varying = field(default_factory=dict)
    over: int | None = None  # the material's lobe that lies over this one, before it in their order

    def check(self, who: str) -> None:
        """Raise SceneError naming the lobe's owner and the first value out of its range."""
        check_finite(f"{who}: colour", self.colour, 0.0)
        check_finite(f"{who}: covered", self.covered, 0.0)
        check_finite(f"{who}: weight", self.weight, 0.0)
        for name, value in self.parameters.items():
            check_finite(f"{who}: {name}", value, 0.0)

    @property
    def reflects(self) -> bool:
        """Whether it does, or has what it covers do."""
        own = self.may_be("colour") or self.kind in FRESNEL_LOBES
        return (self.may_be("weight") and own) or self.may_be("covered")

    def may_be(self, name: str) -> bool:
        """Whether its colour, weight or covered may be more than 0 anywhere."""
        return name in self.varying or bool(np.max(getattr(self, name)) > 0.0)

    @property
    def roughness(self) -> tuple[float, float]:
        """Of microfacets as broad as the lobe, where it is sharpest, as glsl/bsdf has it; 0 of a
        kind that gathers no photons, and 1 where parameters do not tell. The least and the most
        that it may be anywhere."""
        if self.kind in SEND_RAYS:
            return 0.0, 0.0
        given: Mapping[str, Any] = self.parameters
        alphas = [given[name] for name in ALPHAS if name in given]
        if self.varying.keys() & {"exponent", "roughness", *ALPHAS}:
            return 0.0, 1.0
        if "exponent" in given:
            found = float((2.0 / (given["exponent"] + 2.0)) ** 0.25)
        elif "roughness" in given:
            found = float(given["roughness"])
        else:
            found = math.sqrt(min(alphas, default=1.0))
        return found, found

    @property
    def is_anisotropic(self) -> bool:
        """Whether it is rougher along its tangent than across, or the other way round."""
        given = {**self.parameters, **self.varying}
        return given.get("alpha_x") != given.get("alpha_y")

    def reflected_head_on(self) -> NDArray[np.float64]:
        """What it reflects itself to a viewer straight above, but for its weight; about that."""
        if self.kind in COATS:
            given: Mapping[str, Any] = self.parameters
            f0 = ((given["ior"] - 1.0) / (given["ior"] + 1.0)) ** 2
            return np.full(3, min(given["cover"], 1.0) * f0)
        if self.kind == "sheen":  # next to nothing
            return np.zeros(3)
        return np.array(self.colour, np.float64)


def reflecting(lobes: tuple[Lobe, ...]) -> tuple[Lobe, ...]:
    """Those that do, in their order. What others would lie over lies under what is over these."""
    kept: list[Lobe] = []
    places: list[int | None] = []  # of each lobe, or of what lies over it
    for lobe in lobes:
        over = None if lobe.over is None else places[lobe.over]
        places.append(len(kept) if lobe.reflects else over)
        if lobe.reflects:
            kept.append(replace(lobe, over=over))
    return tuple(kept)


def phong(colour: RGB, exponent: float = MIRROR) -> Lobe:
    """The paper's specular lobe: a mirror, or Phong's."""
    if math.isinf(exponent) and exponent > 0.0:
        return Lobe("mirror", colour)
    return Lobe("phong", colour, {"exponent": exponent})


@dataclass(frozen=True)
class Material:
    """BSDF = albedo / pi of a diffuse lobe that nothing covers, and other lobes; and what glows."""

    name: str
    diffuse: RGB = (0.8, 0.8, 0.8)  # albedo
    lobes: tuple[Lobe, ...] = ()
    emission: RGB = BLACK  # radiance on both sides [W/(m^2 sr)]
    holdout: bool = False  # the eye sees nothing there, and nothing behind it
    program: Program = ()
    # Its diffuse albedo, emission, the normal of its smooth surface, "base", or the shading normal
    # about that one, that the program gives.
    varying: Varying = field(default_factory=dict)
    absorption: RGB = BLACK  # of light on its way inside a mesh that wears it [1/m]

    def check(self) -> None:
        """Raise SceneError naming the material and the first value out of its range."""
        who = f"material {self.name!r}"
        check_finite(f"{who}: diffuse", self.diffuse, 0.0)
        check_finite(f"{who}: emission", self.emission, 0.0)
        check_finite(f"{who}: absorption", self.absorption, 0.0)
        for number, lobe in enumerate(self.lobes):
            lobe.check(f"{who}: {lobe.kind}")
            if lobe.over is not None and lobe.over not in range(number):
                raise SceneError(f"{who}: {lobe.kind}: over = {lobe.over} is no lobe before it")
        check_program(who, self.program, [self.varying, *(lobe.varying for lobe in self.lobes)])

    @property
    def glows(self) -> bool:
        """Whether its triangles are lights."""
        return max(self.emission) > 0 or "emission" in self.varying

    @property
    def is_transparent(self) -> bool:
        """Whether light goes straight on through it, all of it or some."""
        return any(lobe.kind == TRANSPARENT and lobe.reflects for lobe in self.lobes)

    @property
    def is_diffuse(self) -> bool:
        """Whether photons land on it."""
        bare = max(self.diffuse) > 0 or "diffuse" in self.varying
        return bare or any(lobe.may_be("covered") for lobe in self.lobes)

    @property
    def is_anisotropic(self) -> bool:
        """Whether what it reflects depends on a tangent."""
        return any(lobe.reflects and lobe.is_anisotropic for lobe in self.lobes)

    def head_on(self) -> NDArray[np.float64]:
        """What it reflects of light from everywhere to a viewer straight above, per channel."""
        albedo = np.array(self.diffuse, np.float64)
        passed: list[float] = []  # what gets through each, and through what lies over it
        for lobe in self.lobes:
            own, above = lobe.reflected_head_on(), 1.0 if lobe.over is None else passed[lobe.over]
            passed.append(above * (1.0 - min(own.max(), 1.0)))
            albedo += above * lobe.weight * own + passed[-1] * np.array(lobe.covered)
        return albedo

    def conserving(self) -> Material:
        """The material that reflects no more than it receives in any channel (scaled down). What
        its program gives is bounded where it is used."""
        if self.program:
            return self
        total = self.head_on()
        if total.max() <= 1.0:
            return self
        scale = np.maximum(total, 1.0)
        return replace(
            self,
            diffuse=_colour(np.divide(self.diffuse, scale)),
            lobes=tuple(_divided(lobe, scale) for lobe in self.lobes),
        )


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
    corner_normals: NDArray[np.float32] = _empty((0, 3, 3), np.float32)  # (T, 3, 3) unit
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
    # (S, 6, 4): the transform from world space to the object's, three rows; its colour; its place
    # in world space and random number; its index, and zeros. (0, 6, 4): no program asks.
    objects: NDArray[np.float64] = _empty((0, 6, 4), np.float64)
    moving: tuple[Moving, ...] = ()  # what does not stand still where it is
    # How open the shutter is meanwhile, at even instants; (): all the time the same.
    shutter: tuple[float, ...] = ()
    caustics: tuple[str, ...] = CAUSTICS  # by which lobes' light they fall on diffuse surfaces
    light_groups: tuple[str, ...] = ()  # whose light is told apart
    surface_groups: tuple[
        str, ...
    ] = ()  # (S,) of these, or "", to which what glows belongs; (): ""

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
        objects = len(self.surfaces) if len(self.objects) else 0
        for name, shape, dtype in (
            ("vertices", (len(self.vertices), 3), np.float64),
            ("triangles", (count, 3), np.int32),
            ("corner_normals", (count, 3, 3), np.float32),
            ("corner_tangents", (tangents, 3, 3), np.float32),
            ("material", (count,), np.int32),
            ("surface", (count,), np.int32),
            ("visible", (visible,), np.uint8),
            ("terminators", (terminators,), np.float32),
            ("corner_attributes", (count if any(attributes) else 0, *attributes, 3, 4), np.float32),
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
        """Write the snapshot as an .npz file (arrays, and one JSON text for the rest)."""
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
        caustics=tuple(header.get("caustics", CAUSTICS)),
        light_groups=tuple(header.get("light_groups", ())),
        surface_groups=tuple(header.get("surface_groups", ())),
        **{name: data[name] for name in (*_ARRAYS, *(name for name in _LATER if name in data))},
    )


def _read_material(values: dict[str, Any]) -> Material:
    lobes = tuple(map(_read_lobe, values["lobes"]))
    program = read_program(values.get("program", ()))  # before version 5 there are none
    varying = read_varying(values.get("varying", {}))
    return Material(**values | {"lobes": lobes, "program": program, "varying": varying})


def _read_lobe(values: dict[str, Any]) -> Lobe:
    own = {"parameters": _tuples(values["parameters"])}
    return Lobe(**_tuples(values) | own | {"varying": read_varying(values.get("varying", {}))})


def _read_light(values: dict[str, Any]) -> Light:
    profile = tuple(map(tuple, values["profile"]))
    return Light(**values | {"parameters": _tuples(values["parameters"]), "profile": profile})


def _read_light_3(values: dict[str, Any]) -> Light:
    """Before spheres might be soft, and cones stretched."""
    new = {"point": {"soft": 0.0}, "spot": {"soft": 0.0, "stretch_x": 1.0, "stretch_y": 1.0}}
    parameters = _tuples(values["parameters"]) | new.get(values["kind"], {})
    return Light(**values | {"parameters": parameters})


def _read_light_1(values: dict[str, Any]) -> Light:
    """What Photon Stream 0.1 wrote: two kinds, all fields of both; lights were not seen."""
    name, position, power, radius = (values[x] for x in ("name", "position", "power", "radius"))
    light = point_light(name, position, power, radius)
    if values["kind"] != "POINT":
        size, blend = values["spot_size"], values["spot_blend"]
        light = spot_light(
            name, position, power, values["direction"], size=size, blend=blend, radius=radius
        )
    return replace(light, found_by=("diffuse", "glossy"))


def _read_material_1(values: dict[str, Any]) -> Material:
    """What Photon Stream 0.1 wrote: one specular lobe, or the zeros of one."""
    lobe = phong(values["specular"], values["exponent"])
    return Material(values["name"], values["diffuse"], (lobe,) if lobe.reflects else ())


# By the version of a snapshot.
_READERS: dict[int, tuple[Callable[..., Light], Callable[..., Material]]] = {
    1: (_read_light_1, _read_material_1),
    2: (_read_light_3, _read_material),
    3: (_read_light_3, _read_material),
    4: (_read_light, _read_material),
    5: (_read_light, _read_material),
}


def _divided(lobe: Lobe, by: NDArray[np.float64]) -> Lobe:
    colour = lobe.colour if lobe.kind in COATS else _colour(np.divide(lobe.colour, by))
    return replace(lobe, colour=colour, covered=_colour(np.divide(lobe.covered, by)))


def _colour(values: Any) -> RGB:
    red, green, blue = map(float, values)
    return red, green, blue


_ARRAYS = ("vertices", "triangles", "corner_normals", "material", "surface")
_LATER = (
    "corner_tangents",
    "visible",
    "terminators",
    "corner_attributes",
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
