"""Every action of an envelope obeys the site's rules, or the gate decides the rules it may break."""

# ruff: noqa: E501  a changed line stands in one line with the claims that it fails

from __future__ import annotations

import pytest

from aeros.spec.obligations.obligation import Obligation
from aeros.spec.obligations.safety import envelope_space, is_runtime_checked, safety_obligations
from tests.unit.spec.obligations.data.tidier import Change, compare_reports, failed, module, site

BUTTON = {
    f"{name}/stop-button": "gate stop-button"
    for name in ("fetch/reach", "scrub/wipe", "scrub/approach", "weigh/wait", "spend/wait", "sweep_arm/sweep",
                 "roll/spin")
} | {"scrub/approach/slow-near-person": "gate slow-near-person"}  # fmt: skip
GATED = "    gated: [slow-near-person]\n"


def faults(*changes: Change, at: tuple[Change, ...] = ()) -> dict[str, str]:
    """Return the failures, without those that the unchanged module leaves to the gate."""
    place = site(*at)
    claims = list(safety_obligations(module(*changes, at=place), place))
    compare_reports("safety_reports.txt", (*changes, *at), claims)
    found = failed(claims)
    named = {name.removeprefix("safety/"): code for name, code in found.items()}
    return {name: code for name, code in named.items() if BUTTON.get(name) != code}


def test_rules_about_states_and_listed_ones_are_left_to_the_gate() -> None:
    found = failed(safety_obligations(module(), site()))
    assert {name.removeprefix("safety/"): code for name, code in found.items()} == BUTTON


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        # The envelope obeys each rule that constrains its actions.
        (("reach: distance(hand, goal) <= 100 mm", "reach: distance(hand, goal) <= 201 mm"), {"fetch/reach/short-reach": "AE501"}),
        (("reach: distance(hand, goal) <= 100 mm", "reach: distance(hand, goal) <= 200 mm"), {}),
        ((GATED, ""), {"scrub/approach/slow-near-person": "AE501"}),
        # It has some action, and some that is allowed.
        (("reach: distance(hand, goal) <= 100 mm", "reach: distance(hand, goal) < 0 m"),
         {"fetch/reach/not-empty": "AE503", "fetch/reach/not-dead": "AE502"}),
        (("      wipe: tool == sponge and pressure <= inputs.force\n", "      wipe: pressure > 20 N\n"),
         {"scrub/wipe/not-dead": "AE502", "scrub/wipe/pressure-of-tool": "AE501"}),
        # The permission counts, too.
        (("    wipe: pressure <= 20 N\n", "    wipe: tool == brush\n"), {"scrub/wipe/not-dead": "AE502"}),
        # The precondition can hold where the invariants do.
        (("precondition: not table_tidy\n    outcomes:", "precondition: table_tidy and not table_tidy\n    outcomes:"),
         {"fetch/can-start": "AE504"}),
        (("precondition: not table_tidy\n    outcomes:", "precondition: stop_pressed\n    outcomes:"), {"fetch/can-start": "AE504"}),
        # The hold-condition can hold at the start, and when the skill succeeds.
        (("hold: dirt < 90 %", "hold: dirt > 100 %"), {"scrub/hold": "AE510"}),
        (("hold: dirt < 90 %", "hold: dirt < 90 % and not table_tidy"), {"scrub/hold/scrubbed": "AE510"}),
        (("hold: dirt < 90 %", "hold: dirt < 90 % or not table_tidy"), {}),
        (("hold: dirt < 90 %", "hold: stop_pressed"), {"scrub/can-start": "AE504"}),
        # What is left to the gate must depend on the state.
        ((GATED, "    gated: [slow-near-person, pressure-of-tool]\n"), {"scrub/gated-pressure-of-tool": "AE506"}),
        ((GATED, "    gated: [slow-near-person, short-waits]\n"), {"scrub/gated-short-waits": "AE506"}),
        ((GATED, "    gated: [slow-near-person, stop-button]\n"), {}),
        # The goal holds in some state and not in all.
        (("goal: table_tidy", "goal: dirt > 100 %"), {"goal/tidy_up": "AE507"}),
        (("goal: table_tidy", "goal: dirt <= 100 %"), {"goal/tidy_up/effective": "AE508"}),
    ],
)  # fmt: skip
def test_a_change_of_the_module_fails_these_claims_alone(change: Change, expected: dict[str, str]) -> None:
    assert faults(change) == expected


def test_a_rule_that_reads_a_state_that_never_matters_cannot_be_left_to_the_gate() -> None:
    soft = (
        "require: person_near implies pace <= slow",
        "require: pace <= 0.3 m/s or (person_near and pace > 9 m/s)",
    )
    place = (soft, ('attenuate: {pace: "min(pace, slow)"}', ""))
    assert faults(at=place) == {"scrub/gated-slow-near-person/approach": "AE506"}


def test_a_rule_about_states_for_exactly_these_actions_bounds_the_start() -> None:
    calm = "  - id: calm\n    on: [reach]\n    require: not person_near\n    rationale: a test\n    source: a test\n"
    place = (("invariants:\n", f"invariants:\n{calm}"),)
    near = ("precondition: not table_tidy\n    outcomes:", "precondition: person_near\n    outcomes:")
    assert faults(near) == {}
    assert faults(near, at=place) == {"fetch/can-start": "AE504", "fetch/reach/calm": "gate calm"}


def test_a_success_that_never_happens_may_contradict_the_hold_condition() -> None:
    hold = ("hold: dirt < 90 %", "hold: not table_tidy")
    never = (
        "scrubbed: {effects: {table_tidy: true}}",
        "scrubbed: {effects: {table_tidy: true}, probability: 0}\n      idle: {}",
    )
    assert "scrub/hold/scrubbed" in faults(hold)
    assert "scrub/hold/scrubbed" not in faults(hold, never)


def test_the_gate_may_decide_rules_about_states_and_listed_rules_that_read_the_state() -> None:
    place = site()
    rules = {one.id: one for one in place.rules}
    scrub, plain = module().skills["scrub"], module((GATED, "")).skills["scrub"]
    assert is_runtime_checked(rules["stop-button"], plain, "wipe")
    assert is_runtime_checked(rules["slow-near-person"], scrub, "approach")
    assert not is_runtime_checked(rules["slow-near-person"], plain, "approach")
    listed = module((GATED, "    gated: [pressure-of-tool]\n")).skills["scrub"]
    assert not is_runtime_checked(rules["pressure-of-tool"], listed, "wipe")


def test_the_space_of_an_envelope_is_every_state_input_and_parameter_it_admits() -> None:
    place = site()
    scrub = module().skills["scrub"]
    clause = scrub.envelope["wipe"]
    space = envelope_space(place, scrub, "wipe", clause)
    assert [one.name for one in space.variables] == [
        *place.observed_variables,
        "inputs.force",
        "tool",
        "pressure",
    ]
    assert space.assumptions == (clause.term,)


def test_a_goal_that_never_or_always_holds_is_shown_where_it_is_written() -> None:
    for text, words in (("dirt > 100 %", "never true"), ("dirt <= 100 %", "always true")):
        claims = safety_obligations(module(("goal: table_tidy", f"goal: {text}")), site())
        places = [one.primary for one in claims if isinstance(one, Obligation) and "/goal/" in str(one.id)]
        assert {one.span.text for one in places} == {text}
        assert words in [one.text for one in places]
