"""A repaired quota is gone, or counts less, and no run of actions is decided otherwise."""

from __future__ import annotations

from fractions import Fraction
from itertools import accumulate

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.gate.quotas import QuotaUsageCounter
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import Source
from aeros.spec.elaborate.load import elaborate_source
from aeros.spec.model.policy import Quota
from aeros.spec.obligations.quotas import denial_of_kind, quota_obligations
from aeros.spec.text.files import read_source
from aeros.spec.verification.repairs.quota_repair import find_quota_repairs, repair_quotas
from tests.hypothesis_profiles import examples
from tests.repo.tree import ROOT

ACCEPTED = ROOT / "tests" / "corpus" / "accepted"
SITE = read_source(ACCEPTED / "quota_on_what_is_too_risky" / "site.yaml").text
LINE = "    - {id: rate, on: [grip, move], at_most: 3, within: 10 s, rationale: wear}\n"


def with_quotas(*lines: str) -> Source:
    return Source("site.yaml", SITE.replace(LINE, "".join(lines)))


def quota(name: str, kinds: str, most: int, seconds: int) -> str:
    return f"    - {{id: {name}, on: [{kinds}], at_most: {most}, within: {seconds} s, rationale: wear}}\n"


RATE = LINE.replace("[grip, move]", "[grip]")
FIVE = quota("a", "grip", 5, 60)
BLOCK = """\
    - id: rate
      on:
{}        - grip  # often
      at_most: 3
      within: 10 s
      rationale: wear
"""


def quotas_of(source: Source) -> tuple[Quota, ...]:
    site = elaborate_source(source, Diagnostics())
    assert site is not None
    return site.quotas


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ([LINE], [RATE]),
        ([LINE.replace("[grip, move]", '["move", grip]')], [RATE]),
        ([BLOCK.format("        - move\n")], [BLOCK.format("")]),
        (["    # life\n", FIVE, quota("b", "grip", 10, 120)], ["    # life\n", FIVE]),
        ([quota("a", "move", 9, 60), quota("b", "grip", 10, 120)], [quota("b", "grip", 10, 120)]),
        ([quota("a", "grip, move", 5, 60), quota("b", "grip", 9, 60)], [FIVE]),
        ([FIVE, quota("b", "grip", 9, 120)], None),
    ],
)
def test_parts_that_change_no_decision_are_removed(before: list[str], after: list[str] | None) -> None:
    assert repair_quotas(with_quotas(*before)) == with_quotas(*(after or before)).text


def test_of_the_last_quota_an_empty_list_stays() -> None:
    repaired = repair_quotas(with_quotas(quota("a", "move", 3, 10)))
    assert "  quotas: []\n" in repaired
    assert quotas_of(Source("site.yaml", repaired)) == ()


def test_quotas_of_an_overlay_are_left_to_its_author() -> None:
    site = elaborate_source(with_quotas(LINE), Diagnostics())
    assert site is not None
    other = Source("overlay.yaml", with_quotas(LINE).text)
    assert find_quota_repairs(site, other, quota_obligations(site)) == {}


KINDS = ("grip", "move")
QUOTAS = st.lists(
    st.builds(
        quota, st.sampled_from("abcd"), st.sampled_from(("grip", "move", "grip, move")),
        st.integers(1, 6), st.integers(1, 12),
    ),
    min_size=1,
    max_size=4,
    unique_by=lambda line: line.split("id: ")[1][0],
)  # fmt: skip
RUNS = st.lists(st.tuples(st.fractions(0, 3, max_denominator=4), st.sampled_from(KINDS)), max_size=30)


def decided(quotas: tuple[Quota, ...], run: list[tuple[Fraction, str]]) -> list[bool]:
    """Decide each action of a run by the gate's own counter, whose windows are closed."""
    counter, verdicts = QuotaUsageCounter(quotas), []
    for at, kind in run:
        usage = counter.usage_at(float(at))
        verdicts.append(all(kind not in one.kinds or usage[one.id] < one.max_count for one in quotas))
        if verdicts[-1]:
            counter.count_execution(kind, float(at))
    return verdicts


@examples(20)
@given(QUOTAS, RUNS)
def test_no_run_is_decided_otherwise(lines: list[str], waits: list[tuple[Fraction, str]]) -> None:
    source = with_quotas(*lines)
    site = elaborate_source(source, Diagnostics())
    assert site is not None
    times = accumulate(wait for wait, _ in waits)
    run = [
        (at, kind) for at, (_, kind) in zip(times, waits, strict=True) if denial_of_kind(site, kind) is None
    ]
    repaired = Source("site.yaml", repair_quotas(source))
    assert decided(quotas_of(repaired), run) == decided(site.quotas, run)
    again = elaborate_source(repaired, Diagnostics())
    assert again is not None
    assert [one for one in quota_obligations(again) if one.diagnostic is not None] == []
