# SPDX-License-Identifier: GPL-3.0-or-later
"""The GLSL loader: includes, and driver messages mapped back to files."""

from __future__ import annotations

from pathlib import Path

import pytest

from addon.streams import StreamError
from addon.streams.source import Source, expand
from tests.unit.glsl_files import write


def test_each_file_is_included_once(root: Path) -> None:
    write(root, "lib/a.glsl", '#include "lib/b.glsl"\nfloat a;\n')
    write(root, "lib/b.glsl", "float b;\n")
    write(root, "k.glsl", '#include "lib/a.glsl"\n#include "lib/b.glsl"\nfloat k;\n')
    source = expand("k.glsl", "#version 330")
    assert source.text.count("float b;") == source.text.count("float a;") == 1
    assert source.text.index("float b;") < source.text.index("float a;")
    places = ("lib/b.glsl:1", "lib/a.glsl:2", "k.glsl:3")
    assert source.places == ("k.glsl (header, line 1)", *places)


def test_includes_in_a_circle_end(root: Path) -> None:
    write(root, "a.glsl", '#include "b.glsl"\nfloat a;\n')
    write(root, "b.glsl", '#include "a.glsl"\nfloat b;\n')
    assert expand("a.glsl", "").text.count("float") == 2


def test_missing_include_names_who_asked(root: Path) -> None:
    write(root, "lib/a.glsl", '\n\n#include "lib/none.glsl"\n')
    write(root, "k.glsl", '#include "lib/a.glsl"\n')
    with pytest.raises(StreamError, match=r"^lib/a.glsl:3: no file 'lib/none.glsl' in "):
        expand("k.glsl", "")


@pytest.mark.parametrize("kind", ["up", "absolute", "link"])
def test_no_way_out_of_the_root(root: Path, kind: str) -> None:
    secret = root.parent / "secret.glsl"
    secret.write_text("float secret;\n")
    (root / "link.glsl").symlink_to(secret)
    path = {"up": "../secret.glsl", "absolute": str(secret), "link": "link.glsl"}[kind]
    write(root, "k.glsl", f'float k;\n#include "{path}"\n')
    with pytest.raises(StreamError, match=r"k\.glsl:2: no file"):
        expand("k.glsl", "")


def test_a_folder_is_no_file(root: Path) -> None:
    (root / "lib").mkdir()
    write(root, "k.glsl", '#include "lib"\n')
    with pytest.raises(StreamError, match=r"k\.glsl:1: no file 'lib'"):
        expand("k.glsl", "")


@pytest.mark.parametrize(
    ("log", "explained"),
    [
        ("0:3(5): error: oh", "lib/a.glsl:31: error: oh"),  # Mesa
        ("ERROR: 0:2: 'x' : undeclared", "ERROR: k.glsl:7: 'x' : undeclared"),  # glslang
        ("0(3) : error C1008", "lib/a.glsl:31 : error C1008"),  # NVIDIA
        ("0:31(5): error: oh", "0:31(5): error: oh"),  # no such line: left alone
    ],
)
def test_messages_of_three_drivers(log: str, explained: str) -> None:
    source = Source("", ("k.glsl (header, line 1)", "k.glsl:7", "lib/a.glsl:31"))
    assert source.explain(log) == explained


@pytest.mark.parametrize(
    ("defined", "kept"),
    [
        ({}, "none"),
        ({"A": 1}, "first"),
        ({"B": 1}, "first"),
        ({"C": 1}, "second"),
        ({"B": 1, "C": 1}, "first"),
    ],
)
def test_conditions_of_what_is_defined(root: Path, defined: dict[str, int], kept: str) -> None:
    """A file behind one that does not hold is not there, also for whoever includes it later."""
    for name in ("first", "second", "none"):
        write(root, f"lib/{name}.glsl", f"{name}\n")
    branches = (
        '#if defined(A) || (defined(B) && !defined(A))  // says why\n#include "lib/first.glsl"\n'
    )
    branches += (
        '#elif defined(C)\n#include "lib/second.glsl"\n#else\n#include "lib/none.glsl"\n#endif\n'
    )
    write(root, "all.glsl", branches + '#include "lib/second.glsl"\n')
    header = "".join(f"#define {name} {value}\n" for name, value in defined.items())
    found = expand("all.glsl", header).text.splitlines()[len(defined) :]
    assert found == [kept] + (["second"] if kept != "second" else [])


def test_conditions_of_a_driver(root: Path) -> None:
    """Versions and extensions are its own."""
    text = "#if __VERSION__ >= 420\nnew\n#else\nold\n#endif\n#if defined(GL_some)\nsome\n#endif\n"
    write(root, "all.glsl", text)
    assert expand("all.glsl", "").text == text
    write(root, "all.glsl", "#ifdef A\na\n#elif SIZE > 1\nb\n#endif\n")
    with pytest.raises(StreamError, match="SIZE > 1"):
        expand("all.glsl", "")
