from __future__ import annotations

from collections.abc import Callable

import pytest
import z3

import aeros.spec.verification.gate_boundary
from aeros.spec.backends.oracle import Oracle
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.elaborate.scopes import scope_over
from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import parse
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL
from aeros.spec.model.site import Site
from aeros.spec.verification.discharge import ObligationResult
from aeros.spec.verification.queries import is_unsatisfiable
from aeros.spec.verification.reports import SubjectReport

Judge = Callable[..., SubjectReport]
RULE = "require: person_near implies pace <= slow"


def site_of(report: SubjectReport) -> Site:
    site = load_site(report.path.parent / "site.yaml", Diagnostics())
    assert site is not None
    return site


def means_the_rule(finding: ObligationResult, text: str, site: Site) -> bool:
    """Check that `text` and the rule agree on every action of the envelope in every state."""
    space, rule = finding.obligation.space, finding.obligation.conclusion
    suggested = check(parse(text), scope_over(site, space.variables), BOOL)
    differ = t.Or((t.And((suggested, t.Not(rule))), t.And((rule, t.Not(suggested)))))
    return is_unsatisfiable((*space.assumptions, differ), space.variables, Oracle())


def boundary(judge: Judge, require: str, envelope: str = "pace <= 410 mm/s") -> str:
    site = ((RULE, f"require: {require}"), ('attenuate: {pace: "min(pace, slow)"}', ""))
    report = judge("approach", envelope, gated="slow-near-person", site=site)
    (found,) = [
        one for one in report.findings if str(one.obligation.id).endswith("/approach/slow-near-person")
    ]
    assert found.is_runtime_checked, report.diagnostics
    assert means_the_rule(found, found.boundary, site_of(report))
    return found.boundary


@pytest.mark.parametrize(
    ("require", "shown"),
    [
        ("person_near implies pace <= slow", "not person_near or pace <= 0.1 m/s"),
        ("dirt > 20 % implies pace <= slow", "dirt <= 20 % or pace <= 0.1 m/s"),
        (
            "dirt > 20 % implies pace <= 20 mm/s and load < 1 kg",
            "dirt <= 20 % or (pace <= 0.02 m/s and load < 1 kg)",
        ),
        ("fetched == knife implies pace < slow", "fetched != knife or pace < 0.1 m/s"),
        (
            "fetched in {knife, brush} implies pace < slow",
            "(fetched != knife and fetched != brush) or pace < 0.1 m/s",
        ),
        ("not stop_pressed and load <= 2 kg", "not stop_pressed and load <= 2 kg"),
        ("hand.z >= 100 mm", "hand.z >= 0.1 m"),
        ("joint_angle[elbow] < 90 deg", "joint_angle[elbow] < 90 deg"),
        ("abs(joint_angle[elbow]) < 1 rad", "abs(joint_angle[elbow]) < 1 rad"),
    ],
)
def test_the_rule_reads_as_alternatives_in_the_units_of_the_site(
    judge: Judge, require: str, shown: str
) -> None:
    assert boundary(judge, require) == shown


@pytest.mark.parametrize(
    ("require", "envelope", "shown"),
    [
        ("person_near implies pace <= slow", "pace > 100 mm/s", "not person_near"),
        ("person_near implies pace <= slow", "pace > 99 mm/s", "not person_near or pace <= 0.1 m/s"),
        ("person_near implies pace <= slow", "person_near and pace <= 1 m/s", "pace <= 0.1 m/s"),
        ("load <= 2 kg and pace <= 500 mm/s", "pace <= 500 mm/s", "load <= 2 kg"),
        ("load <= 2 kg and pace <= 500 mm/s", "pace <= 501 mm/s", "load <= 2 kg and pace <= 0.5 m/s"),
    ],
)
def test_a_boundary_omits_conditions_that_the_envelope_decides(
    judge: Judge, require: str, envelope: str, shown: str
) -> None:
    assert boundary(judge, require, envelope) == shown


@pytest.mark.parametrize(
    ("require", "shown"),
    [
        ("2 * load <= 3 kg", "load <= 1.5 kg"),
        ("4 kg - load > 3 kg", "load < 1 kg"),
        ("load + load - 1 kg >= 3 * load - 4 kg + 0.5 kg", "load <= 2.5 kg"),
        ("3 * load <= 1 kg", "3 * load <= 1 kg"),  # 1/3 has no decimal form
        ("load * load <= 4 kg*kg", "load * load <= 4 kg*kg"),
    ],
)
def test_the_threshold_of_one_number_is_exact(judge: Judge, require: str, shown: str) -> None:
    assert boundary(judge, require) == shown


@pytest.mark.parametrize(
    "require", ["load * pace <= 0.5 kg*m/s", "any(joint_ready[j] for j in joints)", "norm(hand) <= 1 m"]
)
def test_a_rule_without_a_simpler_boundary_is_shown_as_written(judge: Judge, require: str) -> None:
    assert boundary(judge, require) == require


def test_a_boundary_that_is_off_is_not_shown(judge: Judge, monkeypatch: pytest.MonkeyPatch) -> None:
    honest = aeros.spec.verification.gate_boundary._constant

    def off(*arguments: object) -> str | None:
        shown = honest(*arguments)  # type: ignore[arg-type]
        return shown and shown.replace("0.1 m/s", "0.101 m/s")

    monkeypatch.setattr(aeros.spec.verification.gate_boundary, "_constant", off)
    assert boundary(judge, "person_near implies pace <= slow") == "person_near implies pace <= slow"


def test_a_wrong_boundary_would_be_noticed(judge: Judge) -> None:
    report = judge("approach", "pace <= 410 mm/s", gated="slow-near-person")
    (found,) = [one for one in report.findings if one.obligation.runtime_checked_rule == "slow-near-person"]
    site = site_of(report)
    assert means_the_rule(found, "not person_near or pace <= 0.1 m/s", site)
    assert means_the_rule(found, "pace > 410 mm/s or not person_near or pace <= 0.1 m/s", site)
    assert not means_the_rule(found, "not person_near or pace < 0.1 m/s", site)
    assert not means_the_rule(found, "not person_near or pace <= 0.100001 m/s", site)
    assert not means_the_rule(found, "not person_near", site)


def test_each_boundary_of_a_rule_is_listed_once(judge: Judge) -> None:
    report = judge("approach", "pace <= 410 mm/s", gated="slow-near-person")
    assert report.boundaries == (
        ("stop-button", "not stop_pressed"),
        ("slow-near-person", "not person_near or pace <= 0.1 m/s"),
    )
    assert all(bool(one.boundary) == one.is_runtime_checked for one in report.findings)


def test_a_boundary_does_not_depend_on_earlier_queries(judge: Judge) -> None:
    def message() -> object:
        return judge("approach", "pace <= 410 mm/s", gated="slow-near-person").boundaries

    first = message()
    x = z3.Real("pace")
    solver = z3.Solver()
    solver.add(x * x == 2)
    assert solver.check() == z3.sat
    assert message() == first
