"""Repairs that are proved on the whole module, each with a twin of the same kind that has none."""

from __future__ import annotations

import shutil
from functools import cache
from pathlib import Path

import pytest

import aeros.spec.verification.examine as examine
from aeros.spec.diagnostics.codes import Diagnostic, Severity
from aeros.spec.diagnostics.source import Source
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.verification.repairs.module_repair import ModuleVerdicts
from aeros.spec.verification.verify import verify
from tests.repo.tree import ROOT

CORPUS = ROOT / "tests" / "corpus"
SITE = CORPUS / "site" / "table.yaml"

REPAIRED = {
    "composition/case_of_one_member_forgotten": {"AE857": "else: nothing"},
    "composition/failure_of_which_nothing_is_said": {"AE854": "on_failure: stop"},
    "composition/half_of_what_a_step_needs": {"AE851": "precondition: not stop_pressed"},
    "composition/hold_that_may_break_unspoken": {"AE854": "on_failure: stop"},
    "composition/precondition_that_is_too_weak": {
        "AE851": "precondition: fetched != knife and fetched == sponge"
    },
    "closed_loop/hold_broken_that_leads_nowhere": {
        "AE801": "- {unless: fetched != knife, do: pick_up}` before the rule for `fetch",
        "AE802": "on_failure: pick_up",
    },
    "closed_loop/sponge_never_fetched": {
        "AE804": "- {unless: fetched == sponge, do: fetch}` before the rule for `tidy"
    },
    "closed_loop/invariant_lost_by_a_recovery": {"AE804": "between_tries: fetch"},
    "closed_loop/start_at_the_goal_of_sound_rules": {"AE805": "table_tidy: false` under `initial"},
    "closed_loop/start_that_contradicts_a_definition": {"AE806": "hand_raised: false` under `initial"},
    "closed_loop/step_whose_precondition_may_not_hold": {
        "AE801": "unless: table_tidy or not (fetched == sponge)"
    },
    "permission/action_of_the_envelope_not_permitted": {
        "AE401": "wait: duration <= 10 s` under `permissions.actions"
    },
    "permission/actuator_not_permitted_to_the_module": {"AE402": "arm` under `permissions.actuators"},
    "permission/arm_moved_without_holding_it": {"AE410": "resources: [arm]` under `skills.tidy"},
    "permission/risk_understated": {"AE407": "risk: medium"},
    "permission/sensor_read_without_permission": {"AE405": "scanner` under `permissions.sensors"},
    "composition/count_beyond_the_last_step": {"AE851": "precondition: racked <= 9"},
    "safety/count_beyond_its_range": {"AE512": "precondition: washed <= 2"},
    "safety/precondition_beyond_what_is_measured": {"AE504": "precondition: dirt > 99.999 %"},
}

WITHOUT_REPAIR = [
    "composition/success_that_is_not_enough",  # whatever holds at the start, the step before undoes it
    "composition/handler_that_may_not_start",
    "composition/wrong_branch_is_guarded",
    "closed_loop/invariant_lost_by_a_success",
    "closed_loop/outcome_that_leads_nowhere",  # there is one skill alone
    "closed_loop/recovery_that_cannot_recover",
    "closed_loop/start_at_the_goal",  # from the other start, the rules lead to a dead end
    "closed_loop/task_for_all_tools_but_one",
    "permission/actuator_not_granted_by_the_site",  # the operator's to grant
    "permission/risk_above_the_ceiling",
    "permission/riskier_action_than_the_site_allows",  # its risk could be stated, and would be refused then
    "safety/hold_that_the_precondition_excludes",  # no number in it
]


@cache
def errors_of(case: str) -> tuple[Diagnostic, ...]:
    return _errors(CORPUS / "rejected" / case)


def _errors(module: Path) -> tuple[Diagnostic, ...]:
    (found,) = verify([module], SITE).modules
    return tuple(one for one in found.diagnostics if one.severity is Severity.ERROR)


@pytest.mark.parametrize(
    ("case", "code"), [(case, code) for case, found in REPAIRED.items() for code in found]
)
def test_a_repair_is_offered_and_mends_its_error_alone(case: str, code: str, tmp_path: Path) -> None:
    errors = errors_of(case)
    error = next(one for one in errors if one.code == code)
    assert error.fix is not None
    assert error.help[0] == f"write `{REPAIRED[case][code]}`"
    module = Path(shutil.copytree(CORPUS / "rejected" / case, tmp_path / Path(case).name))
    text, fix = error.fix.span.source.text, error.fix
    (module / "ecm.yaml").write_text(text[: fix.span.start] + fix.text + text[fix.span.end :])
    before = [one.headline for one in errors]
    after = [one.headline for one in _errors(module)]
    assert error.headline not in after
    assert set(after) < set(before)
    assert (module / "ecm.yaml").read_text().startswith(text[: text.index("schema:")])  # comments stay


@pytest.mark.parametrize("case", WITHOUT_REPAIR)
def test_no_repair_is_offered_where_none_is_proved(case: str) -> None:
    errors = errors_of(case)
    assert errors
    assert [one.fix for one in errors if one.fix is not None] == []
    assert not any(text.startswith("write `") for one in errors for text in one.help if one.code != "AE404")


def test_an_edit_that_is_not_proved_is_not_offered(monkeypatch: pytest.MonkeyPatch) -> None:
    case = CORPUS / "rejected" / "composition" / "half_of_what_a_step_needs"
    assert _errors(case)[0].fix is not None
    asked: list[str] = []

    def none_is_read(*arguments: object) -> None:
        manifest = arguments[-1]
        assert isinstance(manifest, Source)
        asked.append(manifest.text)

    monkeypatch.setattr(examine, "_judge", none_is_read)
    assert _errors(case)[0].fix is None
    assert asked


def verdicts(failing: str = "", claims: str = "a b c/1 c/2", gate: str = "") -> ModuleVerdicts:
    return ModuleVerdicts(frozenset(failing.split()), frozenset(claims.split()), frozenset(gate.split()))


FAILED = ClaimForm.STEP_READY("composed", "step")
CASE = ClaimForm.IF_COVERS("composed", 1)


@pytest.mark.parametrize(
    ("after", "is_repair"),
    [
        (verdicts("a", f"a b {FAILED}"), True),
        (verdicts("", f"a b {FAILED}"), True),
        (verdicts(f"{FAILED}", f"a b {FAILED}"), False),  # it still fails
        (verdicts(f"a {FAILED}/2", f"a b {FAILED}/1 {FAILED}/2"), False),  # in another case
        (verdicts("a b", f"a b {FAILED}"), False),  # another fails instead
        (verdicts("a", "a b"), False),  # the claim is gone
        (verdicts("a", f"a {FAILED}"), False),  # another claim is gone
        (verdicts("a", f"a b {FAILED}", "b"), False),  # and left to the gate
        (verdicts("a", f"a b new {FAILED}"), True),
        (verdicts("a new", f"a b new {FAILED}"), False),
    ],
)
def test_a_repair_mends_one_claim_and_makes_none_worse(after: ModuleVerdicts, is_repair: bool) -> None:
    before = verdicts(f"a {FAILED}", f"a b {FAILED}")
    assert after.is_repair_of(before, FAILED) is is_repair


def test_a_claim_about_what_is_left_out_ends_with_its_repair() -> None:
    assert verdicts("", "a").is_repair_of(verdicts(f"{CASE}", f"a {CASE}"), CASE)
    assert not verdicts("", "").is_repair_of(verdicts(f"{CASE}", f"a {CASE}"), CASE)
