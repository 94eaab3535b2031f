"""Claims about two actions at the same time."""

# ruff: noqa: E501  a changed line stands in one line with the claims that it fails

from __future__ import annotations

from fractions import Fraction

import pytest

from aeros.spec.expr import terms as t
from aeros.spec.expr.constants import constant_term
from aeros.spec.flow.arguments import Arguments
from aeros.spec.model.composition import Step
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from aeros.spec.obligations.joint import (
    ConcurrentStep,
    joint_obligations,
    joint_policy_obligations,
    joint_variables,
)
from aeros.spec.obligations.obligation import Obligation
from tests.unit.spec.obligations.data.tidier import Change, failed, module, site

TOGETHER = "require: a.rate + b.pace_of_turn <= 0.5 rad/s"
SWEEP, SPIN = "sweep: rate <= 0.2 rad/s", "spin: pace_of_turn <= 0.3 rad/s"


@pytest.mark.parametrize(
    ("require", "expected"),
    [
        (TOGETHER, {}),
        ("require: a.rate + b.pace_of_turn < 0 rad/s", {"satisfiable": "AE601"}),
        ("require: a.rate + b.pace_of_turn <= 10 rad/s", {"effective": "AE603"}),
        ("require: a.rate + b.pace_of_turn <= 9.9 rad/s", {}),
        # Where the stop button is pressed neither is allowed alone.
        ("require: not stop_pressed or a.rate + b.pace_of_turn <= 0.5 rad/s", {"effective": "AE603"}),
    ],
)
def test_a_joint_rule_allows_some_pair_and_denies_some(require: str, expected: dict[str, str]) -> None:
    found = failed(joint_policy_obligations(site((TOGETHER, require))))
    assert {
        name.removeprefix("policy/joint/turning-together/"): code for name, code in found.items()
    } == expected


def concurrent(
    ecm: Ecm, name: str, skill: str | None = None, *, arguments: Arguments | None = None
) -> ConcurrentStep:
    skill = skill or name
    step = Step(name, skill, {}, {}, 0, None, None, ecm.skills[skill].span)
    return ConcurrentStep(name, step, ecm.skills[skill], arguments or Arguments({}, ()))


def asked(at: Site, *changes: Change, names: tuple[str, str] = ("sweep_arm", "roll")) -> list[Obligation]:
    ecm = module(*changes, at=at)
    one, other = (concurrent(ecm, name) for name in names)
    return list(joint_obligations("c", 2, at, one, other))


def test_two_envelopes_that_keep_to_the_bound_together_are_proved() -> None:
    assert failed(asked(site())) == {}
    assert failed(asked(site(), (SPIN, "spin: pace_of_turn <= 0.301 rad/s"))) == {
        "composition/c/par-2/joint/sweep_arm/roll/turning-together": "AE861"
    }


def test_either_step_may_be_in_either_role() -> None:
    names = [str(one.id) for one in asked(site(), names=("roll", "sweep_arm"))]
    assert names == ["composition/c/par-2/joint/sweep_arm/roll/turning-together"]
    both = (SWEEP, f"{SWEEP}\n      {SPIN}"), ("actuators: [arm]\n    resources: [arm]\n    risk: medium\n    timeout: 30 s\n\n  roll:",
        "actuators: [arm, turntable]\n    resources: [arm]\n    risk: medium\n    timeout: 30 s\n\n  roll:")  # fmt: skip
    ecm = module(*both)
    one, other = concurrent(ecm, "sweep_arm"), concurrent(ecm, "again", "sweep_arm")
    assert len(list(joint_obligations("c", 1, site(), one, other))) == 2
    assert len(list(joint_obligations("c", 1, site(), one, one))) == 1


def test_steps_whose_envelopes_lack_a_kind_of_the_rule_have_nothing_to_obey() -> None:
    assert asked(site(), names=("sweep_arm", "weigh")) == []
    assert asked(site(), names=("fetch", "roll")) == []


def test_an_envelope_reads_the_state_in_which_its_action_began() -> None:
    near = (SWEEP, "sweep: rate <= 0.5 rad/s and (person_near implies rate <= 0.2 rad/s)")
    rule = (TOGETHER, "require: person_near implies a.rate + b.pace_of_turn <= 0.5 rad/s")
    (claim,) = asked(site(rule), near)
    # Nobody was near when it began, and somebody is now.
    assert failed([claim]) == {str(claim.id): "AE861"}
    assert claim.notes[0].endswith("; of measured values, as they were when the action began")
    (plain,) = asked(site(rule), (SWEEP, "sweep: rate <= 0.2 rad/s"))
    assert failed([plain]) == {}
    assert plain.notes == ("`a` is the `sweep` of `sweep_arm`, `b` the `spin` of `roll`",)


def test_the_arguments_of_a_step_bound_its_actions() -> None:
    at = site()
    ecm = module((SPIN, "spin: pace_of_turn <= inputs.pace"),
                 ("  roll:\n    description: turn the table\n",
                  "  roll:\n    description: turn the table\n    inputs: {pace: {type: real, unit: rad/s, range: [0, 1]}}\n"),
                 ("{skill: roll}", "{skill: roll, inputs: {pace: 0.3 rad/s}}"))  # fmt: skip
    pace = ecm.skills["roll"].inputs["pace"]

    def claims(value: str) -> dict[str, str]:
        given = Arguments({pace.name: constant_term(Fraction(value), pace.variable.type)}, ())
        one, other = concurrent(ecm, "sweep_arm"), concurrent(ecm, "roll", arguments=given)
        return failed(joint_obligations("c", 1, at, one, other))

    assert claims("3/10") == {}
    assert list(claims("31/100").values()) == ["AE861"]


def test_the_variables_are_the_state_now_and_each_role_s_parameters_and_state_then() -> None:
    at = site()
    names = [one.name for one in joint_variables(at, at.joint_rules[0])]
    assert names[: len(at.observed_variables)] == list(at.observed_variables)
    rest = names[len(at.observed_variables) :]
    assert rest == [
        "a.rate",
        *(f"a.{name}" for name in at.state),
        "b.pace_of_turn",
        *(f"b.{name}" for name in at.state),
    ]


def test_the_conditions_at_fault_are_labelled_with_their_role() -> None:
    satisfiable, effective = list(joint_policy_obligations(site()))[:2]
    texts = ["clashes", "required by `stop-button` of `a`", "required by `stop-button` of `b`"]
    assert [one.label.text for one in satisfiable.labelled_conjuncts] == texts
    assert [one.label.text for one in effective.labelled_conjuncts] == ["", *texts[1:]]
    assert effective.conclusion == t.Not(satisfiable.conclusion)
