# SPDX-License-Identifier: GPL-3.0-or-later
"""Device: an OpenGL context without a window, and what it can do."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable, Sequence
from typing import Any, Literal

import moderngl
import numpy as np
from numpy.typing import NDArray

from .ahead import links_ahead
from .bindings import Bindings
from .driver import free_memory, listen, newest_context, nothing
from .functions import find_function
from .linked import Linked
from .readback import Readback, Reading
from .source import Source, StreamError

Layer = Literal["fragment", "compute"]  # how OpenGL runs a kernel

_SOFTWARE = ("llvmpipe", "softpipe", "swrast", "software")
_CACHED_FRAMEBUFFERS = 512

_WRITTEN, _READ = "by programs", "by the host"  # what a buffer is for


def rounded_up(number: int, least: int = 1) -> int:
    """A number a quarter, or `least`, larger at most, and the same for numbers that differ little:
    lists do from frame to frame, and then find room that was made before."""
    step = max(least, 1 << max(0, number.bit_length() - 3))
    return -(-number // step) * step


class Device:
    """Opens an OpenGL context and owns it; it belongs to the thread that made it.

    Where a process has several, `use` says whose turn it is.

    `index` chooses among EGL devices. Raises StreamError if there is no OpenGL 3.3, and wherever
    the driver has no room for an object.
    """

    def __init__(self, index: int = 0) -> None:
        self.ctx: Any = newest_context(index)
        try:
            self._set_up()
        except (moderngl.Error, StreamError) as error:
            self.ctx.release()
            raise StreamError(f"OpenGL on device {index}: {error}") from error

    def _set_up(self) -> None:
        info = self.ctx.info
        self.name = str(info["GL_RENDERER"])
        self.version = str(info["GL_VERSION"])
        self.glsl_version = min(self.ctx.version_code, 450)
        self.is_software = any(word in self.name.lower() for word in _SOFTWARE)
        self.prefers_native = self.is_software  # to sort and compact on the host
        # Threads that a GPU runs together, where that is known; AMD's are 32 or 64.
        self.warp = 32 if "nvidia" in str(info["GL_VENDOR"]).lower() else None
        self.has_compute = self.ctx.version_code >= 430
        self.texture_limit = min(int(info.get("GL_MAX_TEXTURE_SIZE", 4096)), 16384)
        self.layer_limit = int(info.get("GL_MAX_ARRAY_TEXTURE_LAYERS", 256))
        # [bytes] that a program reads of one; 2^27 is the least that compute programs come with
        self.buffer_limit = int(info.get("GL_MAX_SHADER_STORAGE_BLOCK_SIZE", 1 << 27))
        self.point_size_limit = float(info["GL_POINT_SIZE_RANGE"][1])
        # moderngl goes back to the framebuffer last used whenever it makes an object: that must
        # never be one already released.
        self._rest = self.ctx.framebuffer([self.ctx.texture((1, 1), 4)])
        # moderngl frees no queries, so all kernels share one.
        self.samples_passed = self.ctx.query(samples=True)
        self.errors: list[str] = []
        self._framebuffers: dict[tuple[int, ...], moderngl.Framebuffer] = {}
        self.reuses = not self.is_software  # textures that were put back
        self._spare: dict[tuple[Any, ...], list[tuple[int, Any]]] = {}  # and since which render
        self._renders = 0
        self._programs: dict[tuple[str, ...], Linked] = {}  # by their shaders' texts
        self._ahead = links_ahead(self.ctx)
        self._readback = Readback(self.ctx)
        self.bind = Bindings(self.ctx)
        # In which kernels count who is alive, one after the other. It only grows (modulo 2^32): the
        # host never writes to it. One for all, since a driver finds memory for a buffer when it is
        # first used: with one for each kernel, its first launch takes a GPU's host longer.
        self.alive: Any = self.ctx.buffer(bytes(4)) if self.has_compute else None
        self.alive_before = 0  # when it was last read
        flush = None if self.is_software else find_function("glFlush")
        self._flush = ctypes.CFUNCTYPE(None)(flush) if flush else nothing
        self._launched = 0  # programs since something was last asked for
        self._stop_listening = listen(self.ctx, self.errors)

    def use(self) -> None:
        """Make this device's context the thread's current one: OpenGL calls go there."""
        self.ctx.__enter__()

    def choose_layer(self, wanted: str) -> Layer:
        """The physical layer for `wanted` = "auto", "fragment" or "compute".

        On software OpenGL fragment programs are the faster, on GPUs compute programs.
        """
        if wanted == "compute" and not self.has_compute:
            raise StreamError(f"{self.name} has no compute programs (OpenGL {self.version})")
        if wanted == "auto":
            return "compute" if self.has_compute and not self.is_software else "fragment"
        return "compute" if wanted == "compute" else "fragment"

    def keeps_lists(self, layer: str) -> bool:
        """Whether lists are sorted and compacted on the device.

        Software OpenGL computes where the native core does, and the host is faster at lists.
        """
        return layer == "compute" and not self.prefers_native

    def program(self, *shaders: str, refused: Callable[[moderngl.Error], StreamError]) -> Linked:
        """The program of a vertex and a fragment shader, or of a compute shader; `refused` says
        what is raised for what the driver says against it.

        Linked once, shared by all that ask for it, and freed with the device. Its uniforms are
        shared, too: whoever runs it sets them all before. Compute programs of a GPU are linked
        when they first run: until then the driver's threads are at it.
        """
        if shaders not in self._programs:
            compute = len(shaders) == 1
            begun = self._ahead.begin(*shaders) if compute and not self.is_software else 0

            def link() -> Any:
                try:
                    if compute:
                        return self._ahead.end(begun, lambda: self.ctx.compute_shader(*shaders))
                    return self.ctx.program(vertex_shader=shaders[0], fragment_shader=shaders[1])
                except moderngl.Error as error:
                    raise refused(error) from None

            linked = Linked(link)
            if not begun:
                _ = linked.program
            self._programs[shaders] = linked
        return self._programs[shaders]

    def framebuffer(self, textures: Sequence[moderngl.Texture]) -> moderngl.Framebuffer:
        """A framebuffer that draws into `textures`; made once for each combination."""
        self.bind.before_drawing()
        key = tuple(texture.glo for texture in textures)
        if key not in self._framebuffers:
            if len(self._framebuffers) >= _CACHED_FRAMEBUFFERS:
                self._rest.use()
                self._framebuffers.pop(next(iter(self._framebuffers))).release()  # the oldest
            make = self.ctx.framebuffer
            self._framebuffers[key] = self._made(make, color_attachments=list(textures))
        return self._framebuffers[key]

    def free(self, item: moderngl.Texture | moderngl.TextureArray | moderngl.Buffer) -> None:
        """Release a buffer, or a texture and the framebuffers that draw into it."""
        if isinstance(item, moderngl.Texture):
            self._rest.use()
            for key in [key for key in self._framebuffers if item.glo in key]:
                self._framebuffers.pop(key).release()
        item.release()

    def put_back(self, item: moderngl.Texture | moderngl.TextureArray | moderngl.Buffer) -> None:
        """Take back a texture or buffer that is no longer used: for who asks for one like it.

        A GPU's driver finds memory for one when it is first used, which a first pass waits for.
        """
        if not self.reuses:
            self.free(item)
            return
        key: tuple[Any, ...]
        if isinstance(item, (moderngl.Texture, moderngl.TextureArray)):
            key = item.size, item.components, item.dtype
        else:
            key = item.size, item.extra
        self._spare.setdefault(key, []).append((self._renders, item))

    def end_render(self) -> None:
        """Free what was put back before the last render began and is there still."""
        self._drop(self._renders)
        self._renders += 1

    def drop_spare(self) -> None:
        """Free what was put back and nobody has asked for."""
        self._drop(self._renders + 1)

    def _drop(self, before: int) -> None:
        for key, items in self._spare.items():
            for render, item in items:
                if render < before:
                    self.free(item)
            self._spare[key] = [(render, item) for render, item in items if render >= before]

    def _take(self, key: tuple[Any, ...]) -> Any:
        spare = self._spare.get(key)
        if not spare:
            return None
        self.bind.settle()  # who takes it may write to it by other ways than launches
        return spare.pop()[1]

    def ask(self, buffer: moderngl.Buffer, count: int) -> Reading:
        """Ask for a buffer's first `count` uint32; the host may go on before it reads them.

        By way of a buffer of its own, as `read`. All that was launched is handed over to the GPU.
        """
        self.bind.settle()
        reading = self._readback.ask(buffer, count)
        self._flush()
        self._launched = 0
        return reading

    def launched(self) -> None:
        """To be called after each launch of a compute program: hands what was launched over to the
        GPU after the 1st, 2nd, 4th, ... since something was last asked for.

        A driver collects launches, and a GPU that the host has waited for idles meanwhile. After
        every launch would take longer where there are many, as in many_lights.
        """
        self._launched += 1
        if self._launched & (self._launched - 1) == 0:
            self._flush()

    def write(
        self,
        texture: moderngl.Texture,
        data: moderngl.Buffer | NDArray[Any],
        viewport: tuple[int, int, int, int] | None = None,
    ) -> None:
        """Write a texture, or a part of it, that programs may have written to."""
        self.bind.settle()
        texture.write(data, viewport=viewport)

    def copy_buffer(self, to: moderngl.Buffer, of: moderngl.Buffer, size: int) -> None:
        """Copy the first bytes of a buffer that programs may have written to."""
        self.bind.settle()
        self.ctx.copy_buffer(to, of, size)

    def copy(self, texture: moderngl.Texture) -> moderngl.Buffer:
        """The texels of a texture of float32 RGBA as they are, at a buffer's beginning; the caller
        puts it back."""
        buffer = self.buffer(16 * texture.width * texture.height)
        self._finish_writing()
        texture.read_into(buffer)
        return buffer

    def texels(self, texture: moderngl.Texture, count: int | None = None) -> NDArray[np.float32]:
        """The texels of a texture of float32 RGBA on the host, (count or all, 4)."""
        if count is None:
            data = np.empty((texture.width * texture.height, 4), np.float32)
            self._finish_writing()
            texture.read_into(data)
            return data
        # By way of a buffer: for a part of a texture the driver would have to make a framebuffer.
        buffer = self.copy(texture)
        data = self.read(buffer, 4 * count).reshape(count, 4)
        self.put_back(buffer)
        return data

    def shown(self, texture: moderngl.Texture, count: int) -> NDArray[np.float32]:
        """As `texels`, but they may be gone at the next call: a GPU writes them where the host sees
        them."""
        if self.is_software:
            return self.texels(texture, count if count < texture.width * texture.height else None)
        buffer = self.copy(texture)
        data = self._readback.large(buffer, 16 * count)
        data = self.read(buffer, 4 * count) if data is None else data
        self.put_back(buffer)
        return data.reshape(count, 4)

    def read(self, buffer: moderngl.Buffer, count: int) -> NDArray[np.float32]:
        """A buffer's first `count` float32.

        By way of another: one that the host has read stays in its memory, and a GPU's atomics
        across the bus are slow.
        """
        data = np.empty(count, np.float32)
        if count:
            read = self._buffer(data.nbytes, _READ)
            self.copy_buffer(read, buffer, data.nbytes)
            read.read_into(data, data.nbytes)
            self.put_back(read)
        return data

    def _finish_writing(self) -> None:
        """Wait until textures hold what was written and drawn into them, before one is read.

        Reading one waits for that in OpenGL, but not always in Mesa 22.3's llvmpipe: while
        other work kept the cores busy, films of short passes lacked most of these.
        """
        self.bind.settle()
        if self.is_software:
            self.ctx.finish()

    def texture(self, size: tuple[int, int], channels: int, dtype: str = "f4") -> Any:
        """A texture read texel by texel, which may hold anything; StreamError if the device has no
        room for it."""
        spare = self._take((tuple(size), channels, dtype))
        return spare or self._new_texture(self.ctx.texture, size, channels, dtype)

    def texture_array(self, size: tuple[int, int, int], dtype: str) -> Any:
        """The same of several layers, of one channel."""
        spare = self._take((tuple(size), 1, dtype))
        return spare or self._new_texture(self.ctx.texture_array, size, 1, dtype)

    def buffer(self, size: int) -> moderngl.Buffer:
        """A buffer of `size` bytes, or a quarter or 256 more at most, which may hold anything."""
        return self._buffer(size, _WRITTEN)

    def _buffer(self, size: int, use: str) -> moderngl.Buffer:
        size = rounded_up(max(1, size), 256)
        made: moderngl.Buffer = self._take((size, use)) or self._new_buffer(size)
        made.extra = use
        return made

    def _new_buffer(self, size: int) -> moderngl.Buffer:
        buffer: moderngl.Buffer = self._made(self.ctx.buffer, reserve=size)
        if said := self._refused(buffer):
            if not any(self._spare.values()):
                raise StreamError(f"{self.name} has no room for {size} bytes ({said})")
            self.drop_spare()
            return self._new_buffer(size)
        return buffer

    def _new_texture(
        self, make: Callable[..., Any], size: tuple[int, ...], channels: int, dtype: str
    ) -> Any:
        texture = self._made(make, size, channels, dtype=dtype)
        if said := self._refused(texture):
            if not any(self._spare.values()):
                texels = "x".join(map(str, size))
                raise StreamError(f"{self.name} has no room for {texels} texels ({said})")
            self.drop_spare()
            return self._new_texture(make, size, channels, dtype)
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return texture

    def _made(self, make: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
        self.check()  # what was refused before is not this one's fault
        try:
            return make(*arguments, **options)
        except moderngl.Error as error:
            raise StreamError(f"{self.name}: {error}") from error

    def _refused(self, made: Any) -> str:
        """What OpenGL said against a texture or buffer, which is then released; "" if nothing.

        moderngl returns one that has no memory like any other.
        """
        code = self.ctx.error
        if code != "GL_OUT_OF_MEMORY":
            self.errors += [code] * (code != "GL_NO_ERROR")  # of something before: for `check`
            return ""
        said = "; ".join(self.errors) or str(code)
        self.errors.clear()
        made.release()
        return said

    def free_memory(self) -> int | None:
        """What the GPU has left [bytes]; None where the driver does not tell."""
        return free_memory(self.ctx)

    def trim(self) -> None:
        """Return to the system what was released: on the host the C library keeps blocks of less
        than 32 MB for itself, and so most textures of software OpenGL."""
        if sys.platform.startswith("linux"):
            trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # glibc's
            if trim:
                trim(0)

    def refusal(self, who: str, source: Source, error: Exception) -> StreamError:
        """The error for a program that the driver refused, with files and lines; forgets what
        KHR_debug repeated of it."""
        self.errors.clear()
        return StreamError(f"{who}: {source.explain(str(error))}")

    def check(self) -> None:
        """Raise StreamError if OpenGL has reported an error since the last call."""
        code = self.ctx.error
        if code != "GL_NO_ERROR":
            self.errors.append(code)
        if self.errors:
            text = "; ".join(self.errors)
            self.errors.clear()
            raise StreamError(f"{self.name}: {text}")

    def release(self) -> None:
        """Free the context and all that lives in it."""
        self.use()
        self._readback.release()
        self.drop_spare()
        self._release_framebuffers()
        for linked in self._programs.values():
            linked.release()
        self._stop_listening()
        self.ctx.release()

    def _release_framebuffers(self) -> None:
        self._rest.use()
        for framebuffer in self._framebuffers.values():
            framebuffer.release()
        self._framebuffers.clear()
