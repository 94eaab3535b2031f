"""Quantities of a scene are bounded, in SI, and one that is malformed is reported and counts as 1."""

from __future__ import annotations

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import Source
from aeros.spec.scenes.quantities import Quantities
from aeros.spec.text.fields import TextField
from aeros.spec.text.nodes import ScalarNode
from aeros.spec.text.yaml_reader import read_yaml


def field(text: str) -> TextField:
    node = read_yaml(Source("scene.yaml", text), Diagnostics())
    assert isinstance(node, ScalarNode)
    return TextField(node.text, node.span, node)


@pytest.mark.parametrize(
    ("kind", "text", "value", "code"),
    [
        ("coordinate", "-10 m", -10.0, None),
        ("coordinate", "10.1 m", 1.0, "AE111"),
        ("coordinate", "1 s", 1.0, "AE204"),
        ("distance", "0 m", 0.0, None),
        ("distance", "-1 mm", 1.0, "AE111"),
        ("angle", "180 deg", 3.14159265, None),
        ("angle", "8 rad", 1.0, "AE111"),
        ("mass", "80 g", 0.08, None),
        ("mass", "0 g", 1.0, "AE111"),
        ("force", "1 N", 1.0, None),
        ("force", "-1 N", 1.0, "AE111"),
    ],
)
def test_a_quantity_is_within_its_bounds(kind: str, text: str, value: float, code: str | None) -> None:
    diagnostics = Diagnostics()
    assert getattr(Quantities(diagnostics), kind)(field(text)) == pytest.approx(value)
    assert [one.code for one in diagnostics] == ([] if code is None else [code])


def test_an_absent_quantity_is_0() -> None:
    number = Quantities(Diagnostics())
    assert (number.point(None), number.spread(None)) == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert (number.distance(None), number.angle(None), number.mass(None)) == (0.0, 0.0, 0.0)
    assert number.joint_friction(None, "revolute") == 0.0


def test_lengths_of_a_body_are_at_least_a_millimetre() -> None:
    diagnostics = Diagnostics()
    number = Quantities(diagnostics)
    assert number.edges([field("1 mm"), field("2 cm"), field("3 m")]) == (0.001, 0.02, 3.0)
    assert number.pair([field("1 mm"), field("0.9 mm")]) == (0.001, 1.0)
    assert [one.code for one in diagnostics] == ["AE111"]


@pytest.mark.parametrize(
    ("text", "kind", "code"),
    [
        ("5 mN*m", "revolute", None),
        ("5 mN", "prismatic", None),
        ("5 mN", "continuous", "AE204"),
        ("5 mN*m", "prismatic", "AE204"),
    ],
)
def test_dry_friction_is_a_torque_or_of_a_slider_a_force(text: str, kind: str, code: str | None) -> None:
    diagnostics = Diagnostics()
    value = Quantities(diagnostics).joint_friction(field(text), kind)
    assert value == (0.005 if code is None else 1.0)
    assert [one.code for one in diagnostics] == ([] if code is None else [code])


def test_a_joints_position_is_an_angle_or_of_a_slider_a_length() -> None:
    number = Quantities(Diagnostics())
    assert number.joint_position(field("90 deg"), "revolute") == pytest.approx(1.5707963)
    assert number.joint_position(field("5 cm"), "prismatic") == 0.05


def test_an_inconsistency_is_reported_with_its_cure() -> None:
    diagnostics = Diagnostics()
    Quantities(diagnostics).report("two shapes", field("1 m").span, "remove one")
    (found,) = diagnostics
    assert (found.code, found.headline, found.help) == ("AE208", "two shapes", ("remove one",))
