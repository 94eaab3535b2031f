from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest

from aeros.spec.backends.oracle import Oracle
from aeros.spec.diagnostics.codes import SpanLabel
from aeros.spec.diagnostics.source import Source
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.obligation import ClaimMode, LabelledConjunct, Obligation, VariableSpace
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.verification import explain
from aeros.spec.verification.discharge import ObligationResult
from aeros.spec.verification.queries import is_unsatisfiable
from aeros.spec.verification.reports import SubjectReport
from aeros.spec.verification.unsat_core import UnsatCore, find_unsat_core, label_core
from aeros.spec.verification.verify import verify

CORPUS = Path(__file__).parents[3] / "corpus"
Judge = Callable[..., SubjectReport]

TEXT = Source("ecm.yaml", "abcdefghijklmnopqrstuvwxyz")
REAL = RealType(NUMBER)
X, Y = (t.Variable(name, REAL, t.VariableRole.STATE) for name in "xy")
DECLARED = tuple(Declared(one, TEXT.span(20, 21), range=(Fraction(0), Fraction(10))) for one in (X, Y))


def at_most(variable: t.Variable, bound: int) -> t.Term:
    return t.Compare("<=", variable, t.Literal(Fraction(bound), REAL))


def at_least(variable: t.Variable, bound: int) -> t.Term:
    return t.Compare("<=", t.Literal(Fraction(bound), REAL), variable)


def claim_of(*terms: t.Term) -> Obligation:
    members = tuple(
        LabelledConjunct(term, SpanLabel(TEXT.span(at, at + 1), f"m{at}"))
        for at, term in enumerate(terms, start=1)
    )
    space = VariableSpace(DECLARED, ())
    whole = SpanLabel(TEXT.span(0, len(terms) + 2), "whole")
    return Obligation(
        ClaimForm.SKILL_CAN_START("x"),
        "AE504",
        ClaimMode.SOMETIMES,
        space,
        t.conjunction(*terms),
        "h",
        whole,
        labelled_conjuncts=members,
    )


def core(*terms: t.Term) -> tuple[str, ...]:
    found = find_unsat_core(claim_of(*terms), Oracle())
    assert found is not None
    return (*(one.label.text for one in found.members), *(one.name for one in found.ranges))


def is_core(found: UnsatCore) -> bool:
    """Check that the parts contradict each other, and no longer without any one of them."""

    def clash(members: tuple[LabelledConjunct, ...], ranges: tuple[Declared, ...]) -> bool:
        names = {one.name for one in ranges}
        space = [one if one.name in names else replace(one, range=None) for one in DECLARED]
        return is_unsatisfiable([one.term for one in members], space, Oracle())

    def without(parts: tuple[object, ...]) -> list[tuple[object, ...]]:
        return [(*parts[:i], *parts[i + 1 :]) for i in range(len(parts))]

    return (
        clash(found.members, found.ranges)
        and not any(clash(fewer, found.ranges) for fewer in without(found.members))  # type: ignore[arg-type]
        and not any(clash(found.members, fewer) for fewer in without(found.ranges))  # type: ignore[arg-type]
    )


def test_a_core_holds_only_conditions_that_clash() -> None:
    assert core(at_most(Y, 5), at_most(X, 3), at_most(Y, 6), at_least(X, 4)) == ("m2", "m4")


def test_a_declared_range_can_take_part() -> None:
    assert core(at_least(X, 11), at_most(Y, 5)) == ("m1", "x")


def test_of_two_cores_the_one_of_the_first_members_is_found() -> None:
    assert core(at_most(X, 3), at_least(X, 4), at_most(Y, 3), at_least(Y, 4)) == ("m1", "m2")
    assert core(at_least(X, 4), at_least(X, 5), at_most(X, 3)) == ("m1", "m3")


def test_a_condition_that_is_false_by_itself_is_the_whole_core() -> None:
    assert core(at_most(X, 3), t.FALSE) == ("m2",)


def test_many_members_are_reduced_to_the_two_that_clash() -> None:
    harmless = [at_most(Y, 10 + i) for i in range(18)]
    found = find_unsat_core(claim_of(*harmless[:9], at_most(X, 3), *harmless[9:], at_least(X, 4)), Oracle())
    assert found is not None
    assert [one.label.text for one in found.members] == ["m10", "m20"]
    assert is_core(found)


@pytest.mark.parametrize("left_out", range(3))
def test_a_core_that_omits_a_member_is_noticed(left_out: int) -> None:
    both = t.Compare("<=", t.Add(X, Y), t.Literal(Fraction(5), REAL))
    found = find_unsat_core(claim_of(at_least(X, 3), both, at_least(Y, 3), at_most(X, 9)), Oracle())
    assert found is not None
    assert is_core(found)
    omitted = found.members[:left_out] + found.members[left_out + 1 :]
    assert not is_core(replace(found, members=omitted))
    assert not is_core(
        replace(found, members=(*found.members, claim_of(at_most(X, 9)).labelled_conjuncts[0]))
    )


def test_a_satisfiable_claim_has_no_core() -> None:
    assert find_unsat_core(claim_of(at_most(X, 3)), Oracle()) is None
    assert find_unsat_core(claim_of(), Oracle()) is None


def test_a_spent_budget_finds_no_core() -> None:
    product = t.Compare("<=", t.Literal(Fraction(1001), REAL), t.Multiply(X, t.Multiply(Y, Y)))
    assert find_unsat_core(claim_of(product), Oracle(rlimit=1)) is None


def test_each_member_has_its_own_label_and_the_first_of_the_condition_is_primary() -> None:
    claim = claim_of(at_most(X, 3), at_most(Y, 3), at_least(X, 4))
    found = find_unsat_core(claim, Oracle())
    assert found is not None
    primary, secondary = label_core(claim, found)
    assert primary.span == TEXT.span(1, 2)
    assert [label.text for label in secondary] == ["m3"]


# Through `verify`: what is underlined.


def underlined(report: SubjectReport, code: str) -> list[str]:
    (found,) = [one for one in report.diagnostics if one.code == code]
    assert found.primary is not None
    return [label.span.text for label in (found.primary, *found.secondary)]


def test_the_conjuncts_of_an_empty_envelope_that_clash_are_underlined(judge: Judge) -> None:
    report = judge(
        "wait", "duration <= 90 s and (duration > 20 s and inputs.pause > 1 s) and 1 s < duration <= 10 s"
    )
    assert underlined(report, "AE503") == ["duration > 20 s", "duration <= 10 s"]


def test_the_range_that_takes_part_is_underlined_in_the_site(judge: Judge) -> None:
    assert underlined(judge("wait", "duration > 600 s"), "AE503") == ["duration > 600 s", "0, 600"]


def test_of_a_dead_action_only_the_rule_that_clashes_is_underlined(judge: Judge) -> None:
    report = judge("move", "target in tabletop and speed > 1 m/s", permission="speed <= 3 m/s")
    assert underlined(report, "AE502") == ["speed > 1 m/s", "speed <= 250 mm/s"]


def test_where_no_core_is_found_every_rule_on_the_action_is_underlined(
    judge: Judge, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(explain, "find_unsat_core", lambda *_: None)
    report = judge("move", "target in tabletop and speed > 1 m/s", permission="speed <= 3 m/s")
    (found,) = [one for one in report.diagnostics if one.code == "AE502"]
    assert {label.text: label.span.text for label in found.secondary} == {
        "on-the-table": "target in tabletop",
        "off-the-mast": "target not in camera_mast",
        "top-speed": "speed <= 250 mm/s",
    }


def test_where_no_core_is_found_every_other_rule_is_underlined(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(explain, "find_unsat_core", lambda *_: None)
    site = CORPUS / "rejected/site/rule_shadowed_by_another/site.yaml"
    (found,) = verify([CORPUS / "site/idle"], site).subjects[0].diagnostics
    assert [(label.text, label.span.text) for label in found.secondary] == [("top-speed", "speed <= 2 m/s")]


def test_a_permission_that_clashes_is_underlined(judge: Judge) -> None:
    report = judge(
        "wait", "duration >= 0 s and duration < 5 s", permission="duration > 6 s and duration < 9 s"
    )
    assert underlined(report, "AE502") == ["duration < 5 s", "duration > 6 s"]


def test_of_an_impossible_precondition_the_conjuncts_that_clash_are_underlined(judge: Judge) -> None:
    report = judge("wait", "duration <= 1 s", precondition="dirt < 1 % and table_tidy and dirt > 2 %")
    assert underlined(report, "AE504") == ["dirt < 1 %", "dirt > 2 %"]


def test_of_an_empty_permission_the_conjuncts_that_clash_are_underlined(judge: Judge) -> None:
    report = judge("wait", "duration <= 1 s", permission="0 s <= duration <= 4 s and duration >= 5 s")
    assert underlined(report, "AE409") == ["duration <= 4 s", "duration >= 5 s"]


def test_of_a_breach_the_conjunct_that_the_witness_breaks_is_underlined(judge: Judge) -> None:
    site = (("require: duration <= 30 s", "require: 1 s <= duration and duration <= 30 s"),)
    report = judge("wait", "2 s <= duration <= 31 s", site=site)
    assert underlined(report, "AE501") == ["duration <= 31 s", "duration <= 30 s"]
    report = judge("wait", "duration <= 30 s", site=site, permission="duration < 30 s and 1 s <= duration")
    found = underlined(report, "AE403")
    assert found[0] == "duration <= 30 s"
    assert set(found[1:]) <= {"duration < 30 s", "1 s <= duration"}


def test_the_conjuncts_of_every_claim_are_equivalent_to_it(judge: Judge) -> None:
    """Parts are shown in place of the whole, so together they are the whole."""
    report = judge(
        "move",
        "target in tabletop and target not in camera_mast and 0 m/s < speed < 10 mm/s and true",
        permission="speed <= 1 m/s and target in tabletop",
        precondition="0 % < dirt < 5 % and not stop_pressed",
    )
    checked = [one.obligation for one in report.findings if one.obligation.labelled_conjuncts]
    assert {one.code for one in checked} >= {"AE409", "AE403", "AE501", "AE502", "AE503", "AE504"}
    for one in checked:
        assumed = one.space.assumptions if one.mode is ClaimMode.SOMETIMES else ()
        whole = t.conjunction(*assumed, one.conclusion)
        parts = t.conjunction(*(member.term for member in one.labelled_conjuncts))
        differ = t.Or((t.And((whole, t.Not(parts))), t.And((parts, t.Not(whole)))))
        assert is_unsatisfiable([differ], one.space.variables, Oracle()), one.id


def test_labels_are_of_failures_alone(judge: Judge) -> None:
    def is_reported(finding: ObligationResult) -> bool:
        return finding.verdict is not Verdict.PROVED and not finding.is_runtime_checked

    report = judge("wait", "duration > 20 s and duration < 10 s")
    assert all(bool(one.labels) == is_reported(one) for one in report.findings)


_PLACES = "target in tabletop\n        and target not in camera_mast"


@pytest.mark.parametrize(
    ("envelope", "marked", "text"),
    [
        (f">-\n        {_PLACES}\n        and speed <= 1 m/s", "speed <= 1 m/s", "allows it"),
        (f"{' '.join(_PLACES.split())} and speed <= 1 m/s", "speed <= 1 m/s", "allows it"),
        (f">-\n        {_PLACES}", "target not in camera_mast", "does not bound `speed`"),
    ],
    ids=["of three lines", "of one line", "no line bounds it"],
)
def test_the_condition_of_an_envelope_at_fault_is_underlined(
    judge: Judge, envelope: str, marked: str, text: str
) -> None:
    (found,) = (one for one in judge("move", envelope).diagnostics if one.code == "AE501")
    assert found.primary is not None
    assert (found.primary.span.text, found.primary.text) == (marked, text)
