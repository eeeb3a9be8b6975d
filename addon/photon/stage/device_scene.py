# SPDX-License-Identifier: GPL-3.0-or-later
"""What makes up a scene on a device."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..backends.backend import Backend
from ..scene import Scene
from .emissive import emissive_triangles
from .geometry import Frame, Mesh
from .movement import Movement
from .tables import Tables
from .textures import Texels


@dataclass(frozen=True)
class DeviceScene:
    """Hold a scene as it is set up on a device for a backend: all but its view."""

    scene: Scene
    backend: Backend
    frame: Frame
    mesh: Mesh
    tables: Tables
    movement: Movement | None = None  # of what moves while the shutter is open
    time: float | None = None  # of that; None: as the scene has it

    @staticmethod
    def build(
        scene: Scene,
        backend: Backend,
        frame: Frame,
        mesh: Mesh,
        texels: Texels | None = None,
        movement: Movement | None = None,
    ) -> DeviceScene:
        """Upload the tables of a scene's mesh, beside its `texels`, which stay the caller's;
        SceneError if that is impossible."""
        backend.prepare_mesh(mesh)
        array = texels.array if texels else None
        device, layer = backend.device, backend.layer
        tables = Tables.upload(device, layer, scene, frame, mesh, backend.reads_tree, array)
        return DeviceScene(scene, backend, frame, mesh, tables, movement)

    def at(self, time: float) -> DeviceScene:
        """The scene at an instant of the exposure. It takes tables and triangles of the last one
        with it."""
        if self.movement is None or time == self.time:
            return self
        now = self.movement.at(time)
        mesh = Mesh.build(now, self.frame, self.mesh.tree, self.movement)
        self.backend.prepare_mesh(mesh)
        relit = bool(np.isin(emissive_triangles(self.scene, mesh), self.movement.rows).any())
        self.tables.move(self.backend.layer, self.scene, now, self.frame, mesh, relit)
        return replace(self, mesh=mesh, time=time)
