# SPDX-License-Identifier: GPL-3.0-or-later
"""Native core of Photon Stream; the docstrings are in the module."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

__version__: str
MAX_DEPTH: int
MAX_LEAF: int
LAYOUTS: dict[str, str]

def box_mean(image: NDArray[np.float32], reach: int) -> NDArray[np.float32]: ...
def split_halves(
    plain: NDArray[np.float32], half: NDArray[np.float32], share: float, unit: float
) -> tuple[NDArray[np.float32], NDArray[np.float32]]: ...
def mix_halves(
    plain: NDArray[np.float32],
    half: NDArray[np.float32],
    share: float,
    clean: NDArray[np.float32],
    other_clean: NDArray[np.float32],
    *,
    unit: float,
    reach: int,
    dark: float,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]: ...

class Tracer:
    def __init__(
        self,
        nodes: NDArray[np.float32],
        corners: NDArray[np.float32],
        visible: NDArray[np.uint8] | None = None,
        flags: NDArray[np.uint8] | None = None,
    ) -> None: ...
    def trace(
        self,
        origin: NDArray[np.float32],
        direction: NDArray[np.float32],
        any_hit: bool,
        rays: int = 255,
        by_reach: bool = False,
    ) -> NDArray[np.float32]: ...
    def photon_starts(
        self,
        lights: NDArray[np.float32],
        seed: int,
        pass_index: int,
        photons: int,
        aims: NDArray[np.float32] | None = None,
        aim_nodes: NDArray[np.float32] | None = None,
    ) -> NDArray[np.float32]: ...
    def photons(
        self,
        normals: NDArray[np.float32],
        materials: NDArray[np.float32],
        lights: NDArray[np.float32],
        *,
        seed: int,
        pass_index: int,
        photons: int,
        bounces: int,
        first_hits: bool,
        directions: bool,
        numbered: bool = False,
        aims: NDArray[np.float32] | None = None,
        aim_nodes: NDArray[np.float32] | None = None,
        portals: NDArray[np.float32] | None = None,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], int]: ...
    def cuts(
        self,
        place: NDArray[np.float32],
        facing: NDArray[np.float32],
        diffuse: NDArray[np.float32],
        radii: RadiusField,
        *,
        radius_scale: float,
    ) -> NDArray[np.float32]: ...
    def walk(
        self,
        pixel: NDArray[np.float32],
        origin: NDArray[np.float32],
        direction: NDArray[np.float32],
        throughput: NDArray[np.float32],
        walk: NDArray[np.float32],
        *,
        seed: int,
        pass_index: int,
        depth: int,
        frame_size: tuple[int, int],
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]: ...
    def coverage(
        self,
        pixel: NDArray[np.float32],
        place: NDArray[np.float32],
        facing: NDArray[np.float32],
        shading: NDArray[np.float32],
        cuts: NDArray[np.float32],
        diffuse: NDArray[np.float32],
        radii: RadiusField,
        *,
        radius_scale: float,
        filter: str,
        probes: int,
        first_probe: int,
        expecting: int,
        least_expected: float,
        seed: int,
        depth: int,
        frame_size: tuple[int, int],
        faces: NDArray[np.float32] | None = None,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]: ...

class RadiusField:
    def __init__(
        self,
        place: NDArray[np.float32],
        deposit: NDArray[np.float32],
        grids: NDArray[np.float32],
        *,
        photons: float,
        times: float,
        most: float,
        pixel: float,
        eye: Sequence[float] | None,
    ) -> None: ...
    def at(
        self, place: NDArray[np.float32], facing: NDArray[np.float32]
    ) -> NDArray[np.float32]: ...
    @staticmethod
    def of_table(table: NDArray[np.float32], typical: float) -> RadiusField: ...
    def typical(self) -> float: ...
    def largest(self) -> float: ...
    def table(self) -> NDArray[np.float32]: ...

class PhotonMap:
    def __init__(
        self,
        place: NDArray[np.float32],
        deposit: NDArray[np.float32],
        origin: Sequence[float],
        cell_size: float,
        cells: tuple[int, int, int],
        directions: bool = False,
    ) -> None: ...
    def gather(
        self,
        points: Sequence[NDArray[np.float32]],
        radii: RadiusField,
        radius_scale: float,
        filter: str,
        bent: tuple[NDArray[np.float32], NDArray[np.float32]] | None = None,
    ) -> NDArray[np.float32]: ...
    def gather_lobes(
        self,
        points: Sequence[NDArray[np.float32]],
        lobes: Sequence[NDArray[np.float32]],
        radii: RadiusField,
        radius_scale: float,
        filter: str,
        bent: tuple[NDArray[np.float32], NDArray[np.float32]] | None = None,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]: ...

def view_cells(
    places: NDArray[np.float32],
    width: float,
    eye: Sequence[float] | None = None,
    facing: NDArray[np.float32] | None = None,
) -> NDArray[np.int64]: ...
def cells_among(others: NDArray[np.int64], cells: NDArray[np.int64]) -> NDArray[np.int32]: ...
def pack_directions(directions: NDArray[np.float32]) -> NDArray[np.float32]: ...
def unpack_directions(codes: NDArray[np.float32]) -> NDArray[np.float32]: ...
def disc_about(
    middle: NDArray[np.float64], rays: NDArray[np.float64]
) -> tuple[NDArray[np.float32], NDArray[np.float64]]: ...
def aim_tree(
    numbers: NDArray[np.float32],
    masses: NDArray[np.float32],
    least: float,
    nearest: float = 1.0,
) -> tuple[NDArray[np.float32], float]: ...
def aim_pdf(nodes: NDArray[np.float32], numbers: NDArray[np.float32]) -> NDArray[np.float32]: ...
def aimed_numbers(
    nodes: NDArray[np.float32],
    root: int,
    numbers: NDArray[np.float32],
    photons: NDArray[np.uint32],
    *,
    seed: int,
    pass_index: int,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]: ...
def photon_portals(
    places: NDArray[np.float32],
    normals: NDArray[np.float32],
    photons: NDArray[np.uint32],
    masses: NDArray[np.float32],
) -> tuple[NDArray[np.float32], float]: ...
def fit_window(
    portal: NDArray[np.float32],
    places: NDArray[np.float32],
    normals: NDArray[np.float32],
    from_place: NDArray[np.uint32],
    directions: NDArray[np.float32],
    angles: NDArray[np.float32],
    frames: NDArray[np.float32],
    share: float,
    dark: float,
) -> NDArray[np.float32]: ...
def random_numbers(
    elements: NDArray[np.uint32], seed: int, pass_index: int, dimension: int
) -> NDArray[np.float32]: ...
def radius_grids(sample: NDArray[np.float32]) -> tuple[NDArray[np.float32], float]: ...
def radius_grids_about(boxes: NDArray[np.uint32]) -> tuple[NDArray[np.float32], float]: ...
def build_bvh(
    vertices: NDArray[np.float32], triangles: NDArray[np.int32]
) -> tuple[NDArray[np.float32], NDArray[np.int32], int, int, float]: ...
def faces_of(
    nodes: NDArray[np.float32],
    order: NDArray[np.int32],
    vertices: NDArray[np.float32],
    triangles: NDArray[np.int32],
    surfaces: NDArray[np.int32],
    materials: NDArray[np.int32],
) -> NDArray[np.float32]: ...
def refit_bvh(
    nodes: NDArray[np.float32],
    order: NDArray[np.int32],
    vertices: NDArray[np.float32],
    triangles: NDArray[np.int32],
) -> tuple[NDArray[np.float32], int, int, float] | None: ...
def trace(
    nodes: NDArray[np.float32],
    corners: NDArray[np.float32],
    origins: NDArray[np.float32],
    directions: NDArray[np.float32],
    t_max: NDArray[np.float32],
    skip: NDArray[np.int32],
) -> tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.float32], NDArray[np.float32]]: ...
def occluded(
    nodes: NDArray[np.float32],
    corners: NDArray[np.float32],
    origins: NDArray[np.float32],
    directions: NDArray[np.float32],
    t_max: NDArray[np.float32],
    skip: NDArray[np.int32],
) -> NDArray[np.bool_]: ...
def trace_few(
    nodes: NDArray[np.float32],
    corners: NDArray[np.float32],
    origin: NDArray[np.float32],
    direction: NDArray[np.float32],
    any_hit: bool,
) -> NDArray[np.float32]: ...
def trace_brute_force(
    corners: NDArray[np.float32],
    origins: NDArray[np.float32],
    directions: NDArray[np.float32],
    t_max: NDArray[np.float32],
    skip: NDArray[np.int32],
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.float64], NDArray[np.float64]]: ...
def sort_photons(
    positions: NDArray[np.float32],
    origin: NDArray[np.floating] | Sequence[float],
    cell_size: float,
    cells: tuple[int, int, int],
) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]: ...
