# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Uniform, When
from ..settings import PIXEL_FILTER_DEFINES
from .records import PIXEL, RAY_DIRECTION, RAY_ORIGIN


class EyeRays(Kernel):
    """Send one ray through each pixel of a region of the frame, and a point of the LENS."""

    stem = "eye_rays"
    structure = ("LENS", *PIXEL_FILTER_DEFINES)
    outputs = {"origin": RAY_ORIGIN, "direction": RAY_DIRECTION, "pixel": PIXEL}
    uniforms = {
        "camera": Uniform("mat4"),
        "camera_parameters": Uniform("vec4"),
        "window": Uniform("vec4"),
        "clip": Uniform("vec2"),
        "frame_size": Uniform("ivec2"),
        "region_origin": Uniform("ivec2"),
        "pixel_filter_width": Uniform("float"),
        "seed": Uniform("uint"),
        "pass_index": Uniform("uint", of_parts=True),
        "lens": When("LENS", Uniform("vec3")),  # radius, rotation, width over height
        "focus": When("LENS", Uniform("float")),
        "blades": When("LENS", Uniform("int")),
    }
