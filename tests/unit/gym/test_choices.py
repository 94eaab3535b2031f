"""Action spaces: numbers from -1 to 1 stand for bounds, and what a rule says is what a skill gets."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium import spaces

from aeros.gym.choices import RequestDecoder, SkillChoice, SkillDecoder, skill_choices
from aeros.spec.diagnostics.errors import MisuseError
from tests.modules.robot import configuration_of

_NAME = "make_dumplings"


def _choices() -> tuple[SkillChoice, ...]:
    modules = configuration_of(_NAME).modules
    return skill_choices(modules, _NAME, modules[_NAME].tasks[_NAME])


def _prepare() -> SkillChoice:
    return next(one for one in _choices() if one.name == "make_dumplings.prepare")


def test_a_choice_is_a_skill_with_the_inputs_of_its_rule_or_its_defaults() -> None:
    decoder = SkillDecoder(_choices(), {}, with_inputs=False)
    assert isinstance(decoder.space, spaces.Discrete)
    step = decoder.decode(np.int64(2))
    assert step.choice.name == "make_dumplings.prepare"
    assert step.inputs == {"hand_speed": pytest.approx(0.45)}
    assert step.request is None


@pytest.mark.parametrize(("chosen", "speed"), [(-1.0, 0.15), (0.0, 0.315), (1.0, 0.48)])
def test_an_input_is_chosen_within_its_range(chosen: float, speed: float) -> None:
    decoder = SkillDecoder(_choices(), {}, with_inputs=True)
    action = {**decoder.space.sample(), "skill": np.int64(2)}
    action["make_dumplings.prepare.hand_speed"] = np.array([chosen])
    assert decoder.decode(action).inputs == {"hand_speed": pytest.approx(speed, abs=1e-12)}


def test_bounds_are_given_exactly() -> None:
    bounds = {"move_tool.target": ((0.1, 0.2, 0.3), (0.4, 0.5, 0.7)), "move_tool.speed": (0.1, 0.3)}
    decoder = RequestDecoder(_prepare(), configuration_of(_NAME).site.kinds, bounds)
    assert decoder.kind_names == ("move_tool", "grip", "look")
    for sign, target, speed in ((-1.0, (0.1, 0.2, 0.3), 0.1), (1.0, (0.4, 0.5, 0.7), 0.3)):
        action = {**decoder.space.sample(), "kind": np.int64(0), "move_tool.target": np.full(3, sign)}
        request = decoder.decode({**action, "move_tool.speed": np.array([sign])}).request
        assert request is not None
        assert (request.kind, request.parameters["target"], request.parameters["speed"]) == (
            "move_tool",
            target,
            speed,
        )


def test_a_member_of_an_enum_is_chosen_by_its_number() -> None:
    decoder = RequestDecoder(_prepare(), configuration_of(_NAME).site.kinds, {})
    action = {**decoder.space.sample(), "kind": np.int64(2), "look.camera": np.int64(2)}
    request = decoder.decode(action).request
    assert request is not None
    assert (request.kind, request.parameters) == ("look", {"camera": "overhead"})


@pytest.mark.parametrize(
    ("bounds", "text"),
    [
        ({"move_tool.speeed": (0.0, 1.0)}, "did you mean `move_tool.speed`"),
        ({"move_tool.speed": (0.3, 0.1)}, r"the bounds of `move_tool.speed` are \(0.3, 0.1\)"),
        ({"move_tool.target": (-20.0, 0.0)}, r"within \[-10, 10\]"),
        ({"move_tool.target": ((0.0, 0.0), (1.0, 1.0))}, "numbers or triples"),
        ({"look.camera": (0.0, 1.0)}, "no real number"),
    ],
)
def test_wrong_bounds_are_refused(bounds: dict[str, tuple[Any, Any]], text: str) -> None:
    with pytest.raises(MisuseError, match=text):
        RequestDecoder(_prepare(), configuration_of(_NAME).site.kinds, bounds)
