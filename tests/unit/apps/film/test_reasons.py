"""Reasons and actions are told in one short sentence."""

from __future__ import annotations

import pytest

from aeros.apps.film.reasons import action_text, in_words, reason_text
from aeros.apps.rule_causes import RuleCause, Shortfall

NEAR = Shortfall("human_distance", 0.61, 0.89, False, "m")
FAST = Shortfall("speed", 0.45, 0.2, True, "m/s")
HARD = Shortfall("contact_force", 70.0, 65.0, True, "N")


@pytest.mark.parametrize(
    ("causes", "text"),
    [
        ([], ""),
        ([RuleCause("arm-standing", "", (NEAR,))], "person at 0.61 m, 0.89 m needed"),
        (
            [RuleCause("reduced-speed", "", (NEAR._replace(value=1.6, bound=2.3), FAST))],
            "person first at 1.60 m: speed 0.20 in place of 0.45 m/s",
        ),
        ([RuleCause("force", "", (HARD,))], "contact force 70 N, at most 65 N needed"),
        ([RuleCause("workspace", "target in bench", ())], "workspace: target in bench"),
        ([RuleCause("quota", "", ())], "quota"),
        ([RuleCause("quota", "", ()), RuleCause("a", "", (NEAR,))], "person at 0.61 m, 0.89 m needed"),
    ],
)
def test_a_reason_has_the_value_and_its_bound(causes: list[RuleCause], text: str) -> None:
    assert reason_text(causes) == text


def test_the_text_of_an_action_has_the_allowed_speed() -> None:
    assert action_text("move_tool", {"speed": 0.45}, {"speed": 0.2}) == "move tool at 0.20 m/s"
    assert action_text("move_tool", {"speed": 0.45}, {}) == "move tool at 0.45 m/s"
    assert action_text("look", {}, {"camera": "overhead"}) == "look with camera overhead"
    assert action_text("grip", {}, {"width": 0.1}) == "grip"
    assert in_words("make_dumplings.press_force") == "press force"
