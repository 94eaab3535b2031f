"""Wrong arguments of the public names are refused with the argument's name and what it should be."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import aeros
from aeros.session.argument_checks import (
    as_path,
    as_paths,
    require_members,
    require_one_of,
    require_text,
    require_whole_number,
)
from aeros.spec.diagnostics.errors import MisuseError


def test_texts_and_paths_are_paths() -> None:
    assert as_path("out", "a/b") == as_path("out", Path("a/b")) == Path("a/b")
    assert (
        as_paths("out", "a/b") == as_paths("out", ["a/b"]) == as_paths("out", (Path("a/b"),)) == [Path("a/b")]
    )
    for wrong in ([], ["a", 3], [["a"]], None):
        with pytest.raises(MisuseError, match="`out` is"):
            as_paths("out", wrong)


@pytest.mark.parametrize("value", [None, 3, b"a", ["a"]])
def test_nothing_else_is_a_path(value: Any) -> None:
    with pytest.raises(MisuseError, match=r"^`out` is .*; give a path, as str or pathlib\.Path$"):
        as_path("out", value)


def test_a_near_miss_is_named() -> None:
    require_one_of("plant", "physics", ("physics", "symbolic"))
    with pytest.raises(MisuseError, match=r"^there is no plant `phyics`; did you mean `physics`\?$"):
        require_one_of("plant", "phyics", ("physics", "symbolic"))
    with pytest.raises(MisuseError, match=r"^the plant is None; there are physics, symbolic$"):
        require_one_of("plant", None, ("physics", "symbolic"))


@pytest.mark.parametrize("value", [-1, 1.0, True, "1", None])
def test_only_whole_numbers_from_0_on_are_whole_numbers(value: Any) -> None:
    require_whole_number("seed", 0)
    with pytest.raises(MisuseError, match=r"^`seed` is .*; give a whole number, 0 or more$"):
        require_whole_number("seed", value)


def test_an_object_without_a_member_and_a_class_are_refused() -> None:
    require_members("plant", Path("x"), ("name",), "Path")
    with pytest.raises(MisuseError, match=r"^`plant` is None; give a `Path`, which has `name`$"):
        require_members("plant", None, ("name",), "Path")
    with pytest.raises(MisuseError, match=r"^`plant` is the class `Path`; give an instance of `Path`$"):
        require_members("plant", Path, ("name",), "Path")


def test_a_text_is_required() -> None:
    require_text("skill", "wrap")
    with pytest.raises(MisuseError, match=r"^`skill` is an object of type `int`; give a str$"):
        require_text("skill", 3)


def _opened(*arguments: Any, **options: Any) -> None:
    with aeros.open_session(*arguments, **options):
        pytest.fail("it opened")


@pytest.mark.parametrize(
    "call",
    [
        lambda wrong: aeros.verify(),
        lambda wrong: aeros.verify(wrong),
        lambda wrong: aeros.verify("ecms/clean_table", site=wrong),
        lambda wrong: aeros.load_gate(wrong),
        lambda wrong: aeros.load_gate("ecms/clean_table", skill=wrong, mode=wrong),
        lambda wrong: aeros.load_gate("ecms/clean_table", site=wrong),
        lambda wrong: _opened(wrong),
        lambda wrong: _opened("ecms/clean_table", plant=wrong),
        lambda wrong: _opened("ecms/clean_table", site=wrong),
        lambda wrong: _opened("ecms/clean_table", seed=wrong),
        lambda wrong: _opened("ecms/clean_table", gate=wrong),
        lambda wrong: _opened("ecms/clean_table", out=wrong),
        lambda wrong: _opened("ecms/clean_table", state=wrong),
        lambda wrong: aeros.check_conformance(wrong),
    ],
)
def test_every_public_name_refuses_an_object_of_another_type(call: Callable[[Any], Any]) -> None:
    with pytest.raises(MisuseError):
        call(object())
