"""Skills of a module: inputs, hold-conditions, outcomes and timeouts."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.spec.faults import messages_of_module


def test_an_input_hides_no_variable_of_the_state(tmp_path: Path) -> None:
    # `load` is a state variable; the input is `inputs.load` and clashes with nothing.
    message = messages_of_module(
        tmp_path,
        (
            "    outcomes:",
            "    inputs:\n      load: {type: real, unit: s, range: [0, 9], default: 1 s}\n    outcomes:",
        ),
        ("      wait: duration <= 10 s", "      wait: duration <= inputs.load"),
    )
    assert message == []


def test_a_hold_condition_over_too_many_combinations_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("aeros.spec.elaborate.module.action_conditions.MAX_COMBINATIONS", 5)
    edit = ("dirt <= 50 % and not person_near", "fetched == sponge and not person_near")
    (message,) = messages_of_module(tmp_path, edit, case="hold_at_the_edge")
    assert (
        message
        == "error[AE111] out-of-bounds: `hold` reads predicates with more than 5 combinations of values"
    )
    monkeypatch.setattr("aeros.spec.elaborate.module.action_conditions.MAX_COMBINATIONS", 6)
    assert messages_of_module(tmp_path / "again", edit, case="hold_at_the_edge") == []


_OUTCOME = "tidied: {effects: {table_tidy: true}}"


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        ((_OUTCOME, "tidied: {failure: true}"), "`tidy` has no outcome that is a success"),
        ((_OUTCOME, "tidied: {probability: 0.5}"), "the probabilities of `tidy` add up to 0.5, not 1"),
        ((_OUTCOME, "tidied: {duration: 31 s}"), "`tidied` lasts longer than the skill's timeout"),
        ((_OUTCOME, "tidied: {duration: -1 s}"), "a duration must not be negative"),
        ((_OUTCOME, "tidied: {effects: {dirt: 101 %}}"), "this value is outside the declared range"),
        (("timeout: 30 s", "timeout: 61 s"), "a timeout must be above 0 s and at most 60 s at this site"),
        (("timeout: 30 s", "timeout: 30 s\n    wear: -1 s"), "`wear` is at least 0 s"),
        (("resources: [arm]", "resources: [leg]"), "`leg` is neither a resource of this site nor a need"),
    ],
)
def test_a_fault_of_a_skill_is_reported(tmp_path: Path, edit: tuple[str, str], message: str) -> None:
    (found,) = messages_of_module(tmp_path, edit)
    assert message in found
