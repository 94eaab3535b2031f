from __future__ import annotations

import shutil
from collections import Counter
from itertools import pairwise
from pathlib import Path

import pytest

from aeros.spec.backends.solver_process import SolverProcess
from aeros.spec.backends.solver_results import SatResult, SolverAnswer
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.verdicts import Conclusion, Verdict
from aeros.spec.verification.reports import Report
from aeros.spec.verification.verify import verify

CORPUS = Path(__file__).parents[3] / "corpus"
TABLE = CORPUS / "site" / "table.yaml"


def report_of(*cases: str, site: Path = TABLE) -> Report:
    return verify([CORPUS / case for case in cases], site)


def module(tmp_path: Path, case: str, *edits: tuple[str, str]) -> Path:
    folder = Path(shutil.copytree(CORPUS / case, tmp_path / Path(case).name))
    manifest = folder / "ecm.yaml"
    text = manifest.read_text()
    for old, new in edits:
        assert old in text
        text = text.replace(old, new)
    manifest.write_text(text)
    return folder


def test_a_report_is_as_bad_as_its_worst_part() -> None:
    assert report_of("accepted/always_slow").conclusion is Conclusion.PROVED
    both = report_of("accepted/always_slow", "rejected/safety/fast_near_a_person")
    assert both.conclusion is Conclusion.REJECTED
    assert [one.conclusion for one in both.modules] == [Conclusion.PROVED, Conclusion.REJECTED]


def test_a_module_under_a_site_that_is_refused_is_not_proved() -> None:
    site = CORPUS / "rejected" / "site" / "rule_shadowed_by_another" / "site.yaml"
    report = report_of("site/idle", site=site)
    assert report.conclusion is Conclusion.REJECTED
    assert report.site.conclusion is Conclusion.REJECTED


def test_a_module_under_a_site_that_cannot_be_read_is_not_looked_at() -> None:
    report = report_of("accepted/always_slow", site=CORPUS / "rejected" / "site" / "two_stops" / "site.yaml")
    assert report.modules == ()
    assert report.site_model is None
    assert report.conclusion is Conclusion.REJECTED


def test_each_subject_is_announced_before_it_is_proved() -> None:
    reported: list[str] = []
    path = CORPUS / "accepted" / "always_slow"
    verify([path], TABLE, progress=reported.append)
    assert reported == [f"site {TABLE}", f"1 of 1: {path}"]


def test_the_verdict_does_not_depend_on_neighbouring_folders(tmp_path: Path) -> None:
    alone = verify([module(tmp_path, "accepted/left_to_the_gate")], TABLE).modules[0]
    module(tmp_path, "rejected/safety/fast_near_a_person")
    module(tmp_path, "rejected/form/key_written_twice")
    among = {one.name: one for one in verify([tmp_path], TABLE).modules}
    assert among["left_to_the_gate"].certificate == alone.certificate


def test_the_same_files_give_the_same_verdicts_and_witnesses() -> None:
    def message() -> list[tuple[str, Verdict, object]]:
        report = report_of("rejected/safety/distance_measured_along_an_axis")
        found = [*report.site.findings, *report.modules[0].findings]
        return [(str(one.obligation.id), one.verdict, one.witness and one.witness.values) for one in found]

    assert message() == message()


def test_a_smaller_budget_never_proves_more(tmp_path: Path) -> None:
    path = module(tmp_path, "accepted/lighter_and_faster")
    verdicts = []
    for rlimit in (1, 100, 1_000, 10_000, 1_000_000):
        (found,) = verify([path], TABLE, rlimit).modules
        verdicts.append({one.obligation.id for one in found.findings if one.verdict is not Verdict.UNKNOWN})
    assert all(small <= large for small, large in pairwise(verdicts))
    assert verdicts[0] < verdicts[-1]


@pytest.mark.parametrize(
    "case",
    [
        "accepted/granted_the_wheels",
        "accepted/asks_for_the_stop",
        "rejected/safety/goal_never_true",
        "rejected/safety/another_rule_left_to_the_gate",
    ],
)
def test_no_two_obligations_have_one_id(case: str) -> None:
    report = report_of(case)
    for subject in (report.site, *report.modules):
        ids = Counter(
            [one.id for one in subject.static_claims] + [one.obligation.id for one in subject.findings]
        )
        assert [id_ for id_, count in ids.items() if count > 1] == []


def test_a_goal_cannot_take_the_place_of_a_guarded_rule(tmp_path: Path) -> None:
    # A skill `task`, a task named like the action kind and a rule `goal`: the goal is proved, and
    # the verdict on the rule must still say that the gate decides it.
    site = tmp_path / "table.yaml"
    site.write_text(TABLE.read_text().replace("id: slow-near-person", "id: goal"))
    path = module(
        tmp_path,
        "accepted/left_to_the_gate",
        ("  tidy:\n", "  task:\n"),
        ("provided_by: [tidy]", "provided_by: [task]"),
        ("gated: [slow-near-person]", "gated: [goal]"),
        (
            "\npermissions:",
            "\ntasks:\n  approach:\n    description: a tidy table\n    words: [tidy]\n    goal: table_tidy\n"
            "    rules:\n      - {unless: table_tidy, do: task}\n\npermissions:",
        ),
    )
    (found,) = verify([path], site).modules
    assert found.conclusion is Conclusion.PROVED
    assert found.certificate is not None
    assert found.certificate.obligations[ClaimForm.ENVELOPE_OBEYS("task", "approach", "goal")] == "GUARDED"
    assert found.certificate.runtime_checked_rules("task", "approach") == {"stop-button", "goal"}


def test_a_dependency_in_a_sibling_folder_is_found(tmp_path: Path) -> None:
    folder = CORPUS / "accepted" / "modules_that_need_each_other_in_one_direction"
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    assert verify([tmp_path / "asker"], TABLE).conclusion is Conclusion.PROVED
    shutil.rmtree(tmp_path / "helper")
    report = verify([tmp_path / "asker"], TABLE)
    assert [one.code for one in report.modules[0].diagnostics] == ["AE301"]


def test_a_dependency_may_be_given_from_elsewhere(tmp_path: Path) -> None:
    folder = CORPUS / "accepted" / "modules_that_need_each_other_in_one_direction"
    for name in ("asker", "helper"):
        shutil.copytree(folder / name, tmp_path / f"of_{name}" / name)
    assert verify([tmp_path / "of_asker", tmp_path / "of_helper"], TABLE).conclusion is Conclusion.PROVED


def test_a_refuted_rule_is_not_called_needlessly_gated() -> None:
    (found,) = report_of("rejected/safety/rule_that_reads_no_state_left_to_the_gate").modules
    assert {one.code for one in found.diagnostics} == {"AE501", "AE506"}


def test_an_undecided_rule_is_not_called_needlessly_gated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    unknown = SolverAnswer(SatResult.UNKNOWN, {}, "not today")
    monkeypatch.setattr(SolverProcess, "check_sat", lambda *_: unknown)
    monkeypatch.setattr(SolverProcess, "check_together", lambda _, questions, *__: [None] * len(questions))
    path = module(tmp_path, "accepted/gate_named_without_need")
    (found,) = verify([path], TABLE).modules
    assert found.conclusion is Conclusion.UNDECIDED
    assert {one.code for one in found.diagnostics} == {"AE509"}
