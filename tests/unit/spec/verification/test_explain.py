"""Findings get the cause, a repair, or the boundary that the gate decides by; verdicts stay as they are."""

from __future__ import annotations

from aeros.spec.backends.oracle import Oracle
from aeros.spec.obligations.obligation import Obligation
from aeros.spec.obligations.permission import permission_obligations
from aeros.spec.obligations.safety import safety_obligations
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.verification.discharge import ObligationResult, discharge_obligations
from aeros.spec.verification.explain import explain_findings
from tests.unit.spec.obligations.data.tidier import Change, module, site

ORACLE = Oracle()


def explained(*changes: Change) -> dict[str, tuple[ObligationResult, ObligationResult]]:
    """Each finding before and after, by the text of its claim."""
    ecm = module(*changes)
    claims = [
        one
        for one in (*permission_obligations(ecm, site()), *safety_obligations(ecm, site()))
        if isinstance(one, Obligation)
        and any(f"/{skill}/" in str(one.id) for skill in ("fetch", "scrub", "weigh"))
    ]
    found = discharge_obligations(claims, ORACLE)
    after = explain_findings(found, site(), ORACLE)
    assert [(one.obligation, one.verdict, one.witness) for one in found] == [
        (one.obligation, one.verdict, one.witness) for one in after
    ]
    return {str(one.obligation.id): (one, other) for one, other in zip(found, after, strict=True)}


def test_proved_modules_stay_unchanged() -> None:
    for before, after in explained().values():
        if before.verdict is Verdict.PROVED:
            assert after is before
        else:
            assert before.is_runtime_checked


def test_a_rule_that_is_left_to_the_gate_gets_its_boundary() -> None:
    found = explained()
    assert found["safety/fetch/reach/stop-button"][1].boundary == "not stop_pressed"
    near = found["safety/scrub/approach/slow-near-person"][1]
    assert near.boundary == "not person_near or pace <= 0.1 m/s"
    assert (near.labels, near.repair) == ((), "")


def test_a_breach_is_labelled_where_its_witness_breaks_it_and_repaired() -> None:
    wait = "wait: duration <= 10 s\n    outputs"
    _, found = explained((wait, wait.replace("10 s", "40 s")))["safety/weigh/wait/short-waits"]
    assert found.verdict is Verdict.REFUTED
    assert [one.text for one in found.labels] == ["allows it", "`short-waits` forbids it"]
    assert found.repair == "wait: duration <= 30 s"


def test_an_empty_condition_is_labelled_where_its_parts_clash() -> None:
    clash = "precondition: fetched == sponge and dirt < 10 % and dirt > 20 %"
    _, found = explained(("precondition: fetched == sponge", clash))["safety/scrub/can-start"]
    assert found.verdict is Verdict.REFUTED
    assert [one.span.text for one in found.labels] == ["dirt < 10 %", "dirt > 20 %"]


def test_an_undecided_claim_gets_no_explanation() -> None:
    ecm = module()
    claims = [one for one in permission_obligations(ecm, site()) if isinstance(one, Obligation)]
    asked = [one for one in claims if str(one.id) == "permission/fetch/reach"]
    found = tuple(ObligationResult(one, Verdict.UNKNOWN, reason="spent") for one in asked)
    assert explain_findings(found, site(), ORACLE) == found
