"""Conditions speak of a scene by dotted names."""

from __future__ import annotations

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import Source
from aeros.spec.expr.terms import variables_of
from aeros.spec.model.scene import BodyPart, SceneCondition
from aeros.spec.scenes.conditions import (
    SceneScope,
    is_membership,
    membership,
    region_names,
    resolve_part,
)
from aeros.spec.text.fields import ExpressionField, TextField
from aeros.spec.text.nodes import ScalarNode
from aeros.spec.text.yaml_reader import read_yaml
from tests.shipped_scenes import shipped_scene


def scalar(text: str) -> ScalarNode:
    node = read_yaml(Source("scene.yaml", text), Diagnostics())
    assert isinstance(node, ScalarNode)
    return node


def elaborated(name: str, text: str) -> tuple[SceneCondition | None, Diagnostics]:
    diagnostics = Diagnostics()
    node = scalar(text)
    expression = ExpressionField(node.text, node.span, node)
    return SceneScope(shipped_scene(name), diagnostics).condition(expression), diagnostics


@pytest.mark.parametrize(
    ("text", "variables"),
    [
        ("wrapper.fold > 1 rad", {"wrapper.fold"}),
        ("press.handle.position.z > 1 m", {"press.handle.position"}),
        ("filling.position in plate and wrapper.position not in pot",
         {"filling.position in plate", "wrapper.position in pot"}),
        ("press_force > 1 N or dough", {"press_force", "dough"}),
        ("cooking > 1 s and cooking.longest > 2 s", {"cooking", "cooking.longest"}),
        ("robot.tool.z > 1 m and not filling.held", {"robot.tool", "filling.held"}),
        ("pot_position in plate", {"pot_position in plate"}),
        ("cooking > 1 s and closed", {"cooking", "closed"}),
    ],
)  # fmt: skip
def test_names_are_those_of_bodies_links_joints_and_the_rest(text: str, variables: set[str]) -> None:
    condition, diagnostics = elaborated("dumpling_bench", text)
    assert list(diagnostics) == []
    assert condition is not None
    assert set(variables_of(condition.term)) == variables
    assert condition.text == text


@pytest.mark.parametrize(
    ("text", "underlined", "help_"),
    [
        ("wrapper.fald > 1 rad", "fald", "did you mean `wrapper.fold`?"),
        ("filling.position in pott", "pott", "did you mean `pot`?"),
        ("wrapper.fold in pot", "wrapper.fold", "a place, or a body's"),
    ],
)
def test_an_unknown_name_is_underlined(text: str, underlined: str, help_: str) -> None:
    condition, diagnostics = elaborated("dumpling_bench", text)
    assert condition is None
    (found,) = diagnostics
    assert found.code == "AE202"
    assert found.primary is not None
    span = found.primary.span
    assert span.source.text[span.start : span.end] == underlined
    assert found.help[0].startswith(help_)


def test_coatings_are_a_share() -> None:
    condition, _ = elaborated("table", "dirt.wiped >= 0.95")
    assert condition is not None
    assert elaborated("table", "dirt.wiped >= 1 m")[0] is None
    part, _ = elaborated("table", "dirt.left_half.wiped >= 0.95")
    assert part is not None
    assert set(variables_of(part.term)) == {"dirt.left_half.wiped"}
    assert elaborated("table", "dirt.lower_half.wiped >= 0.95")[0] is None


def test_a_membership_is_a_name_of_two_parts() -> None:
    assert is_membership("can.position in pot")
    assert not is_membership("can.position")
    assert membership("can.position in pot") == ("can.position", "pot")
    assert set(region_names(shipped_scene("dumpling_bench"))) == {
        "aligned",
        "on_press",
        "plate",
        "plate_2",
        "pot",
    }


def test_a_new_name_is_known_to_the_conditions_after_it() -> None:
    diagnostics = Diagnostics()
    scope = SceneScope(shipped_scene("bare"), diagnostics)
    node = scalar("ready and waiting.longest > 1 s")
    expression = ExpressionField(node.text, node.span, node)
    assert scope.condition(expression) is None
    scope.add_condition("ready")
    scope.add_timer("waiting")
    assert scope.condition(expression) is not None


@pytest.mark.parametrize(
    ("text", "what", "part"),
    [
        ("wrapper", "link", BodyPart("wrapper")),
        ("wrapper.plate_b", "link", BodyPart("wrapper", "plate_b")),
        ("wrapper.fold", "joint", BodyPart("wrapper", "fold")),
        ("wrapper", "joint", None),
        ("wrapper.fold", "link", None),
        ("wrap", "link", None),
        ("tray.top", "link", None),
    ],
)
def test_a_part_is_a_body_a_link_or_a_joint(text: str, what: str, part: BodyPart | None) -> None:
    diagnostics = Diagnostics()
    node = scalar(text)
    bodies = shipped_scene("dumpling_bench").bodies
    assert resolve_part(TextField(node.text, node.span, node), bodies, what, diagnostics) == part
    assert [one.code for one in diagnostics] == ([] if part else ["AE122"])


@pytest.mark.parametrize(
    ("text", "is_number"), [("dirt.wiped >= 0.5", False), ("if dirt.wiped > 0 then 1 else 0", True)]
)
def test_a_truth_is_a_condition_or_a_number(text: str, is_number: bool) -> None:
    node = scalar(text)
    diagnostics = Diagnostics()
    found = SceneScope(shipped_scene("table"), diagnostics).truth(ExpressionField(text, node.span, node))
    assert found is not None
    assert (found.is_number, list(diagnostics)) == (is_number, [])


def test_a_truth_that_is_neither_is_reported_as_a_condition() -> None:
    node = scalar("cube.position")
    diagnostics = Diagnostics()
    scope = SceneScope(shipped_scene("table"), diagnostics)
    assert scope.truth(ExpressionField(node.text, node.span, node)) is None
    assert [one.code for one in diagnostics] == ["AE203"]
