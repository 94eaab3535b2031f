"""Parameters of tasks: their types, values, defaults and names."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.elaborate.task_parameters import patterns_of
from aeros.spec.expr.types import EnumType
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.text.fields import TextField
from aeros.spec.text.nodes import ScalarNode
from tests.unit.agent.dumplings import SPAN
from tests.unit.spec.faults import CORPUS, TABLE, messages_of_module, messages_of_site

NODE = ScalarNode("", SPAN)
CASE = "task_with_a_side_and_a_number"
SIDE = "values: {near: {words: [near side]}, far: {words: [far side]}}\n        default: near"
TIMES = 'times: {type: int, range: [1, 3], default: "1"}'


def test_a_parameter_is_a_variable_of_the_module_that_an_instruction_sets() -> None:
    site = load_site(TABLE, Diagnostics())
    assert site is not None
    loaded = load_ecm(CORPUS / "accepted" / CASE, site, Diagnostics())
    assert loaded is not None
    parameters = loaded.ecm.tasks["fetch"].parameters
    assert list(parameters) == ["wanted", "side", "times"]
    assert parameters["wanted"].default is None
    assert parameters["wanted"].phrases == {one: (one,) for one in ("sponge", "brush", "knife")}
    assert parameters["side"].declared.variable.type == EnumType(f"{CASE}.side", ("near", "far"))
    assert parameters["side"].phrases == {"near": ("near side",), "far": ("far side",)}
    assert (parameters["times"].default, parameters["times"].declared.range) == (
        1,
        (Fraction(1), Fraction(3)),
    )
    assert loaded.ecm.state[f"{CASE}.side"].max_age == 1


@pytest.mark.parametrize(
    ("edit", "found"),
    [
        ((SIDE, SIDE.replace("default: near", "default: middle")), "AE202"),
        ((TIMES, 'times: {type: int, range: [1, 3], default: "4"}'), "AE111"),
        ((TIMES, "times: {type: int}"), "AE208"),
        ((TIMES, "times: {type: vec3, unit: m, range: [0, 1]}"), "AE208"),
        ((TIMES, "times: {type: number}"), "AE122"),
        ((TIMES, "dirt: {type: bool}"), "AE121"),
        ((TIMES, "if: {type: bool}"), "AE121"),
        ((SIDE, "type: tools\n        " + SIDE), "AE102"),
        ((SIDE, "range: [0, 1]\n        " + SIDE), "AE102"),
        ((SIDE, "unit: m\n        " + SIDE), "AE102"),
        ((SIDE, SIDE.replace("far: {", "slow: {")), "AE121"),
        ((SIDE, SIDE.replace("[near side]", "['?']")), "AE112"),
    ],
)
def test_faults_of_a_parameter(tmp_path: Path, edit: tuple[str, str], found: str) -> None:
    messages = messages_of_module(tmp_path, edit, case=CASE)
    assert any(one.startswith(f"error[{found}]") for one in messages), messages


def test_two_tasks_may_share_a_parameter_that_they_declare_alike(tmp_path: Path) -> None:
    again = """  bring:
    description: another task
    words: [carry]
    parameters:
      times: {type: int, range: [1, 3], default: "1"}
    goal: fetched == sponge
    rules:
      - {unless: fetched == sponge, do: fetch_sponge}

permissions:
"""
    assert messages_of_module(tmp_path / "alike", ("permissions:\n", again), case=CASE) == []
    other = again.replace("[1, 3]", "[1, 4]")
    (message,) = messages_of_module(tmp_path / "other", ("permissions:\n", other), case=CASE)
    assert "`times` is declared otherwise by another task of this module" in message


BEFORE = "\nenums:\n"


def messages(tmp_path: Path, kind: str) -> list[str]:
    return messages_of_site(tmp_path, (BEFORE, f"\nobjects:\n  cup: {kind}\n{BEFORE}"))


def test_objects_of_the_reference_site_are_the_members_of_an_enum() -> None:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    assert site.enums["objects"].members == tuple(site.objects)
    can, block = site.objects["red_can"], site.objects["blue_block"]
    assert can.for_perceivers() == {"shape": "cylinder", "size": (0.022, 0.08), "colour": (0.8, 0.1, 0.08)}
    assert (block.shape, block.size) == ("box", (0.04, 0.04, 0.05))
    assert "red can" in can.phrases


@pytest.mark.parametrize(
    ("kind", "found"),
    [
        ("{words: [Cup]}", []),
        ("{words: []}", ["error[AE112] wrong-length: no word asks for `cup`"]),
        ("{words: ['!']}", ["error[AE112] wrong-length: `!` has no word"]),
        (
            "{words: [cup], box: [1 cm, 1 cm]}",
            ["error[AE112] wrong-length: a box has 3 lengths, not 2"],
        ),
        (
            "{words: [cup], box: [1 cm, 1 cm, 1 cm], cylinder: [1 cm, 1 cm]}",
            ["error[AE102] missing-field: `cup` has either `box` or `cylinder`"],
        ),
        (
            "{words: [cup], cylinder: [0 m, 3 m]}",
            ["error[AE111] out-of-bounds: a length is above 0 m and at most 2 m"] * 2,
        ),
        (
            "{words: [cup], colour: [1, 2, 0]}",
            ["error[AE111] out-of-bounds: a colour is red, green and blue, each from 0 to 1"],
        ),
    ],
)
def test_faults_of_an_object(tmp_path: Path, kind: str, found: list[str]) -> None:
    assert messages(tmp_path, kind) == found


def test_an_object_has_a_name_that_nothing_else_has(tmp_path: Path) -> None:
    (message,) = messages_of_site(tmp_path, (BEFORE, f"\nobjects:\n  sponge: {{words: [sponge]}}\n{BEFORE}"))
    assert "`sponge` is already" in message


@pytest.mark.parametrize(
    ("text", "headline"),
    [
        (
            "to (the tray",
            "the brackets of `to (the tray` are not closed, nested, empty or stand for too many",
        ),
        ("(to me)", "`(to me)` may have no word"),
    ],
)
def test_optional_words_have_closed_brackets_and_leave_a_word(text: str, headline: str) -> None:
    diagnostics = Diagnostics()
    patterns_of([TextField(text, SPAN, NODE)], diagnostics)
    assert [(one.code, one.headline) for one in diagnostics] == [("AE112", headline)]


def test_phrases_with_optional_words_keep_their_brackets() -> None:
    diagnostics = Diagnostics()
    assert patterns_of([TextField("Into (two) trays", SPAN, NODE)], diagnostics) == ("into (two) trays",)
    assert not list(diagnostics)
