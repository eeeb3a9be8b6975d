# SPDX-License-Identifier: GPL-3.0-or-later
"""The chart's contenders: one module an engine.

A module has METHODS (the contenders' names and what its engine calls them) and a class Engine with
`about`, `load(snapshot, blend, size)` and `climb(method, seed)`, which yields a Step after Step.
Engines do not share a process: their OpenGL, TBB and memory allocators clash.
"""

MODULES = ("photon_stream", "cycles", "mitsuba", "luxcore", "povray")
