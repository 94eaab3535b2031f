"""Objections of the layers without formulas, one by one; the gate as a whole is in test_gate.py."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller
from aeros.runtime.gate.finite_layers import finite_objections
from aeros.spec.model.policy import Access, OperatorOverride
from aeros.spec.model.rules import Risk
from aeros.spec.model.tools import Program, Tool
from tests.unit.runtime.bench import unproved

FRESH = {"carry-rate": 0}


def objections(
    skill: str = "quickly",
    kind: str = "carry",
    usage: Any = None,
    module: str = "handling",
    under: Configuration | None = None,
) -> list[tuple[str, str]]:
    """Codes and rules; each text is a sentence."""
    found = finite_objections(
        under or unproved(), Caller(module, skill, {}), kind, FRESH if usage is None else usage
    )
    reasons = list(found)
    assert all(reason.text for reason in reasons)
    return [(reason.code, reason.rule) for reason in reasons]


def under(**fields: Any) -> Configuration:
    return replace(unproved(), site=replace(unproved().site, **fields))


def skill_changed(**fields: Any) -> Configuration:
    ecm = unproved().modules["handling"]
    skills = {**ecm.skills, "quickly": replace(ecm.skills["quickly"], **fields)}
    return replace(unproved(), modules={"handling": replace(ecm, skills=skills)})


def test_a_skill_may_ask_for_what_its_actuators_and_risk_allow() -> None:
    for kind in ("move", "carry", "sweep", "stop"):
        assert objections("quickly", kind) == []


def test_an_unknown_kind_objects_alone_and_hides_no_other_layer() -> None:
    assert objections(kind="dance") == [("AE702", "dance")]
    assert objections("fast", "dance") == [("AE702", "dance"), ("AE720", "fast")]


def test_an_unknown_module_and_an_unknown_skill_object() -> None:
    assert objections(module="handlin") == [("AE720", "handlin")]
    assert objections("fast") == [("AE720", "fast")]


@pytest.mark.parametrize(
    ("module", "skill", "action", "matches"),
    [
        (None, None, None, True),
        ("handling", "quickly", "carry", True),
        ("handling", None, "carry", True),
        ("others", None, None, False),
        (None, "slowly", None, False),
        (None, None, "move", False),
    ],
)
def test_an_override_blocks_what_all_its_fields_match(
    module: str | None, skill: str | None, action: str | None, matches: bool
) -> None:
    block = OperatorOverride("lent", "it is lent", module, skill, action)
    assert objections(under=under(blocks=(block,))) == [("AE710", "lent")] * matches


def test_every_matching_override_objects() -> None:
    blocks = tuple(OperatorOverride(name, "", None, None, None) for name in ("a", "b"))
    assert objections(under=under(blocks=blocks)) == [("AE710", "a"), ("AE710", "b")]


def test_an_actuator_needs_skill_module_and_site() -> None:
    assert objections(under=skill_changed(actuators=frozenset())) == [("AE740", "arm")]
    ecm = unproved().modules["handling"]
    asks_nothing = replace(unproved(), modules={"handling": replace(ecm, requested_access=Access())})
    assert objections(under=asks_nothing) == [("AE740", "arm")]
    assert objections(under=under(access=Access())) == [("AE740", "arm")]
    assert objections(kind="drive") == [("AE740", "wheels")]


def test_missing_actuators_are_named_in_order() -> None:
    site = unproved().site
    kinds = {**site.kinds, "carry": replace(site.kinds["carry"], actuators=frozenset({"b", "c", "a", "arm"}))}
    assert objections(under=under(kinds=kinds)) == [("AE740", "a"), ("AE740", "b"), ("AE740", "c")]


def test_a_channel_needs_module_and_site() -> None:
    ecm, site = unproved().modules["handling"], unproved().site
    tool = Tool(Program(("ask",)), Fraction(1), (), "internet")
    kinds = {**site.kinds, "carry": replace(site.kinds["carry"], tool=tool)}
    internet = frozenset({"internet"})
    for asked, granted in ((False, False), (False, True), (True, False), (True, True)):
        requested = replace(ecm.requested_access, channels=internet if asked else frozenset())
        for_all = replace(site.access, channels=internet if granted else frozenset())
        configuration = replace(
            unproved(),
            site=replace(site, kinds=kinds, access=for_all),
            modules={"handling": replace(ecm, requested_access=requested)},
        )
        expected = [] if asked and granted else [("AE740", "internet")]
        assert objections(under=configuration) == expected
        alone = replace(
            configuration.site, access=site.access, grants={"handling": Access(channels=internet)}
        )
        assert objections(under=replace(configuration, site=alone)) == ([] if asked else expected)


@pytest.mark.parametrize(
    ("of_skill", "ceiling", "count"),
    [
        # `carry` is of medium risk.
        (Risk.MEDIUM, Risk.MEDIUM, 0),
        (Risk.HIGH, Risk.HIGH, 0),
        (Risk.LOW, Risk.MEDIUM, 1),
        (Risk.MEDIUM, Risk.LOW, 1),
        (Risk.HIGH, Risk.MEDIUM, 1),
        (Risk.LOW, Risk.LOW, 1),
    ],
)
def test_risk_is_at_most_the_skills_and_that_at_most_the_sites(
    of_skill: Risk, ceiling: Risk, count: int
) -> None:
    changed = skill_changed(risk=of_skill)
    changed = replace(changed, site=replace(changed.site, risk_ceiling=ceiling))
    assert objections(under=changed) == [("AE741", "quickly")] * count


@pytest.mark.parametrize(
    ("usage", "expected"),
    [
        ({"carry-rate": 2}, []),
        ({"carry-rate": 3}, [("AE742", "carry-rate")]),
        ({"carry-rate": 4}, [("AE742", "carry-rate")]),
        ({}, [("AE703", "carry-rate")]),
        ({"carry-rate": -1}, [("AE704", "carry-rate")]),
        ({"carry-rate": True}, [("AE704", "carry-rate")]),
        ({"carry-rate": 9.0}, [("AE704", "carry-rate")]),
        ({"carry-rate": None}, [("AE703", "carry-rate"), ("AE704", "carry-rate")]),
        ({"carry-rate": 0, "other": 0}, [("AE702", "other")]),
    ],
)
def test_a_quota_counts_up_to_its_limit_and_only_whole_numbers(
    usage: dict[str, Any], expected: list[tuple[str, str]]
) -> None:
    assert sorted(objections(usage=usage)) == expected


def test_a_quota_is_on_its_kinds_and_a_malformed_count_objects_to_every_kind() -> None:
    assert objections(kind="move", usage={}) == []
    assert objections(kind="move", usage={"carry-rate": 3}) == []
    assert objections(kind="move", usage={"carry-rate": -1}) == [("AE704", "carry-rate")]
