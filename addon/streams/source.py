# SPDX-License-Identifier: GPL-3.0-or-later
"""GLSL sources: rooted, nested includes, each once; driver messages mapped back to files."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import groupby
from pathlib import Path

_INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"\s*$')
_DEFINE = re.compile(r"^\s*#define\s+(\w+)", re.M)
_UNDEFINE = re.compile(r"^\s*#undef\s+(\w+)")
_CONDITION = re.compile(r"^\s*#(ifdef|ifndef|if|elif|else|endif)\b\s*(.*?)\s*(?://.*)?$")
# Of an #if: what hangs on nothing but whether names are defined.
_DEFINED = re.compile(r"defined\s*\(\s*(\w+)\s*\)|defined\s+(\w+)")
_LOGIC = re.compile(r"(?:True|False|and|or|not|[() ])*")
# Mesa "0:31(5): error", glslang "ERROR: 0:31: ...", NVIDIA "0(31) : error"
_PLACE = re.compile(r"\b0:(\d+)\b(?:\(\d+\))?|\b0\((\d+)\)")


MADE = "made/"  # where included files are that no folder holds
Made = Mapping[str, str]  # their texts by path


class StreamError(Exception):
    """A stream program that cannot be built or run; the text names both sides."""


@lru_cache(maxsize=1)
def glsl_root() -> Path:
    """The folder of the GLSL files: inside the package when installed, else beside it."""
    package = Path(__file__).resolve().parents[1]
    for root in (package / "glsl", package.parent / "glsl"):
        if root.is_dir():
            return root
    raise StreamError(f"no glsl folder in {package} or beside it: the installation is incomplete")


def read(path: str, asked_by: str) -> str:
    """The text of a file below the GLSL root; StreamError if it is not there."""
    try:
        return _text(glsl_root(), path)
    except FileNotFoundError:
        raise StreamError(f"{asked_by}: no file {path!r} in {glsl_root()}") from None


@lru_cache(maxsize=256)
def _text(root: Path, path: str) -> str:
    """A file's text; kept, for renders read most files several times."""
    file = (root / path).resolve()
    if not file.is_relative_to(root.resolve()) or not file.is_file():
        raise FileNotFoundError
    return file.read_text(encoding="utf-8")


@dataclass(frozen=True)
class _Part:
    """Of a file: a directive, or lines up to the next one."""

    is_directive: bool
    lines: tuple[str, ...]
    places: tuple[str, ...]  # of each line, as Source has them


@lru_cache(maxsize=512)
def _parts(path: str, text: str) -> tuple[_Part, ...]:
    """A file in order; kept, for each is part of many programs."""
    numbered = enumerate(text.splitlines(), 1)
    parts: list[_Part] = []
    for is_directive, lines in groupby(numbered, lambda each: each[1].lstrip().startswith("#")):
        placed = [(line, f"{path}:{at}") for at, line in lines]
        for some in [[each] for each in placed] if is_directive else [placed]:
            parts.append(_Part(is_directive, *zip(*some, strict=True)))
    return tuple(parts)


@dataclass(frozen=True)
class Source:
    """An expanded program text, and where each of its lines comes from.

    No `#line` in the text: Mesa forgets its source number in some messages.
    """

    text: str
    places: tuple[str, ...]  # "lib/ray.glsl:31" for each line of text

    def explain(self, log: str) -> str:
        """The driver's message with files and their lines."""

        def name(match: re.Match[str]) -> str:
            line = int(match[1] or match[2]) - 1
            return self.places[line] if 0 <= line < len(self.places) else match[0]

        return _PLACE.sub(name, log)


def expand(path: str, header: str, made: Made | None = None) -> Source:
    """`header` followed by the file `path` (below the GLSL root) with its includes in place.

    `made` are the files below made/. What stands behind an `#ifdef`, `#ifndef` or `#if` of what is
    defined that does not hold is left out, and what it includes is not included. Raises StreamError
    naming the including file and line for a file that is not there.
    """
    return _expanded(glsl_root(), path, header, tuple(sorted((made or {}).items())))


@lru_cache(maxsize=256)
def _expanded(_root: Path, path: str, header: str, made: tuple[tuple[str, str], ...]) -> Source:
    """Kept, for each renderer that is set up asks for the same again."""
    text = _Text(dict(made), set(_DEFINE.findall(header)))
    lines = header.splitlines()
    text.lines += lines
    text.places += [f"{path} (header, line {at})" for at in range(1, len(lines) + 1)]
    text.append(path, path)
    return Source("\n".join(text.lines) + "\n", tuple(text.places))


def every_branch(path: str) -> str:
    """The text of a file and of those that it includes, whatever is defined; not of made ones."""
    return _every_branch(glsl_root(), path)


@lru_cache(maxsize=256)
def _every_branch(_root: Path, path: str) -> str:
    text = _Text(None, None)
    text.append(path, path)
    return "\n".join(text.lines)


class _Text:
    """A program text under way."""

    def __init__(self, made: Made | None, defined: set[str] | None) -> None:
        """Without `made` those files are left out; without `defined` all branches are taken."""
        self.lines: list[str] = []
        self.places: list[str] = []
        self._made, self._defined, self._seen = made, defined, set[str]()
        self._taken: list[bool] = []  # of each condition under way: whether a branch of it was

    def append(self, path: str, asked_by: str) -> None:
        """A file, unless it is there: so nothing needs guards, and a cycle ends."""
        if path in self._seen or (self._made is None and path.startswith(MADE)):
            return
        self._seen.add(path)
        # For each condition around a line: whether it holds, or None where a driver has to say.
        around: list[bool | None] = []
        for part in _parts(path, self._read(path, asked_by)):
            line = part.lines[0]
            if part.is_directive:
                if self._defined is not None and self._is_condition(line, around):
                    continue
                if False in around:
                    continue
                include = _INCLUDE.match(line)
                if include:
                    self.append(include[1], part.places[0])
                    continue
                if self._defined is not None:
                    self._defined.update(_DEFINE.findall(line))
                    self._defined.difference_update(_UNDEFINE.findall(line))
            elif False in around:
                continue
            self.lines += part.lines
            self.places += part.places

    def _is_condition(self, line: str, around: list[bool | None]) -> bool:
        """Whether a line belongs to an `#ifdef`, which ends here: it is not emitted."""
        found = _CONDITION.match(line)
        if not found:
            return False
        word, what = found[1], found[2]
        if word in ("ifdef", "ifndef", "if"):
            asked = {"if": what, "ifdef": f"defined({what})", "ifndef": f"!defined({what})"}[word]
            around.append(self._holds(asked))
            self._taken.append(around[-1] is True)
            return around[-1] is not None
        is_known = around[-1] is not None
        if word == "endif":
            around.pop()
            self._taken.pop()
        elif is_known:
            holds = True if word == "else" else self._holds(what)
            if holds is None:
                raise StreamError(f"{line.strip()}: what is before it hangs on what is defined")
            around[-1] = holds and not self._taken[-1]
            self._taken[-1] |= holds
        return is_known

    def _holds(self, asked: str) -> bool | None:
        """Whether a condition does; None where a driver has to say."""
        assert self._defined is not None
        defined = self._defined
        if "GL_" in asked:  # extensions, which a driver has
            return None
        told = _DEFINED.sub(lambda found: f" {(found[1] or found[2]) in defined} ", asked)
        # Of no other words than these, so Python may say.
        told = told.replace("&&", " and ").replace("||", " or ").replace("!", " not ")
        return bool(eval(told, {})) if _LOGIC.fullmatch(told) else None

    def _read(self, path: str, asked_by: str) -> str:
        if not path.startswith(MADE):
            return read(path, asked_by)
        assert self._made is not None
        if path not in self._made:
            raise StreamError(f"{asked_by}: nothing was given for {path!r}")
        return self._made[path]
