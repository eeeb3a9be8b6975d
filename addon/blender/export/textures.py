# SPDX-License-Identifier: GPL-3.0-or-later
"""Images of Image Texture nodes as textures: found, read once, kept, and reported."""

from __future__ import annotations

import hashlib
import tempfile
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

from ...photon.scene import Texture
from .pixels import Stored, file_of, read_pixels
from .report import Notes
from .working_space import working_space

# [bytes] of pixels that are kept between exports: what Blender has read need not be read again.
KEPT = 1 << 30
MAGENTA = np.array([[[255, 0, 255, 255]]], np.uint8)  # what Cycles puts where an image is missing
MISSING_IS_ENDLESS = bpy.app.version >= (5, 2)  # clipped or not


class Found(NamedTuple):
    """The textures of a node."""

    first: int
    tiles: int = 0  # 0: it is one image, without tiles
    constant: NDArray[np.float64] | None = None  # (4,) as stored, if it is the same everywhere
    is_srgb: bool = False  # the constant is


class _Source(NamedTuple):
    """A part of a node's image: Blender's image itself, a file, or nothing."""

    image: bpy.types.Image | None
    path: str = ""  # "": it is Blender's
    tile: int = 0
    packed: Any = None  # a PackedFile in place of a file
    is_there: bool = True  # as far as one can tell without reading it


class Kept:
    """Pixels by what they were made of, as long as there is room."""

    def __init__(self, room: int = KEPT) -> None:
        self._room, self._stored = room, OrderedDict[Any, Stored]()

    def get(self, key: Any) -> Stored | None:
        """What was kept by that name."""
        if key in self._stored:
            self._stored.move_to_end(key)
        return self._stored.get(key)

    def keep(self, key: Any, stored: Stored) -> None:
        """Keep it, and forget what was not asked for longest."""
        self._stored[key] = stored
        while sum(x.pixels.nbytes for x in self._stored.values()) > self._room:
            self._stored.popitem(last=False)

    def clear(self) -> None:
        """Forget all."""
        self._stored.clear()


KEPT_PIXELS = Kept()


@dataclass
class TextureTable:
    """A scene's textures under way; the same image, read in the same way, is one."""

    notes: Notes
    limit: int = 0  # texels of a side; 0: as many as there are
    textures: list[Texture] = field(default_factory=list)
    _found: dict[Any, Found] = field(default_factory=dict)
    _absent: dict[Any, list[str]] = field(default_factory=dict)  # what is missing

    @staticmethod
    def of(scene: bpy.types.Scene, notes: Notes) -> TextureTable:
        """None yet; the limit is Simplify's, as Cycles has it for final renders."""
        limit = getattr(getattr(scene, "cycles", None), "texture_limit_render", "OFF")
        is_limited = scene.render.use_simplify and limit != "OFF"
        return TextureTable(notes, int(limit) if is_limited else 0)

    def find(self, owner: str, node: bpy.types.Node) -> Found:
        """The textures of a node's image, read now unless that was done. What is missing is
        magenta, and noted as the `owner`'s; SceneError if there is no memory to read it."""
        clips = getattr(node, "extension", "REPEAT") == "CLIP"
        sources = _sources(node)
        identity = tuple((s.image and s.image.session_uid, s.path, s.tile) for s in sources)
        key = identity, clips
        if key not in self._found:
            textures = [self._texture(source, clips) for source in sources]
            self._absent[key] = [
                _missing(source)
                for source, texture in zip(sources, textures, strict=True)
                if texture.pixels is MAGENTA
            ]
            self._found[key] = self._placed(textures, bool(sources[0].tile), clips)
        feature = f"Image of '{node.name}'"
        for detail in self._absent[key]:
            self.notes.approximated(owner, feature, detail)
        if not self._absent[key] and node.image.source == "MOVIE":
            detail = "the frame of the movie that Blender has read is used"
            self.notes.approximated(owner, feature, detail)
        return self._found[key]

    def is_unit(self, found: Found) -> bool:
        """Whether what a node's textures hold is within [0, 1], as it is in bytes."""
        own = self.textures[found.first : found.first + max(found.tiles, 1)]
        return all(texture.pixels.dtype.kind != "f" for texture in own)

    def _placed(self, textures: list[Texture], is_tiled: bool, clips: bool) -> Found:
        """Where they are in the scene, if they need be."""
        first = textures[0]
        is_same = first.pixels.shape[:2] == (1, 1) and not is_tiled
        is_gone = all(texture.pixels is MAGENTA for texture in textures)  # as beside the tiles
        has_outside = clips and not (is_gone and MISSING_IS_ENDLESS)
        if (is_same or is_gone) and not has_outside:
            most = 1.0 if first.pixels.dtype.kind == "f" else np.iinfo(first.pixels.dtype).max
            texel = first.pixels[0, 0] / most
            four = texel if len(texel) == 4 else np.append(np.repeat(texel, 3), 1.0)
            return Found(0, 0, four.astype(np.float64), first.is_srgb)
        self.textures += textures
        return Found(len(self.textures) - len(textures), len(textures) if is_tiled else 0)

    def _texture(self, source: _Source, clips: bool) -> Texture:
        stored = self._stored(source, clips) if source.image and source.is_there else None
        if stored is None or source.image is None:
            return Texture("missing", MAGENTA, tile=source.tile)
        self._report(source.image, stored)
        name = f"{source.image.name} {source.tile}" if source.tile else source.image.name
        return Texture(name, stored.pixels, stored.is_srgb, source.tile)

    def _stored(self, source: _Source, clips: bool) -> Stored | None:
        """What is kept, or read now; None if there is nothing to read."""
        with _opened(source) as image:
            packed = source.packed or image.packed_file
            key = _key(image, packed, clips, self.limit)
            stored = KEPT_PIXELS.get(key) if key else None
            is_file = image.source == "FILE" and not packed
            if stored is None and min(image.size) > 0:
                stored = read_pixels(image, is_file, clips, self.limit)
                if key:
                    KEPT_PIXELS.keep(key, stored)
            return stored

    def _report(self, image: bpy.types.Image, stored: Stored) -> None:
        owner = f"Image '{image.name}'"
        if stored.nonfinite:
            self.notes.approximated(owner, "Pixels", f"{stored.nonfinite} are not finite: black")
        if stored.unknown:
            name = image.colorspace_settings.name
            self.notes.approximated(owner, "Color Space", f"{name} is unknown: taken for sRGB")
        if stored.is_halved:
            height, width, _ = stored.pixels.shape
            detail = f"{width}x{height} texels, by Simplify's texture limit"
            self.notes.approximated(owner, "Size", detail)


def is_separated(image: bpy.types.Image | None) -> bool:
    """Whether Cycles divides its colours by alpha, where both are asked for."""
    if image is None or image.alpha_mode in ("NONE", "CHANNEL_PACKED"):
        return False
    return not image.colorspace_settings.is_data


def _sources(node: bpy.types.Node) -> list[_Source]:
    """What a node's image consists of, at the frame it shows; none of it is read."""
    image = node.image
    if image is None:
        return [_Source(None)]
    if image.source == "TILED":
        return [_tile(image, tile) for tile in image.tiles]
    if image.source == "SEQUENCE":
        path = image.filepath_from_user(image_user=node.image_user)
        return [_Source(image, path, is_there=Path(path).is_file())]
    return [_Source(image)]


def _tile(image: bpy.types.Image, tile: bpy.types.UDIMTile) -> _Source:
    number = tile.number
    for packed in image.packed_files:
        if packed.tile_number == number:
            return _Source(image, packed.filepath, number, packed.packed_file)
    if getattr(tile, "is_generated_tile", False):  # Blender tells the first one's pixels alone
        return _Source(image, "", number, is_there=number == image.tiles[0].number)
    u, v = (number - 1001) % 10 + 1, (number - 1001) // 10 + 1
    path = file_of(image).replace("<UDIM>", str(number)).replace("<UVTILE>", f"u{u}_v{v}")
    return _Source(image, path, number, is_there=Path(path).is_file())


def _missing(source: _Source) -> str:
    if source.image is None:
        return "no image is chosen: magenta"
    path = source.path or file_of(source.image)
    tile = f", tile {source.tile}," if source.tile else ""
    return f"image '{source.image.name}'{tile} is missing ({path or 'no path'}): magenta"


@contextmanager
def _opened(source: _Source) -> Iterator[bpy.types.Image]:
    """Blender's image of it: its own, or one that is there for a while."""
    image: Any = source.image
    if not source.path:
        held = image.has_data
        yield image
        if not held and not image.is_dirty and image.source == "FILE":
            image.buffers_free()
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(source.path)
        if source.packed:
            path = Path(folder) / path.name
            path.write_bytes(source.packed.data)
        opened = bpy.data.images.load(str(path))
        try:
            opened.colorspace_settings.name = image.colorspace_settings.name
            opened.alpha_mode = image.alpha_mode
            yield opened
        finally:
            bpy.data.images.remove(opened)


def _key(image: bpy.types.Image, packed: Any, clips: bool, limit: int) -> Any:
    """What its pixels hang on; None if that cannot be told."""
    made: Any
    if image.is_dirty or image.source not in ("FILE", "GENERATED"):
        return None
    if packed:
        made = hashlib.blake2b(packed.data, digest_size=16).digest()
    elif image.source == "FILE":
        path = file_of(image)
        try:
            stat = Path(path).stat()
        except OSError:
            return None
        made = path, stat.st_mtime_ns, stat.st_size
    else:
        size = image.generated_width, image.generated_height
        kind = image.generated_type, image.use_generated_float
        made = *size, *kind, *image.generated_color
    spaces = image.colorspace_settings.name, working_space()
    settings = *spaces, image.alpha_mode, image.file_format
    return made, settings, clips, limit
