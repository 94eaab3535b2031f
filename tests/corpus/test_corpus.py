"""Every case of the corpus is judged as its header says, in the words of its `expected.txt`.

A case is a folder in `accepted/` or in a group of `rejected/`.  Its first line says why it is there,
its second which codes are reported.  `site.yaml` in it is a case about a site, run with the module
`site/idle`; any other case is run under `site/table.yaml`.

    AEROS_UPDATE_GOLDEN=1 pytest tests/corpus     rewrites every `expected.txt`, and fails
"""

from __future__ import annotations

import contextlib
import io
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import aeros
import aeros.cli.author.verify
import aeros.spec.verification.examine
import aeros.spec.verification.reports
from aeros.cli.main import main
from aeros.spec.backends.oracle import Oracle
from aeros.spec.diagnostics.codes import CODES
from aeros.spec.diagnostics.source import Source
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import is_true
from aeros.spec.model.policy import OperatorOverride
from aeros.spec.model.site import Site
from aeros.spec.obligations.obligation import ClaimMode, Obligation
from aeros.spec.obligations.verdicts import StaticClaim, Verdict
from aeros.spec.verification.reports import Report, SubjectReport
from aeros.spec.verification.verify import verify
from tests.declared_types import mistyped_fields

CORPUS = Path(__file__).parent
CASES = sorted(
    path.relative_to(CORPUS)
    for path in [*CORPUS.glob("rejected/*/*"), *CORPUS.glob("accepted/*")]
    if path.is_dir()
)
UPDATE = os.environ.get("AEROS_UPDATE_GOLDEN") == "1"

NOT_HERE = {
    "AE002": "a path that cannot be read is no file of a corpus: tests/unit/spec/elaborate/test_load.py",
    "AE003": "megabytes: tests/unit/spec/text/test_yaml_reader.py",
    "AE007": "whatever no other code names: tests/unit/spec/text/test_yaml_reader.py",
    "AE010": "thousands of brackets: tests/unit/spec/text/test_yaml_reader.py",
    "AE014": "tests/unit/spec/text/test_yaml_reader.py",
    "AE016": "tests/unit/spec/text/test_yaml_reader.py",
    "AE017": "thousands of values: tests/unit/spec/text/test_yaml_reader.py",
    "AE130": "a path without a module: tests/unit/cli/author/test_verify.py",
    "AE140": "only a scene has bodies in it: tests/unit/sim/scenes/test_physics_scene.py",
    "AE141": "a model in a scene: tests/unit/spec/scenes/test_load.py",
    "AE411": "the corpus's site has no tool: tests/property/test_permissions.py",
    "AE509": "depends on the budget, not on the files: tests/unit/cli/author/test_verify.py",
}
"""Codes that `aeros verify` reports and no case shows, and where they are tested instead."""


@dataclass(frozen=True)
class Case:
    """A folder of the corpus, relative to it, and what its header says."""

    path: Path
    reason: str
    codes: frozenset[str]

    @property
    def arguments(self) -> list[str]:
        if (CORPUS / self.path / "site.yaml").exists():
            return ["verify", "-v", "site/idle", "--site", str(self.path / "site.yaml"), "--no-lock"]
        return ["verify", "-v", str(self.path), "--site", "site/table.yaml", "--no-lock"]

    @property
    def golden(self) -> Path:
        return CORPUS / self.path / "expected.txt"


@dataclass(frozen=True)
class Outcome:
    """Result of a run of `aeros verify`."""

    exit_code: int
    text: str
    report: Report

    @property
    def codes(self) -> frozenset[str]:
        return frozenset(found.code for subject in self.report.subjects for found in subject.diagnostics)


def case_at(path: Path) -> Case:
    manifest = next(iter(sorted((CORPUS / path).rglob("*.yaml"))))
    first, second = manifest.read_bytes().decode(errors="replace").split("\n")[:2]
    assert first.startswith("# "), manifest
    assert second.startswith("# expect: "), manifest
    codes = second.removeprefix("# expect: ").split()
    return Case(path, first.removeprefix("# "), frozenset() if codes == ["nothing"] else frozenset(codes))


@cache
def outcome_of(case: Case) -> Outcome:
    """Run the command in the corpus's folder, so that paths in its output are the same everywhere."""
    reports: list[Report] = []

    def recorded(*arguments: Any, **_: object) -> Report:
        reports.append(verify(*arguments))  # in full, for the sake of its witnesses
        return reports[-1]

    with contextlib.chdir(CORPUS), pytest.MonkeyPatch.context() as patch:
        patch.setattr(aeros.cli.author.verify, "verify", recorded)
        patch.setattr(aeros, "__version__", "0.1.0")  # stands in messages about versions
        patch.setattr(aeros.spec.verification.examine, "examine_site", _examine_site)
        shown = io.StringIO()
        with contextlib.redirect_stdout(shown):
            exit_code = main(case.arguments)
    return Outcome(exit_code, shown.getvalue(), reports[-1])


_proved_site = aeros.spec.verification.examine.examine_site


@cache
def _site_of(source: Source) -> tuple[Site | None, SubjectReport]:
    return _proved_site(source, Oracle())


def _examine_site(
    source: Source, _: Oracle, __: Sequence[OperatorOverride]
) -> tuple[Site | None, SubjectReport]:
    """Proved once, and not for each of its modules."""
    return _site_of(source)


# One test: two processes may share the tests, and each would prove the module.
@pytest.mark.parametrize("path", CASES, ids=str)
def test_the_case_is_judged_as_its_header_says_and_every_witness_replays(path: Path) -> None:
    case = case_at(path)
    outcome = outcome_of(case)
    undecided = bool(case.codes) and case.codes <= {"AE509", "AE803"}
    assert outcome.exit_code == (0 if path.parts[0] == "accepted" else 3 if undecided else 1)
    assert outcome.codes == case.codes
    shown = f"$ aeros {' '.join(case.arguments)}\n{outcome.text}exit {outcome.exit_code}\n"
    if UPDATE:
        case.golden.write_text(shown, encoding="utf-8")
        pytest.fail("the golden file was rewritten: read the difference, then run without the variable")
    assert shown == case.golden.read_text(encoding="utf-8")
    check_witnesses(outcome.report)
    check_types(outcome.report)


def check_types(report: Report) -> None:
    """Check the fields of what each kind of claim would report, whether or not it fails."""
    for subject in report.subjects:
        of_kind = {one.obligation.id.form: one.obligation for one in subject.findings}
        reported = [one.diagnostic for one in subject.static_claims if one.diagnostic is not None]
        assert [text for one in (*of_kind.values(), *reported) for text in mistyped_fields(one)] == []


def check_witnesses(report: Report) -> None:
    """Check that each witness is one, within the ranges of its variables, and that none is missing."""
    for finding in (finding for subject in report.subjects for finding in subject.findings):
        always = finding.obligation.mode is ClaimMode.ALWAYS
        settled_by_example = Verdict.REFUTED if always else Verdict.PROVED
        assert (finding.witness is not None) == (finding.verdict is settled_by_example)
        if finding.witness is not None:
            env = finding.witness.values
            assert all(is_true(assumption, env) for assumption in finding.obligation.space.assumptions)
            assert is_true(finding.obligation.conclusion, env) != always
            for one in finding.witness.variables:
                value = env[one.name]
                parts = value if isinstance(value, tuple) else (value,)
                assert one.range is None or all(one.range[0] <= part <= one.range[1] for part in parts)  # type: ignore[operator]


def test_every_reason_is_given_once() -> None:
    reasons = [case_at(path).reason for path in CASES]
    assert [reason for reason in reasons if reasons.count(reason) > 1] == []
    assert all(reason.endswith((".", "?")) for reason in reasons)


def test_every_code_of_the_verifier_has_a_case() -> None:
    reported = {code for path in CASES for code in case_at(path).codes}
    wanted = {code for code in CODES if code[:3] not in ("AE7", "AE9")}  # of the gate, of certificates
    assert sorted(wanted - reported - NOT_HERE.keys()) == []
    assert sorted(reported & NOT_HERE.keys()) == []


def test_no_golden_file_is_left_over() -> None:
    golden = {path.parent.relative_to(CORPUS) for path in CORPUS.rglob("expected.txt")}
    assert golden == set(CASES)


# Broken twins: a verifier that is wrong in one place is noticed by at least one case.

Claims = Iterator[Obligation | StaticClaim]
Change = Callable[[Obligation], Obligation | None]
BUILDERS = (
    "policy_obligations",
    "joint_policy_obligations",
    "permission_obligations",
    "safety_obligations",
    "composition_obligations",
)
SETTLERS = (
    "entry_point_obligations",
    "dependency_obligations",
    "runtime_obligations",
    "skill_code_obligations",
    "closed_loop_obligations",
    "configuration_obligations",
    *BUILDERS,
)


def unchanged(one: Obligation) -> Obligation | None:
    return one


def without(wanted: Callable[[Obligation], bool]) -> Change:
    return lambda one: None if wanted(one) else one


def of_code(code: str) -> Callable[[Obligation], bool]:
    return lambda one: one.code == code


def about(part: str) -> Callable[[Obligation], bool]:
    return lambda one: part in (*one.id.names, *(segment.word for segment in one.id.form.segments))


def negation_dropped(one: Obligation) -> Obligation:
    return replace(one, conclusion=t.Not(one.conclusion)) if one.mode is ClaimMode.ALWAYS else one


def impossible_assumed(one: Obligation) -> Obligation:
    assumed = (*one.space.assumptions, t.FALSE)
    return (
        replace(one, space=replace(one.space, assumptions=assumed)) if one.mode is ClaimMode.ALWAYS else one
    )


def assumptions_forgotten(one: Obligation) -> Obligation:
    return replace(one, space=replace(one.space, assumptions=()))


def one_assumption_forgotten(one: Obligation) -> Obligation:
    return replace(one, space=replace(one.space, assumptions=one.space.assumptions[:1]))


def all_but_one_assumed(one: Obligation) -> Obligation:
    return replace(one, space=replace(one.space, assumptions=one.space.assumptions[1:]))


def one_state_for_all(one: Obligation) -> Obligation:
    renamed: dict[str, t.Term] = {
        f"{role}.{now.name}": now.variable
        for now in one.space.variables
        for role in ("a", "b", "hand_action", "table_action")
        if now.variable.role is t.VariableRole.STATE
    }
    assumed = tuple(t.substitute(term, renamed) for term in one.space.assumptions)
    return replace(one, space=replace(one.space, assumptions=assumed))


def always_left_to_the_gate(one: Obligation) -> Obligation:
    return replace(one, runtime_checked_rule=str(one.id)) if one.code == "AE501" else one


def never_left_to_the_gate(one: Obligation) -> Obligation:
    return replace(one, runtime_checked_rule=None)


def permission_left_to_the_gate(one: Obligation) -> Obligation:
    return replace(one, runtime_checked_rule=str(one.id)) if one.code == "AE403" else one


def ranges_halved(one: Obligation) -> Obligation:
    declared = tuple(
        replace(variable, range=(variable.range[0] / 2, variable.range[1] / 2))
        if variable.range
        else variable
        for variable in one.space.variables
    )
    return replace(one, space=replace(one.space, variables=declared))


def ranges_doubled(one: Obligation) -> Obligation:
    declared = tuple(
        replace(variable, range=(variable.range[0] * 2, variable.range[1] * 2))
        if variable.range
        else variable
        for variable in one.space.variables
    )
    return replace(one, space=replace(one.space, variables=declared))


def _order_changed(term: t.Term, old: str, new: str) -> t.Term:
    changes: dict[str, Any] = {}
    for field in fields(term):
        value = getattr(term, field.name)
        if isinstance(value, t.Term):
            changes[field.name] = _order_changed(value, old, new)
        elif isinstance(value, tuple) and value and isinstance(value[0], t.Term):
            changes[field.name] = tuple(_order_changed(part, old, new) for part in value)
    changed = replace(term, **changes)
    return replace(changed, op=new) if isinstance(changed, t.Compare) and changed.op == old else changed  # type: ignore[arg-type]


def conclusion_strict(one: Obligation) -> Obligation:
    return replace(one, conclusion=_order_changed(one.conclusion, "<=", "<"))


def conclusion_lenient(one: Obligation) -> Obligation:
    return replace(one, conclusion=_order_changed(one.conclusion, "<", "<="))


def envelope_strict(one: Obligation) -> Obligation:
    assumed = tuple(_order_changed(term, "<=", "<") for term in one.space.assumptions)
    return replace(one, space=replace(one.space, assumptions=assumed))


CHANGES: dict[str, tuple[str, Change]] = {
    "the negation is dropped": ("safety", negation_dropped),
    "the negation is dropped, of permissions": ("permission", negation_dropped),
    "the negation is dropped, of policies": ("site", negation_dropped),
    "something impossible is assumed": ("safety", impossible_assumed),
    "something impossible is assumed, of permissions": ("permission", impossible_assumed),
    "something impossible is assumed, of policies": ("site", impossible_assumed),
    "the envelope is not assumed": ("accepted", assumptions_forgotten),
    "the envelope is assumed without its bound": ("safety", envelope_strict),
    "the envelope is assumed without its bound, of permissions": ("permission", envelope_strict),
    "a rule is shadowed only by a single other": ("site", one_assumption_forgotten),
    "an attenuation applies where the rule is kept": ("site", all_but_one_assumed),
    "every rule is left to the gate": ("safety", always_left_to_the_gate),
    "no rule is left to the gate": ("accepted", never_left_to_the_gate),
    "the permission is left to the gate": ("permission", permission_left_to_the_gate),
    "half of each range is looked at": ("safety", ranges_halved),
    "half of each range is looked at, of permissions": ("permission", ranges_halved),
    "half of each range is looked at, of policies": ("site", ranges_halved),
    "values out of range are looked at": ("safety", ranges_doubled),
    "values out of range are looked at, of accepted modules": ("accepted", ranges_doubled),
    "values out of range are looked at, of policies": ("site", ranges_doubled),
    "the state when an action began is the state now": ("composition", one_state_for_all),
    "only one of two actions keeps to its envelope": ("accepted", all_but_one_assumed),
    "rules are kept too strictly": ("accepted", conclusion_strict),
    "permissions are kept too leniently": ("permission", conclusion_lenient),
} | {
    f"no obligation of {code}": (group, without(of_code(code)))
    for group, codes in {
        "permission": ("AE403", "AE409"),
        "safety": ("AE501", "AE502", "AE503", "AE504", "AE506", "AE507"),
        "site": ("AE601", "AE602", "AE603", "AE604", "AE605", "AE606"),
        "composition": ("AE851", "AE855", "AE857", "AE861"),
    }.items()
    for code in codes
}
CHANGES |= {
    f"no obligation of the rule {rule}": ("safety", without(about(rule)))
    for rule in (
        "short-waits",
        "off-the-mast",
        "top-speed",
        "quarter-turn",
        "pressure-of-tool",
        "slow-near-person",
        "short-reach",
        "momentum",
    )
}

SETTLED = (
    *("AE123", "AE124", "AE301", "AE302", "AE303", "AE304", "AE305", "AE306"),
    *(
        "AE401",
        "AE402",
        "AE404",
        "AE405",
        "AE406",
        "AE407",
        "AE408",
        "AE506",
        "AE602",
        "AE133",
        "AE134",
        "AE801",
        "AE802",
        "AE804",
        "AE852",
        "AE853",
        "AE854",
        "AE855",
        "AE856",
        "AE858",
        "AE859",
        "AE860",
        "AE862",
        "AE864",
        "AE881",
        "AE882",
        "AE884",
    ),
)


def _break(patch: pytest.MonkeyPatch, builder: str, change: Change, silenced: str = "") -> None:
    """Make `verify` call a broken twin of `builder`: it changes obligations and silences one code."""
    home = next(
        one
        for one in (aeros.spec.verification.examine, aeros.spec.verification.reports)
        if hasattr(one, builder)
    )
    original: Callable[..., Claims] = getattr(home, builder)

    def broken(*arguments: object) -> Claims:
        for claim in original(*arguments):
            if isinstance(claim, StaticClaim):
                is_silent = claim.diagnostic is not None and claim.diagnostic.code == silenced
                yield StaticClaim(claim.id, None) if is_silent else claim
            elif (changed := change(claim)) is not None:
                yield changed

    patch.setattr(home, builder, broken)


def _noticed(group: str, first: str = "") -> bool:
    """Check that some case of `group` is not judged as its header says; cases of the code `first` lead."""
    cases = [case_at(path) for path in CASES if group in path.parts]
    for case in sorted(cases, key=lambda one: first not in one.codes):
        _, _, path, _, site, _ = case.arguments
        report = verify([Path(path)], Path(site))
        found = {one.code for subject in report.subjects for one in subject.diagnostics}
        if found != case.codes:
            return True
    return False


@pytest.mark.parametrize("name", CHANGES)
def test_broken_twin_is_noticed(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    group, change = CHANGES[name]
    monkeypatch.chdir(CORPUS)
    if group != "site":
        monkeypatch.setattr(aeros.spec.verification.examine, "examine_site", _examine_site)
    for builder in BUILDERS if group == "site" else BUILDERS[2:]:
        _break(monkeypatch, builder, change)
    assert _noticed(group)


@pytest.mark.parametrize("code", SETTLED)
def test_silenced_check_is_noticed(code: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(CORPUS)
    group = next(path.parts[1] for path in CASES if code in case_at(path).codes and len(path.parts) == 3)
    if group != "site":
        monkeypatch.setattr(aeros.spec.verification.examine, "examine_site", _examine_site)
    for builder in SETTLERS:
        _break(monkeypatch, builder, unchanged, silenced=code)
    assert _noticed(group, first=code)


def test_unbroken_verifier_is_not_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(CORPUS)
    for builder in SETTLERS:
        _break(monkeypatch, builder, unchanged)
    assert not _noticed("safety")
    assert not _noticed("site")
