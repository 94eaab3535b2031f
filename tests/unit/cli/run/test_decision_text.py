"""Decisions and explanations as text, line by line."""

from __future__ import annotations

from aeros.cli.run.decision_text import decision_text, explanation_text
from aeros.runtime.gate.decision import Decision, DecisionKind, Reason
from aeros.runtime.gate.explain import EvaluatedCondition, Explanation
from aeros.skill import Action

DENIED = Decision(
    DecisionKind.DENY, None, (Reason("AE750", "separation", "too near"), Reason("AE742", "q", "used"))
)
ALLOWED = Decision(DecisionKind.ALLOW, Action("move", {"speed": 0.5, "target": (1.0, 2.0, 3.0)}), ())
PROVED = EvaluatedCondition("permission", "speed <= 1 m/s", "permission/a/move", None, {})
HOLDS = EvaluatedCondition("near", "speed <= v", None, True, {"speed": "0.5 m/s", "v": "1 m/s"})
FAILS = EvaluatedCondition("separation", "d >= 1 m", "safety/a", False, {"d": "0.5 m"})
UNKNOWN = EvaluatedCondition("sep", "d >= 1 m", "safety/b", None, {"e": "1"}, ("d", "f"))


def test_a_denial_has_each_reason_and_no_action() -> None:
    assert decision_text(DENIED) == "DENY\n  AE750 separation: too near\n  AE742 q: used"


def test_an_allowed_action_is_shown_with_its_parameters() -> None:
    assert decision_text(ALLOWED) == "ALLOW move(speed=0.5, target=(1.0, 2.0, 3.0))"
    assert decision_text(ALLOWED._replace(action=Action("stop", {}))) == "ALLOW stop()"


def test_an_explanation_names_the_layers_by_how_they_ended() -> None:
    layers = {"form": True, "overrides": True, "invariants": False, "lifecycle": None}
    assert explanation_text(Explanation(DENIED, layers), None).splitlines()[3:] == [
        "  passed: form; overrides",
        "  not passed: invariants",
        "  not known: lifecycle",
    ]
    assert (
        explanation_text(Explanation(ALLOWED, {}), None) == "ALLOW move(speed=0.5, target=(1.0, 2.0, 3.0))\n"
    )


def test_conditions_are_by_proof_or_by_value_in_columns() -> None:
    found = Explanation(ALLOWED, {"form": True}, (PROVED, HOLDS, FAILS, UNKNOWN))
    assert explanation_text(found, None).splitlines()[2:] == [
        "  proved at installation",
        "    permission  by permission/a/move",
        "  runtime-checked",
        "    near        holds    speed <= v  [speed = 0.5 m/s, v = 1 m/s]",
        "    separation  fails    d >= 1 m  [d = 0.5 m; proved by safety/a]",
        "    sep         unknown  d >= 1 m  [e = 1; no value of d, f; proved by safety/b]",
    ]


def test_a_condition_without_values_has_no_brackets_and_without_proofs_there_is_no_heading() -> None:
    bare = EvaluatedCondition("r", "true", None, True, {})
    assert explanation_text(Explanation(ALLOWED, {}, (bare,)), None).splitlines()[1:] == [
        "  runtime-checked",
        "    r  holds    true",
    ]
    assert explanation_text(Explanation(ALLOWED, {}, (PROVED,)), None).splitlines()[1:] == [
        "  proved at installation",
        "    permission  by permission/a/move",
    ]


def test_an_attenuated_action_has_conditions_of_its_own() -> None:
    text = explanation_text(Explanation(DENIED, {}, (FAILS,), (HOLDS,)), None)
    assert text.splitlines()[3:] == [
        "  runtime-checked",
        "    separation  fails    d >= 1 m  [d = 0.5 m; proved by safety/a]",
        "  re-decided after attenuation",
        "  runtime-checked",
        "    near  holds    speed <= v  [speed = 0.5 m/s, v = 1 m/s]",
    ]
    assert text.endswith("\n")
