"""Suggestions to the author, against enumeration: repairs mend and are least, boundaries are right.

Every number that is written is a multiple of a half, so a comparison changes at one of them, or half way
between two; the points are those, what lies between them, and what lies beside each number of a repair.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.backends.oracle import Oracle
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.elaborate.scopes import action_scope
from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import parse
from aeros.spec.expr.semantics import Environment, is_true
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL
from aeros.spec.model.site import Site
from aeros.spec.obligations.obligation import Obligation
from aeros.spec.obligations.safety import safety_obligations
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.verification.discharge import ObligationResult, discharge_obligations
from aeros.spec.verification.explain import explain_findings
from tests.hypothesis_profiles import examples
from tests.property.mix import Mix

bounded = examples(80)

_SITE = """\
schema: aeros/site/1
id: small
description: One number of the state and one of the action.
state:
  near: {{type: bool, sensor: eye, max_age: 1 s}}
  x: {{type: real, unit: m, range: [-2, 2], sensor: eye, max_age: 1 s}}
actions:
  stop: {{description: protective stop, risk: low, protective: true}}
  move: {{description: moves, risk: low, parameters: {{y: {{type: real, unit: m, range: [-2, 2]}}}}}}
invariants:
  - {{id: bound, on: [move], require: "{rule}", rationale: tested here, source: this test}}
policy:
  risk_ceiling: low
  access: {{sensors: [eye]}}
  limits: {{skill_timeout: 60 s, retries: 2, replans: 5}}
"""
_MANIFEST = """\
schema: aeros/ecm/2
id: module
version: 1.0.0
description: What a test is about.
license: Apache-2.0
capabilities:
  moving: {{description: moves, provided_by: [go]}}
skills:
  go:
    description: go
    entry: skills:go
    outcomes:
      gone: {{effects: {{near: true}}}}
    envelope:
      move: "{envelope}"
    gated: [{gated}]
    risk: low
    timeout: 30 s
permissions:
  sensors: [eye]
  actions:
    move: "true"
dependencies:
  aeros: ">=0.1"
"""

HALVES = [Fraction(half, 2) for half in range(-4, 5)]
GRID = {Fraction(eighth, 8) for eighth in range(-16, 17)}
OFFSET = Fraction(1, 10**9)
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?= m)")


@dataclass
class Answered:
    """An envelope under a rule, and what `aeros verify` says of it."""

    folder: Path
    rule: str
    envelope: str
    gated: str = ""

    @cached_property
    def site(self) -> Site:
        (self.folder / "site.yaml").write_text(_SITE.format(rule=self.rule))
        site = load_site(self.folder / "site.yaml", Diagnostics())
        assert site is not None
        return site

    @cached_property
    def findings(self) -> dict[str, ObligationResult]:
        module = self.folder / "module"
        module.mkdir(exist_ok=True)
        (module / "skills.py").write_text("")
        (module / "ecm.yaml").write_text(_MANIFEST.format(envelope=self.envelope, gated=self.gated))
        sink = Diagnostics()
        loaded = load_ecm(module, self.site, sink)
        assert loaded is not None, list(sink)
        oracle = Oracle()
        claims = [one for one in safety_obligations(loaded.ecm, self.site) if isinstance(one, Obligation)]
        found = explain_findings(discharge_obligations(claims, oracle), self.site, oracle)
        return {str(one.obligation.id).removeprefix("safety/go/move/"): one for one in found}

    def condition(self, text: str) -> t.Term:
        return check(parse(text), action_scope(self.site, self.site.kinds["move"]), BOOL)

    def points(self, *texts: str) -> Iterator[Environment]:
        """A point for every way in which the numbers of the texts and of the grid can be ordered."""
        ys = set(GRID)
        for text in texts:
            for number in map(Fraction, NUMBER.findall(text)):
                ys |= {side * (number + by) for side in (1, -1) for by in (-OFFSET, 0, OFFSET)}
        xs = sorted(GRID) if re.search(r"\bx\b", " ".join((self.rule, *texts))) else [Fraction(0)]
        inside = sorted(y for y in ys if abs(y) <= 2)
        for near, x, y in itertools.product((False, True), xs, inside):
            yield {"near": near, "x": x, "y": y}

    def accepted(self, text: str) -> bool:
        """Return true if every action of the envelope `text` obeys the rule, and there is some action."""
        envelope, rule = self.condition(text), self.condition(self.rule)
        asked = [point for point in self.points(text, self.rule) if is_true(envelope, point)]
        return bool(asked) and all(is_true(rule, point) for point in asked)


def _moved(text: str) -> Iterator[tuple[Fraction, str]]:
    """`text` with one of its numbers moved to another half, and by what part of it."""
    for found in NUMBER.finditer(text):
        old = Fraction(found.group())
        for new in HALVES:
            if new != old:
                part = abs(new - old) / abs(old) if old else abs(new - old)
                yield part, f"{text[: found.start()]}{_shown(new)}{text[found.end() :]}"


def _shown(number: Fraction) -> str:
    return f"{float(number):g}"


_H = st.sampled_from(HALVES).map(_shown)
_RULES = st.one_of(
    *(
        st.builds(form.format, _H)
        for form in ("y <= {} m", "y < {} m", "y >= {} m", "near implies y <= {} m")
    ),
    st.builds("abs(y) <= {} m".format, st.sampled_from(HALVES[5:]).map(_shown)),
    st.builds("abs(y) < {} m".format, st.sampled_from(HALVES[5:]).map(_shown)),
)
_ENVELOPES = st.one_of(
    st.just("true"),
    *(st.builds(form.format, _H) for form in ("y <= {} m", "y < {} m", "y >= {} m", "near and y <= {} m")),
    st.builds("abs(y) <= {} m".format, st.sampled_from(HALVES[5:]).map(_shown)),
    st.builds("y >= {} m and y <= {} m".format, st.sampled_from(["-2", "-1.5"]), st.sampled_from(["1", "2"])),
)


def test_a_repair_mends_the_line_and_no_smaller_change_of_a_number_would(tmp_path: Path) -> None:
    seen = Mix()

    @bounded
    @given(_RULES, _ENVELOPES)
    def repairs_are_judged(rule: str, envelope: str) -> None:
        case = Answered(tmp_path, rule, envelope)
        old, required = case.condition(envelope), case.condition(rule)
        asked = [point for point in case.points(envelope, rule) if is_true(old, point)]
        allowed = [point for point in asked if is_true(required, point)]
        found = case.findings["bound"]
        seen.compare("AE501", proved=found.verdict is Verdict.PROVED, expected=len(allowed) == len(asked))
        if found.verdict is Verdict.PROVED or not allowed:
            assert not found.repair
            return
        offered = found.repair.removeprefix("move: ").strip('"')
        moves = [
            part for part, text in _moved(envelope) if _stricter(case, text, old) and case.accepted(text)
        ]
        seen.compare("a number can be moved", proved=_is_a_move(envelope, offered), expected=bool(moves))
        if not offered:
            return
        assert case.accepted(offered)
        assert _stricter(case, offered, old)
        if moves:
            assert _part(envelope, offered) <= min(moves)
            for laxer in _laxer(envelope, offered):
                assert not (_stricter(case, laxer, old) and case.accepted(laxer))

    repairs_are_judged()
    seen.assert_both("AE501", "a number can be moved")


def _stricter(case: Answered, text: str, old: t.Term) -> bool:
    new = case.condition(text)
    return all(is_true(old, point) for point in case.points(text, case.envelope) if is_true(new, point))


def _is_a_move(old: str, new: str) -> bool:
    return bool(new) and len(NUMBER.findall(old)) == len(NUMBER.findall(new)) > 0


def _part(old: str, new: str) -> Fraction:
    """By what part of it the number that differs was moved; nothing where only `<=` became `<`."""
    for before, after in zip(NUMBER.findall(old), NUMBER.findall(new), strict=True):
        if before != after:
            one, other = Fraction(before), Fraction(after)
            return abs(other - one) / abs(one) if one else abs(other - one)
    return Fraction(0)


def _laxer(old: str, new: str) -> Iterator[str]:
    """`new` with its number moved back by the least step, and with a bound let in that `old` lets in."""
    for before, after in zip(NUMBER.finditer(old), NUMBER.finditer(new), strict=True):
        if before.group() != after.group():
            one, other = Fraction(before.group()), Fraction(after.group())
            step = Fraction(1, 10**4) * (1 if one > other else -1)
            yield f"{new[: after.start()]}{float(other + step):.4f}{new[after.end() :]}"
    if old.count("=") > new.count("="):
        yield re.sub(r"([<>])(?!=)", r"\1=", new)


_GUARDED = st.one_of(
    *(st.builds(form.format, _H) for form in ("near implies y <= {} m", "x <= {} m", "2 * x < {} m")),
    *(
        st.builds(form.format, _H, _H)
        for form in (
            "x <= {} m or y <= {} m",
            "near implies (y <= {} m and x >= {} m)",
            "x > {} m implies (not near and y < {} m)",
            "abs(x) <= {} m and y <= {} m",
        )
    ),
)
_OVER_STATES = st.one_of(
    _ENVELOPES,
    st.builds("x <= {} m and y <= {} m".format, _H, _H),
    st.builds("near or y > {} m".format, _H),
)


def test_a_boundary_is_the_set_of_actions_that_the_rule_allows(tmp_path: Path) -> None:
    seen = Mix()
    shorter = 0

    @bounded
    @given(_GUARDED, _OVER_STATES)
    def boundaries_are_judged(rule: str, envelope: str) -> None:
        nonlocal shorter
        case = Answered(tmp_path, rule, envelope, gated="bound")
        inside, required = case.condition(envelope), case.condition(rule)
        asked = [point for point in case.points(envelope, rule) if is_true(inside, point)]
        kept = [is_true(required, point) for point in asked]
        found = case.findings["bound"]
        seen.compare("guarded", proved=found.is_runtime_checked, expected=not all(kept))
        if found.is_runtime_checked:
            boundary = case.condition(found.boundary)
            assert [is_true(boundary, point) for point in asked] == kept
            shorter += found.boundary != rule

    boundaries_are_judged()
    seen.assert_both("guarded")
    assert shorter >= 20
