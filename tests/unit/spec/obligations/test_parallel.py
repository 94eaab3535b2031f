"""Branches that run at the same time share nothing that only one may use."""

# ruff: noqa: E501  a changed line stands in one line with the claims that it fails

from __future__ import annotations

from dataclasses import replace

import pytest

from aeros.spec.obligations.parallel import interference_claims, parallel_obligations
from tests.unit.spec.obligations.data.tidier import Change, compare_reports, failed, module, site

BRANCHES = "        - {skill: sweep_arm}\n        - {skill: roll}\n"
PAR = f"      par:\n{BRANCHES}"
STILL = "  weigh:\n    description: measure the load\n"


def par(*branches: str) -> Change:
    return BRANCHES, "".join(f"        - {one}\n" for one in branches)


def faults(*changes: Change) -> dict[str, str]:
    ecm = module(*changes)
    composition = ecm.compositions["both"]
    claims = list(parallel_obligations(composition, ecm, site()))
    compare_reports("parallel_reports.txt", changes, claims)
    found = failed(claims)
    without_solver = failed(interference_claims(composition, ecm.skills, site()))
    assert without_solver == {name: code for name, code in found.items() if code != "AE861"}
    return {name.removeprefix("composition/both/"): code for name, code in found.items()}


def test_branches_that_share_nothing_are_proved() -> None:
    assert faults() == {}


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (par("{skill: sweep_arm}", "{skill: sweep_arm, id: again}"),
         {"par-1/resources/arm": "AE858", "par-1/sweep_arm/again/actuators": "AE859"}),
        (par("{skill: weigh}", "{skill: weigh, id: again}"), {}),
        # One after the other, or either of two, holds the arm once.
        (par("{seq: [{skill: sweep_arm}, {skill: sweep_arm, id: again}]}", "{skill: roll}"), {}),
        (par("{if: person_near, then: {skill: sweep_arm}, else: {skill: sweep_arm, id: again}}", "{skill: roll}"), {}),
        # A handler may run wherever its step does.
        (par("{skill: weigh, retry: 1, between_tries: sweep_arm}", "{skill: sweep_arm, id: again}"),
         {"par-1/resources/arm": "AE858", "par-1/weigh/again/actuators": "AE859"}),
        # What one branch sets, the other may not read in a precondition, a hold-condition, a guard or an envelope.
        (par("{skill: fetch, on_failure: stop}", "{if: fetched == sponge, then: {skill: roll}, else: nothing}"),
         {"par-1/fetch/roll/effects": "AE860"}),
        (par("{if: table_tidy, then: {skill: weigh}, else: nothing}", "{skill: scrub, on_failure: stop}"),
         {"par-1/weigh/scrub/effects": "AE860"}),
        (par("{skill: fetch, on_failure: stop}", "{hold: fetched == brush, part: {skill: roll}, on_failure: stop}"),
         {"par-1/fetch/roll/effects": "AE860"}),
        (par("{if: dirt > 1 %, then: {skill: weigh}, else: nothing}", "{skill: scrub, on_failure: stop}"), {}),
    ],
)  # fmt: skip
def test_branches_that_share_something_are_refuted(change: Change, expected: dict[str, str]) -> None:
    assert faults(change) == expected


def test_each_part_of_a_skill_that_reads_the_state_counts() -> None:
    branches = par("{skill: fetch, on_failure: stop}", "{skill: weigh}")
    for line in ("precondition: fetched != knife", "hold: fetched != knife"):
        changed = (STILL, f"{STILL}    {line}\n")
        assert faults(branches, changed) == {"par-1/fetch/weigh/effects": "AE860"}
    envelope = ("envelope:\n      wait: duration <= 10 s\n    outputs",
                "envelope:\n      wait: fetched != knife and duration <= 10 s\n    outputs")  # fmt: skip
    assert faults(branches, envelope) == {"par-1/fetch/weigh/effects": "AE860"}


def test_two_branches_that_set_the_same_are_refuted_and_what_never_happens_is_not_set() -> None:
    branches = par("{skill: fetch, on_failure: stop}", "{skill: weigh}")
    certain = ("      weighed: {}\n", "      weighed: {effects: {fetched: brush}}\n")
    assert faults(branches, certain) == {"par-1/fetch/weigh/effects": "AE860"}
    never = (
        "      weighed: {}\n",
        "      weighed: {probability: 1}\n      odd: {effects: {fetched: brush}, probability: 0}\n",
    )
    assert faults(branches, never) == {}


def test_the_place_that_is_reported_is_the_first_that_reads() -> None:
    ecm = module(
        par("{skill: fetch, on_failure: stop}", "{if: fetched == sponge, then: {skill: roll}, else: nothing}")
    )
    (claim,) = [
        one
        for one in interference_claims(ecm.compositions["both"], ecm.skills, site())
        if one.diagnostic is not None
    ]
    assert claim.diagnostic is not None
    assert claim.diagnostic.primary is not None
    assert claim.diagnostic.primary.text == "`fetch` may set it"
    assert [one.text for one in claim.diagnostic.secondary] == ["read here"]


def test_a_resource_of_several_is_used_up_by_one_branch_too_many() -> None:
    lent = [
        (
            "    risk: low\n    timeout: 30 s\n\n  spend:",
            "    resources: [camera]\n    risk: low\n    timeout: 30 s\n\n  spend:",
        )
    ]
    two = ["{skill: weigh}", "{skill: weigh, id: second}"]
    assert faults(*lent, par(*two)) == {}
    assert faults(*lent, par(*two, "{skill: weigh, id: third}")) == {"par-1/resources/camera": "AE858"}
    inner = "{par: [{skill: weigh, id: second}, {skill: weigh, id: third}]}"
    assert faults(*lent, par("{skill: weigh}", inner)) == {"par-1/resources/camera": "AE858"}


def test_a_branch_that_needs_too_much_by_itself_is_reported_at_the_par_inside_it() -> None:
    inner = "{par: [{skill: sweep_arm, id: second}, {skill: sweep_arm, id: third}]}"
    found = faults(par("{skill: sweep_arm}", inner))
    assert "par-1/resources/arm" not in found
    assert found["par-2/resources/arm"] == "AE858"


def test_joint_rules_are_claimed_of_each_two_steps_once() -> None:
    fast = ("spin: pace_of_turn <= 0.3 rad/s", "spin: pace_of_turn <= 0.4 rad/s")
    pairs = par("{seq: [{skill: sweep_arm}, {skill: sweep_arm, id: again}]}", "{skill: roll}")
    assert faults(fast, pairs) == {
        f"par-1/joint/{name}/roll/turning-together": "AE861" for name in ("sweep_arm", "again")
    }
    handled = par(
        "{skill: sweep_arm, retry: 1, between_tries: roll}", "{skill: weigh, retry: 1, between_tries: roll}"
    )
    found = faults(fast, handled)
    assert found["par-1/joint/sweep_arm/handler-roll/turning-together"] == "AE861"
    assert found["par-1/sweep_arm/weigh/actuators"] == "AE859"


def test_resources_that_both_branches_use_are_shown_in_each() -> None:
    ecm = module(par("{skill: sweep_arm}", "{skill: sweep_arm, id: again}"))
    claims = interference_claims(ecm.compositions["both"], ecm.skills, site())
    reported = [one.diagnostic for one in claims if one.diagnostic is not None]
    texts = [
        (one.primary.text if one.primary else "", *(two.text for two in one.secondary)) for one in reported
    ]
    assert texts == [("holds `arm`", "holds `arm`"), ("moves `arm`", "moves it too")]
    assert reported[0].headline == "these branches need 2 of `arm` at the same time; the site has 1"


def test_a_value_that_follows_in_one_branch_may_be_moved_by_the_other() -> None:
    # At the end either branch may have been the last.
    ecm = module()
    skills = dict(ecm.skills)
    (ended,) = (id_ for id_, one in skills["roll"].outcomes.items() if not one.failure)
    outcomes = dict(skills["roll"].outcomes)
    for value, expected in ((None, {}), (False, {"AE860"})):
        outcomes[ended] = replace(outcomes[ended], consequences={"table_tidy": value})
        skills["roll"] = replace(skills["roll"], outcomes=outcomes)
        skills["sweep_arm"] = replace(skills["sweep_arm"], disturbed={"table_tidy": "`hand`"})
        claims = list(interference_claims(ecm.compositions["both"], skills, site()))
        compare_reports("parallel_reports.txt", "a value that follows", claims)
        assert set(failed(claims).values()) == set(expected)
