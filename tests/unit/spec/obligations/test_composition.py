"""Claims about compositions: each fails where it should, and for nothing else."""

# ruff: noqa: E501  a changed line stands in one line with the claims that it fails

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.spec.flow import symbolic_paths
from aeros.spec.obligations.composition import composition_obligations
from aeros.spec.obligations.obligation import Obligation
from tests.reports_in_full import claim_lines, compare_with_section
from tests.unit.spec.obligations.data.tidier import Change, compare_reports, failed, module, site

FETCH = "{skill: fetch, on_failure: stop}\n"
SCRUB = "        - {skill: scrub, on_failure: stop}\n"
SEQ = f"        - {FETCH}"


def faults(*changes: Change) -> dict[str, str]:
    claims = list(composition_obligations(module(*changes), site()))
    compare_reports("composition_reports.txt", changes, claims)
    found = failed(claims)
    assert all(name.startswith("composition/clean/") for name in found)
    return {name.removeprefix("composition/clean/"): code for name, code in found.items()}


def test_every_claim_about_the_module_is_proved() -> None:
    assert faults() == {}


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        # A failure without declared effects; a further try is enough.
        ((FETCH, "{skill: fetch}\n"), {"fetch/handled": "AE854"}),
        ((FETCH, "{skill: fetch, retry: 1}\n"), {}),
        # A broken hold-condition is a failure too, and one of probability 0 is none.
        (("      smeared: {failure: true}\n", ""), {}),
        (("{skill: scrub, on_failure: stop}", "{skill: scrub}"), {"scrub/handled": "AE854"}),
        ((f"{SEQ}{SCRUB}", f"{SCRUB}{SEQ}"), {"scrub/ready": "AE851", "fetch/ready": "AE851"}),
        # Without the precondition the table may be tidy at the start.
        (("    precondition: not table_tidy\n    do:", "    do:"), {"fetch/ready": "AE851"}),
        (("    precondition: not table_tidy\n    do:", "    precondition: table_tidy and not table_tidy\n    do:"),
         {"can-start": "AE855"}),
        # An `if` without `else` must hold wherever it is reached.
        ((SEQ, "        - {if: not table_tidy, then: {skill: fetch, on_failure: stop}}\n"), {}),
        ((SEQ, "        - {if: person_near, then: {skill: fetch, on_failure: stop}}\n"), {"if-1/covers": "AE857"}),
        ((SEQ, "        - {if: table_tidy, then: {skill: fetch, on_failure: stop}, else: {skill: fetch, id: f, on_failure: stop}}\n"),
         {"fetch/reachable": "AE855"}),
    ],
)  # fmt: skip
def test_a_change_fails_these_claims_alone(change: Change, expected: dict[str, str]) -> None:
    assert faults(change) == expected


def test_a_guard_on_a_measurement_holds_for_the_next_step_alone() -> None:
    guarded = (
        ("precondition: inputs.gain <= 1 m", "precondition: dirt <= 50 %"),
        ("        - {skill: weigh}\n", ""),
        (
            "        - {skill: spend, inputs: {gain: {from: weigh.amount}}}\n",
            "        - if: dirt <= 40 %\n          then: {seq: [{skill: spend, inputs: {gain: 1 m}}, "
            "{skill: spend, id: more, inputs: {gain: 1 m}}]}\n          else: nothing\n",
        ),
    )
    assert faults(*guarded) == {"more/ready": "AE851"}


def test_a_handler_is_claimed_as_a_step_is() -> None:
    assert faults((FETCH, "{skill: fetch, retry: 1, between_tries: weigh}\n")) == {}
    assert faults((FETCH, "{skill: fetch, retry: 1, between_tries: scrub}\n")) == {
        "handler/scrub/ready": "AE851",
        "fetch/ready/2": "AE851",  # after it the table may be tidy
    }


def test_handlers_in_a_circle_are_refuted_and_no_path_is_explored() -> None:
    handlers = "    handlers:\n      a: {skill: fetch, retry: 1, between_tries: b}\n      b: {skill: fetch, retry: 1, between_tries: a}\n"
    changed = (
        (FETCH, "{skill: fetch, retry: 1, between_tries: a}\n"),
        ("    precondition: not table_tidy\n    do:", f"{handlers}    do:"),
    )
    assert faults(*changed) == {"handlers": "AE856"}
    claims = composition_obligations(module(*changed), site())
    assert [str(one.id) for one in claims if str(one.id).startswith("composition/clean/")][
        -1
    ] == "composition/clean/handlers"


def test_branches_that_interfere_are_not_explored() -> None:
    shared = ("        - {skill: roll}\n", "        - {skill: sweep_arm, id: again}\n")
    found = failed(composition_obligations(module(shared), site()))
    assert found == {
        "composition/both/par-1/resources/arm": "AE858",
        "composition/both/par-1/sweep_arm/again/actuators": "AE859",
    }
    names = [str(one.id) for one in composition_obligations(module(shared), site())]
    assert "composition/both/sweep_arm/reachable" not in names
    assert "composition/clean/fetch/reachable" in names


def test_a_composition_of_too_many_paths_is_refuted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(symbolic_paths, "MAX_SYMBOLIC_STATES", 1)
    assert faults_of_paths() == {"composition/clean/explored": "AE862", "composition/both/explored": "AE862"}


def faults_of_paths() -> dict[str, str]:
    return failed(composition_obligations(module(), site()))


def test_a_claim_that_differs_between_situations_is_made_of_each() -> None:
    # Whether the table is tidy, after the first step, depends on how it ended.
    unsure = (
        (
            "      missed: {failure: true, probability: 0.1}",
            "      seen: {effects: {table_tidy: true}, probability: 0.1}",
        ),
        ("precondition: fetched == sponge", "precondition: fetched == sponge and dirt < 50 %"),
    )
    claims = [
        one
        for one in composition_obligations(module(*unsure), site())
        if isinstance(one, Obligation) and "/clean/scrub/ready" in str(one.id)
    ]
    assert [str(one.id).rpartition("/")[2] for one in claims] == ["1", "2"]
    assert [one.notes for one in claims] == [
        ("after\nfetch → got\nthen fetched = sponge",),
        ("after\nfetch → seen",),
    ]


def test_a_condition_without_an_else_is_claimed_of_each_situation_that_reaches_it() -> None:
    unsure = (
        "      missed: {failure: true, probability: 0.1}",
        "      seen: {effects: {table_tidy: true}, probability: 0.1}",
    )
    condition = "        - {if: fetched == sponge and dirt < 50 %, then: {skill: weigh, id: first}}\n"
    claims = [
        one
        for one in composition_obligations(module(unsure, (SEQ, SEQ + condition)), site())
        if isinstance(one, Obligation) and "/clean/if-1/covers" in str(one.id)
    ]
    lines = "".join(f"{line}\n" for one in claims for line in claim_lines(one))
    file = Path(__file__).with_name("data") / "composition_reports.txt"
    compare_with_section(file, "a condition in two situations", lines)


def test_a_step_before_which_nothing_ran_needs_no_trace() -> None:
    (claim,) = [
        one
        for one in composition_obligations(
            module(("    precondition: not table_tidy\n    do:", "    do:")), site()
        )
        if isinstance(one, Obligation) and str(one.id).endswith("/fetch/ready")
    ]
    assert claim.notes == ()
    assert [one.label.text for one in claim.labelled_conjuncts] == ["may not hold then"]
