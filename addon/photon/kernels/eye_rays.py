# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Uniform
from .records import RAY_DIRECTION, RAY_ORIGIN


class EyeRays(Kernel):
    """Send one ray through each pixel of a region of the frame."""

    stem = "eye_rays"
    outputs = {"origin": RAY_ORIGIN, "direction": RAY_DIRECTION}
    uniforms = {
        "camera": Uniform("mat4"),
        "window": Uniform("vec4"),
        "clip": Uniform("vec2"),
        "orthographic": Uniform("bool"),
        "frame_size": Uniform("ivec2"),
        "region_origin": Uniform("ivec2"),
        "jitter": Uniform("vec2"),
    }
