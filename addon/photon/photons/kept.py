# SPDX-License-Identifier: GPL-3.0-or-later
"""What outlives a render: the scene as it is set up on the device, and where its photons landed.

The paper's future work: while nothing but the camera moves, photons are not traced again,
unless they meet bumps, which are as fine as the eye sees them.
"""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...streams import Device
from ..backends.backend import Backend
from ..errors import DeviceError
from ..film.denoise import Opened
from ..scene import Scene
from ..scene.snapshot import same
from ..settings import Settings
from ..stage.densities import about_all, filled
from ..stage.device_scene import DeviceScene
from ..stage.dicing import diced
from ..stage.displacement import displaced
from ..stage.geometry import Mesh, frame_of
from ..stage.glow import lit_by_media
from ..stage.movement import Movement
from ..stage.textures import Texels
from .deposits import DEPOSIT_BYTES, Copy, Deposits
from .mapper import Mapper, PhotonBatch

# [bytes] of deposits that are kept: an eighth of the memory that Blender asks for at least, and as
# much as a GPU of 4 GB can spare; less where a render leaves less (`leave_room`).
BUDGET = 1 << 30
EYE_ONLY_FIELDS = ("camera",)  # what of a scene eye rays alone meet


class _Key(NamedTuple):
    """What a pass's photons depend on besides the scene and the source."""

    pass_index: int
    photons: int
    passes: int  # together with it
    starts: bytes  # how they start at lights


class _Pass(NamedTuple):
    deposits: Copy
    unfinished: int
    dropped: int


class _Worked(NamedTuple):
    given: Scene
    view: tuple[Any, ...]  # by which it was made
    about: NDArray[np.float64] | None  # (2, 3) where what is everywhere was asked for
    made: Scene


class Kept:
    """Keeps one scene and its photons on a device, for one renderer at a time.

    Whatever is taken from here is, bit for bit, what would be made anew; but what nodes tell of fog
    that is everywhere stays as long as the camera is within it. Scenes are values: one whose arrays
    are changed in place is taken for what it was.
    """

    def __init__(self, device: Device, budget: int = BUDGET) -> None:
        """`budget` [bytes] of deposits."""
        self.device, self.budget = device, budget
        self._scene: DeviceScene | None = None
        self._texels: Texels | None = None  # the scene's
        self._source: tuple[Any, ...] = ()  # what photons depend on besides the scene
        self._passes: dict[_Key, _Pass] = {}
        self.photon_bytes = 0  # that the deposits of these take
        self._spare = self.budget
        self._key = _Key(-1, 0, 1, b"")  # of the pass that was started
        self._tracing: Mapper | None = None  # who has started it and not finished
        self._before = 0, 0  # photons unfinished and dropped when it was
        self._beside: list[Kept] = []  # of the scene's other takes
        self._opened: Opened | None = None
        self._worked: _Worked | None = None

    def device_scene(self, scene: Scene, backend: Backend) -> DeviceScene:
        """A scene on the device: what is there, if nothing but the view has changed. Another one
        begins with its tree, as long as triangles have only moved."""
        there = self._scene
        if there and there.backend.name == backend.name and same_but_view(there.scene, scene):
            backend.share(there.backend)
            return replace(there, time=None) if there.movement else there
        tree = there.mesh.tree if there else None
        del there
        self._release_scene()  # first: there may not be room for both
        texels, self._texels = self._texels, None
        self._texels = Texels.of(self.device, scene, texels)
        movement = Movement(scene) if scene.moving else None
        frame = frame_of(scene, movement)
        mesh = Mesh.build(scene, frame, tree, movement)
        del tree
        self._scene = DeviceScene.build(scene, backend, frame, mesh, self._texels, movement)
        return self._scene

    def worked_out(self, scene: Scene, width: int, backend: Backend) -> Scene:
        """A scene whose materials have moved its surfaces, cut for a picture so many pixels wide,
        and told what media have, which emit by lamps: what is there, if nothing but the view has
        changed. DeviceError when OpenGL fails."""
        moves = any(material.displacement for material in scene.materials)
        if not moves and not any(medium.asks or medium.glows for medium in scene.media):
            self._worked = None
            return filled(scene, backend, None)
        there = self._worked
        is_same = there is not None and same_but_view(there.given, scene)
        is_about = there is not None and _is_about(there.about, scene)
        if there and is_same and is_about and there.view == _view_of(scene, width):
            return replace(there.made, camera=scene.camera)
        self._worked = there = None
        cut = diced(scene, width)
        try:
            made = self._by_nodes(cut, backend)
        except DeviceError:  # there may be room without what is kept
            self.device.drop_spare()
            self.release()
            made = self._by_nodes(cut, backend)
        about = about_all(made) if scene.air.asks else None
        self._worked = _Worked(scene, _view_of(scene, width), about, made)
        return made

    def _by_nodes(self, scene: Scene, backend: Backend) -> Scene:
        if self._texels and not self._texels.are_of(scene):
            self._release_scene()
        self._texels = Texels.of(self.device, scene, self._texels)
        moved = displaced(scene, backend, self._texels)
        return lit_by_media(filled(moved, backend, self._texels))

    def opened(self) -> Opened:
        """OpenImageDenoise, which stays open from one render to the next."""
        if self._opened and self._opened.has_failed:
            self._opened = None
        self._opened = self._opened or Opened()
        return self._opened

    def beside(self, number: int) -> Kept:
        """What is kept of a scene's take: of the first one by this, of others no photons."""
        while number > len(self._beside):
            self._beside.append(Kept(self.device, budget=0))
        return self._beside[number - 1] if number else self

    def limit(self, count: int) -> None:
        """Keep no more than so many besides."""
        for kept in self._beside[count:]:
            kept.release()
        del self._beside[count:]

    def leave_room(self, spare: int | None) -> None:
        """Keep no more than `spare` [bytes] besides what is kept; None: as the budget says."""
        self._spare = self.budget if spare is None else self.photon_bytes + spare

    def forget_photons(self) -> None:
        """Make room."""
        for kept in self._passes.values():
            kept.deposits.release()
        self._passes.clear()
        self.photon_bytes = 0

    def start(
        self,
        mapper: Mapper,
        settings: Settings,
        index: int,
        photons: int | None = None,
        passes: int = 1,
    ) -> None:
        """Launch what `finish` will give, of so many passes from one on, unless that was done."""
        source = (
            settings.seed,
            settings.photons_a_pass,
            settings.photon_bounces,
            settings.volume_bounces,
            settings.direct_by_photons,
            settings.caustics,
        )
        if source != self._source:
            self.forget_photons()
            self._source = source
        starts = self._scene.tables.starts() if self._scene else b""
        photons = settings.photons_a_pass if photons is None else photons
        key = _Key(index, photons, passes, starts)
        if (self._tracing, self._key) == (mapper, key):
            return
        self._tracing, self._key, deposits = None, key, mapper.deposits
        if deposits.held and deposits.held[0] == key:
            return
        if kept := self._passes.get(key):
            deposits.paste(kept.deposits)
            deposits.held = key, kept.unfinished, kept.dropped
        else:
            self._before = mapper.unfinished, deposits.dropped
            mapper.start(PhotonBatch(key.pass_index, key.photons, passes=key.passes))
            self._tracing = mapper

    def finish(self, mapper: Mapper) -> Deposits:
        """The deposits of what was started: traced in the scene, or what that gave when it was last
        done, a pass that the mapper's deposits hold still or one that is kept.

        Passes are kept until the budget is spent, and the first ones stay: if later ones took their
        place, a render that goes through all in order would find none.
        """
        deposits, key, self._tracing = mapper.deposits, self._key, None
        if not deposits.held:
            mapper.finish()
            before = self._before
            unfinished, dropped = mapper.unfinished - before[0], deposits.dropped - before[1]
            mapper.unfinished, deposits.dropped = before
            room = min(self.budget, self._spare)
            # Where caustics are told apart there are two lists.
            if not deposits.caustics and self.photon_bytes + DEPOSIT_BYTES * deposits.count < room:
                copy = deposits.copy()
                self._passes[key] = _Pass(copy, unfinished, dropped)
                self.photon_bytes += copy.bytes
            deposits.held = key, unfinished, dropped
        _, unfinished, dropped = deposits.held
        mapper.unfinished += unfinished
        deposits.dropped += dropped
        return deposits

    def release(self) -> None:
        """Forget everything, and free it on the device."""
        self._release_scene()
        if self._texels:
            self._texels.release()
        self._texels = None
        if self._opened:
            self._opened.release()
        self._opened = self._worked = None
        self.limit(0)

    def _release_scene(self) -> None:
        """But the textures: they take longest to send, and stay while materials change."""
        self.device.use()
        self.forget_photons()
        if self._scene:
            self._scene.tables.release()
        self._scene = self._tracing = None


def _view_of(scene: Scene, width: int) -> tuple[Any, ...]:
    """What the sizes of triangles depend on, where any are by pixels."""
    if not len(scene.dicing):
        return ()
    camera = scene.camera
    return width, camera.kind, camera.window, camera.matrix.tobytes()


def _is_about(about: NDArray[np.float64] | None, scene: Scene) -> bool:
    """Whether the camera is still where what is everywhere was asked for."""
    if about is None:
        return True
    place = scene.camera.matrix[:3, 3]
    return bool(((place >= about[0]) & (place <= about[1])).all())


def same_but_view(one: Scene, other: Scene) -> bool:
    """Whether two scenes are equal to the bit, but for their EYE_ONLY_FIELDS."""
    names = [field.name for field in fields(Scene) if field.name not in EYE_ONLY_FIELDS]
    return all(same(getattr(one, name), getattr(other, name)) for name in names)
