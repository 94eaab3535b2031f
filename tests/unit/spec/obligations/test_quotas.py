from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller
from aeros.runtime.gate.finite_layers import finite_objections
from aeros.runtime.gate.quotas import QuotaUsageCounter
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import Source
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.policy import Access, Quota
from aeros.spec.model.rules import Risk
from aeros.spec.model.site import Site
from aeros.spec.obligations.quotas import quota_implies, quota_obligations
from tests.repo.tree import ROOT

HERE = Source("site.yaml", "").span(0, 0)
BENCH = ROOT / "docs" / "codes" / "base" / "site.yaml"
TICK = 1 / 16
"""Fine enough that as many windows fit beside each other as would if time had no ticks."""


def quota(id_: str, at_most: int, within: int, *kinds: str) -> Quota:
    return Quota(id_, frozenset(kinds or ("grip",)), at_most, Fraction(within), HERE)


def most_within(one: Quota, window: int) -> int:
    """The most actions that the gate's own counting lets through in `window` seconds."""
    usage, executed = QuotaUsageCounter([one]), 0
    for tick in range(int(window / TICK) + 1):
        while usage.usage_at(tick * TICK)[one.id] < one.max_count:
            usage.count_execution("grip", tick * TICK)
            executed += 1
    return executed


@given(st.integers(1, 3), st.integers(1, 4), st.integers(1, 9), st.integers(1, 8))
def test_a_quota_implies_another_iff_the_gate_never_finds_the_other_used_up_first(
    at_most: int, within: int, other_at_most: int, other_within: int
) -> None:
    one, other = quota("one", at_most, within), quota("other", other_at_most, other_within)
    assert quota_implies(one, other) == (most_within(one, other_within) <= other_at_most)


@pytest.mark.parametrize(
    ("kinds", "implied"), [(("grip",), True), (("grip", "move"), False), (("move",), False)]
)
def test_a_quota_implies_none_on_other_action_kinds(kinds: tuple[str, ...], implied: bool) -> None:
    assert quota_implies(quota("one", 1, 60), quota("other", 1, 60, *kinds)) is implied


def _codes(site: Site) -> list[str]:
    return [one.diagnostic.code for one in quota_obligations(site) if one.diagnostic is not None]


@pytest.mark.parametrize("ceiling", list(Risk))
@pytest.mark.parametrize("risk", list(Risk))
@pytest.mark.parametrize("common", [(), ("arm",), ("gripper",), ("arm", "gripper")])
@pytest.mark.parametrize("granted", [(), ("arm",), ("gripper",)])
def test_a_quota_is_idle_iff_no_module_could_ever_pass_the_gate_with_what_it_counts(
    ceiling: Risk, risk: Risk, common: tuple[str, ...], granted: tuple[str, ...]
) -> None:
    """As "AE609", against the gate's own finite layers, asked for every module there could be."""
    plain = load_site(BENCH, Diagnostics())
    assert plain is not None
    grip = replace(plain.kinds["grip"], risk=risk, actuators=frozenset({"arm", "gripper"}))
    site = replace(
        plain,
        kinds={**plain.kinds, "grip": grip},
        risk_ceiling=ceiling,
        access=Access(actuators=frozenset(common)),
        grants={"tidy": Access(actuators=frozenset(granted))},
        blocks=(),
        quotas=(quota("grips", 1, 60, "grip"),),
    )
    assert (_codes(site) == ["AE609"]) == (not _ever_passes(site))


def _ever_passes(site: Site) -> bool:
    """Check that the largest declaration of a module passes the gate's finite layers."""
    found = load_ecm(BENCH.parent / "tidy", load_site(BENCH, Diagnostics()) or site, Diagnostics())
    assert found is not None
    for name in ("tidy", "anybody"):
        all_of_it = Access(actuators=frozenset({"arm", "gripper"}))
        for risk in Risk:
            skill = replace(found.ecm.skills["wipe"], actuators=all_of_it.actuators, risk=risk)
            ecm = replace(found.ecm, id=name, requested_access=all_of_it, skills={"wipe": skill})
            configuration = Configuration(site, {name: ecm}, {}, "")
            if not list(finite_objections(configuration, Caller(name, "wipe", {}), "grip", {"grips": 0})):
                return True
    return False


def test_one_of_two_equivalent_quotas_is_reported() -> None:
    site = load_site(BENCH, Diagnostics())
    assert site is not None
    twice = (quota("one", 2, 60), quota("other", 2, 60))
    assert _codes(replace(site, quotas=twice)) == ["AE610"]
    assert _codes(replace(site, quotas=(quota("one", 2, 60), quota("other", 1, 60)))) == ["AE610"]
    assert _codes(replace(site, quotas=(quota("one", 2, 60), quota("other", 3, 120)))) == []
