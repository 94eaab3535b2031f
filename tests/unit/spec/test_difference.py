"""Differences are decided rightly: against enumeration, in both directions, with witnesses that replay."""

from __future__ import annotations

import itertools
import shutil
from collections.abc import Iterator, Mapping
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.diagnostics.source import Source
from aeros.spec.difference.compare import PolicyDifference, compare
from aeros.spec.difference.policy_change import PolicyChange, Relation
from aeros.spec.difference.set_comparison import ComparedSet, SetCondition, compare_sets
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import Value, is_true
from aeros.spec.expr.types import BOOL, RealType
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.variables import Declared
from tests.hypothesis_profiles import examples

BASE = Path(__file__).parents[3] / "docs" / "codes" / "base"
LIMIT = 1_000_000


@pytest.fixture
def old(tmp_path: Path) -> Path:
    return Path(shutil.copytree(BASE, tmp_path / "old"))


@pytest.fixture
def new(tmp_path: Path) -> Path:
    return Path(shutil.copytree(BASE, tmp_path / "new"))


def change(path: Path, before: str, after: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count(before) == 1, before
    path.write_text(text.replace(before, after), encoding="utf-8")


def modules(old: Path, new: Path) -> PolicyDifference:
    return compare(old / "tidy", new / "tidy", BASE / "site.yaml")


def sites(old: Path, new: Path) -> PolicyDifference:
    return compare(old / "site.yaml", new / "site.yaml", BASE / "site.yaml")


def changed(difference: PolicyDifference) -> dict[str, str]:
    assert difference.problems == ()
    return {
        one.subject: one.relation.value for one in difference.changes if one.relation is not Relation.EQUAL
    }


MODULE_CHANGES = [
    # 1: newly allowed, and newly denied the other way round; -1: the reverse.
    ("force <= 10 N", "force <= 11 N", {"tidy/pick_cloth/grip": 1}),
    (
        "precondition: cloth_held\n",
        "precondition: cloth_held or bench_clean\n",
        {"tidy/wipe/precondition": 1},
    ),
    (
        "entry: skills:pick_cloth\n",
        "entry: skills:pick_cloth\n    hold: human_distance > 1 m\n",
        {"tidy/pick_cloth/hold": -1},
    ),
    (
        "range: [0, 20], default",
        "range: [0, 21], default",
        {"tidy/rest/wait": 1, "tidy/rest/precondition": 1},
    ),
    ("timeout: 20 s", "timeout: 21 s", {"tidy/pick_cloth/timeout": 1}),
    ("timeout: 20 s", "timeout: 20 s\n    idempotent: true", {"tidy/pick_cloth/idempotent": 1}),
    ("timeout: 20 s", "timeout: 20 s\n    idempotent: false", {}),
    (
        "      wait: duration <= 5 s\n",
        "      wait: duration <= 5 s\n      turn: true\n",
        {},
    ),
    (
        "sensors: [scanner, gripper, camera]",
        "sensors: [scanner, gripper, camera, panel]",
        {"tidy/sensors": 1},
    ),
    ("    wait: duration <= 20 s", "    wait: duration <= 4 s", {"tidy/wipe/wait": -1, "tidy/rest/wait": -1}),
    ("    grip: force <= 15 N\n", "", {"tidy/pick_cloth/grip": -1}),
    ("    resources: [arm]\n", "", {"tidy/wipe/resources": -1}),
]


@pytest.mark.parametrize(("before", "after", "expected"), MODULE_CHANGES)
def test_a_change_of_a_module_is_found_in_its_direction(
    before: str, after: str, expected: dict[str, int], old: Path, new: Path
) -> None:
    change(new / "tidy" / "ecm.yaml", before, after)
    words = {1: "newly allowed", -1: "newly denied"}
    assert changed(modules(old, new)) == {name: words[way] for name, way in expected.items()}
    assert changed(modules(new, old)) == {name: words[-way] for name, way in expected.items()}


SITE_CHANGES = [
    ("require: force <= 30 N", "require: force <= 31 N", {"actions/grip": 1}),
    ("risk_ceiling: medium", "risk_ceiling: high", {"policy/risk_ceiling": 1}),
    ("actuators: [arm, gripper]\n", "actuators: [arm]\n", {"policy/access/actuators": -1}),
    ("retries: 3", "retries: 4", {"policy/limits/retries": 1}),
    ("replans: 10}", "replans: 10, planning: 20 s}", {"policy/limits/planning": -1}),
    ("at_most: 60", "at_most: 50", {"policy/quotas/grip-rate": -1}),
    ("within: 60 s", "within: 50 s", {"policy/quotas/grip-rate": 1}),
    ("resources: {arm: 1}", "resources: {arm: 2}", {"resources/arm": 1}),
    ("sensor: camera, max_age: 1 s", "sensor: camera, max_age: 2 s", {"state/bench_clean/max_age": 1}),
    ("angle: {type: real, unit: rad, range: [-4, 4]}", "angle: {type: real, unit: rad, range: [-1, 4]}",
     {"actions/turn": -1}),
    ("unit: m, range: [0, 20]", "unit: m, range: [0, 9]",
     {"actions/move": -1, "actions/turn": -1, "actions/grip": -1}),
    ("  quotas:\n", "  blocks:\n    - {id: no-turns, action: turn, reason: an example}\n  quotas:\n",
     {"actions/turn": -1, "policy/blocks/no-turns": -1}),
    ("  quotas:\n", "  isolation: {trusted: [tidy]}\n  quotas:\n", {"policy/isolation/trusted": 1}),
    ("  quotas:\n", "  isolation: {require: [seccomp, rlimits]}\n  quotas:\n",
     {"policy/isolation/require": 1}),
    ("  quotas:\n", "  undeclared_outcome: replan\n  quotas:\n", {"policy/undeclared_outcome": 1}),
    ("  quotas:\n", "  isolation: {missing: warn}\n  quotas:\n", {"policy/isolation/missing": 1}),
    ("  quotas:\n", "  isolation: {answer_within: 2 s}\n  quotas:\n", {"policy/isolation/answer_within": -1}),
    ("  quotas:\n", "  mcp: {execute: allowed}\n  quotas:\n", {"policy/mcp/execute": 1}),
    ("  quotas:\n", "  mcp: {execute: denied}\n  quotas:\n", {"policy/mcp/execute": -1}),
    ("  quotas:\n", "  mcp: {most_steps: 21}\n  quotas:\n", {"policy/mcp/most_steps": 1}),
    ("  quotas:\n", "  mcp: {skills: [tidy.put]}\n  quotas:\n", {"policy/mcp/skills": -1}),
]  # fmt: skip


@pytest.mark.parametrize(("before", "after", "expected"), SITE_CHANGES)
def test_a_change_of_a_site_is_found_in_its_direction(
    before: str, after: str, expected: dict[str, int], old: Path, new: Path
) -> None:
    change(new / "site.yaml", before, after)
    words = {1: "newly allowed", -1: "newly denied"}
    assert changed(sites(old, new)) == {name: words[way] for name, way in expected.items()}
    assert changed(sites(new, old)) == {name: words[-way] for name, way in expected.items()}


@pytest.mark.parametrize(("before", "after", "expected"), SITE_CHANGES)
def test_a_change_of_a_site_is_shown_where_it_is_written(
    before: str, after: str, expected: dict[str, int], old: Path, new: Path
) -> None:
    change(new / "site.yaml", before, after)
    for one in sites(old, new).changes:
        for told in one.diagnostics:
            assert told.primary is not None, (one.subject, expected)
            assert told.primary.span.source.path.endswith("site.yaml")


def test_a_limit_is_shown_as_it_was_and_as_it_is(old: Path, new: Path) -> None:
    change(new / "site.yaml", "skill_timeout: 60 s", "skill_timeout: 61 s")
    (told,) = (one for change_ in sites(old, new).changes for one in change_.diagnostics)
    assert told.primary is not None
    assert [told.primary.span.text, *(label.span.text for label in told.secondary)] == ["61 s", "60 s"]


def test_a_rewriting_is_equal(old: Path, new: Path) -> None:
    change(new / "site.yaml", "abs(angle) <= 90 deg", "-90 deg <= angle and not angle > 90 deg")
    change(new / "tidy" / "ecm.yaml", "duration <= inputs.pause", "not duration > inputs.pause")
    assert changed(sites(old, new)) == changed(modules(old, new)) == {}


def test_what_no_rule_allows_is_not_newly_allowed(old: Path, new: Path) -> None:
    for path, before in ((old, "40 N"), (new, "50 N")):
        change(path / "tidy" / "ecm.yaml", "grip: force <= 15 N", "grip: force <= 60 N")
        change(path / "tidy" / "ecm.yaml", "grip: force <= 10 N", f"grip: force <= {before}")
    assert changed(modules(old, new)) == {}


def test_a_new_skill_is_newly_allowed_whatever_its_inputs(old: Path, new: Path) -> None:
    manifest = old / "tidy" / "ecm.yaml"
    text = manifest.read_text()
    start, end = text.index("  rest:\n"), text.index("tasks:\n")
    text = text[:start] + text[end:]
    manifest.write_text(text.replace("        - {skill: rest}\n", ""))
    assert changed(modules(old, new)) == {"tidy/rest/wait": "newly allowed"}
    assert changed(modules(new, old)) == {"tidy/rest/wait": "newly denied"}


def test_an_input_of_another_type_cannot_be_compared(old: Path, new: Path) -> None:
    change(new / "tidy" / "ecm.yaml", "pause: {type: real, unit: s, range: [0, 20], default: 2 s}",
           "pause: {type: real, unit: m, range: [0, 20], default: 2 m}")  # fmt: skip
    change(new / "tidy" / "ecm.yaml", "duration <= inputs.pause", "duration <= 5 s")
    assert changed(modules(old, new)) == {
        "tidy/rest/wait": "not comparable",
        "tidy/rest/precondition": "not comparable",
    }
    assert modules(old, new).undecided


def test_what_is_new_in_the_vocabulary_is_said_and_may_have_any_value(old: Path, new: Path) -> None:
    line = "  bench_clean: {type: bool, sensor: camera, max_age: 1 s}"
    change(new / "site.yaml", line, f"{line}\n  lid_open: {{type: bool, sensor: camera, max_age: 1 s}}")
    change(new / "site.yaml", "require: force <= 30 N", "require: force <= 30 N and not lid_open")
    assert changed(sites(old, new)) == {"actions/grip": "newly denied", "state/lid_open": "changed"}


JOINT = """joint:
  - id: slow-beside-whoever-waits
    on: {moving: move, waiting: wait}
    require: moving.speed <= 100 mm/s or waiting.duration <= 1 s
    rationale: an example
    source: tests

policy:
"""


def test_a_joint_rule_is_compared_by_the_pairs_it_allows(old: Path, new: Path) -> None:
    change(new / "site.yaml", "policy:\n", JOINT)
    assert changed(sites(old, new)) == {"joint/slow-beside-whoever-waits": "newly denied"}
    assert changed(sites(new, old)) == {"joint/slow-beside-whoever-waits": "newly allowed"}
    change(old / "site.yaml", "policy:\n", JOINT.replace("100 mm/s", "200 mm/s"))
    assert changed(sites(old, new)) == {"joint/slow-beside-whoever-waits": "newly denied"}


def _named(difference: PolicyDifference, subject: str) -> PolicyChange:
    (found,) = [one for one in difference.changes if one.subject == subject]
    return found


def test_both_lines_are_shown_and_the_witness_is_in_one_set_alone(old: Path, new: Path) -> None:
    change(new / "tidy" / "ecm.yaml", "force <= 10 N", "force <= 11 N")
    one = _named(modules(old, new), "tidy/pick_cloth/grip")
    (told,) = one.diagnostics
    assert told.primary is not None
    assert (told.primary.span.text, told.secondary[0].span.text) == ("force <= 11 N", "force <= 10 N")
    assert Fraction(10) < one.witnesses["newly allowed"].values["force"] <= Fraction(11)  # type: ignore[operator]


# Against enumeration: sets of two truth values and a number, all conditions over them.

_SOURCE = Source("test", "x")
_SPAN = _SOURCE.span(0, 1)
_NUMBERS = RealType(NUMBER)
_P, _Q = (t.Variable(name, BOOL, t.VariableRole.STATE) for name in "pq")
_X = t.Variable("x", _NUMBERS, t.VariableRole.PARAMETER)


def _number(value: int) -> t.Literal:
    return t.Literal(Fraction(value, 2), _NUMBERS)


_ATOMS: st.SearchStrategy[t.Term] = st.one_of(
    st.sampled_from([_P, _Q, t.TRUE, t.FALSE]),
    st.builds(
        lambda op, n: t.Compare(op, _X, _number(2 * n)), st.sampled_from(["<", "<=", "=="]), st.integers(0, 4)
    ),
)
_TERMS: st.SearchStrategy[t.Term] = st.recursive(
    _ATOMS,
    lambda inner: st.one_of(
        st.builds(t.Not, inner),
        st.builds(lambda a, b: t.And((a, b)), inner, inner),
        st.builds(lambda a, b: t.Or((a, b)), inner, inner),
    ),
    max_leaves=6,
)
_RANGES = st.tuples(st.integers(0, 2), st.integers(2, 4)).map(
    lambda ends: (Fraction(ends[0]), Fraction(ends[1]))
)


def _side(terms: list[t.Term], bounds: tuple[Fraction, Fraction]) -> ComparedSet:
    declared = (Declared(_P, _SPAN), Declared(_Q, _SPAN), Declared(_X, _SPAN, range=bounds))
    return ComparedSet(declared, tuple(SetCondition(term, _SPAN) for term in terms), _SPAN)


def _members(side: ComparedSet) -> Iterator[tuple[bool, bool, Fraction]]:
    """Every member with `x` at a bound or between two: conditions are constant in between."""
    for p, q, half in itertools.product((False, True), (False, True), range(9)):
        x = Fraction(half, 2)
        if _has(side, {"p": p, "q": q, "x": x}):
            yield p, q, x


@examples(150)
@given(st.lists(_TERMS, max_size=2), _RANGES, st.lists(_TERMS, max_size=2), _RANGES)
def test_the_relation_of_two_sets_is_that_of_enumeration(
    one: list[t.Term],
    one_range: tuple[Fraction, Fraction],
    other: list[t.Term],
    other_range: tuple[Fraction, Fraction],
) -> None:
    before, after = _side(one, one_range), _side(other, other_range)
    found = compare_sets("test", "a test", before, after, LIMIT)
    old, new = set(_members(before)), set(_members(after))
    assert ("newly allowed" in found.witnesses, "newly denied" in found.witnesses) == (
        bool(new - old),
        bool(old - new),
    )
    for direction, inside, outside in (("newly allowed", after, before), ("newly denied", before, after)):
        if direction in found.witnesses:
            values = {"p": False, "q": False, "x": _bounds(inside)[0], **found.witnesses[direction].values}
            assert _has(inside, values)
            assert not _has(outside, values)


def _bounds(side: ComparedSet) -> tuple[Fraction, Fraction]:
    return side.variables[2].range or (Fraction(0), Fraction(0))


def _has(side: ComparedSet, values: Mapping[str, Value]) -> bool:
    low, high = _bounds(side)
    x = values["x"]
    assert isinstance(x, Fraction)
    return low <= x <= high and all(is_true(one.term, values) for one in side.conditions)


def test_a_change_of_what_motions_are_decided_by_is_told_as_allowing_more_and_less(
    old: Path, new: Path
) -> None:
    change(new / "site.yaml", "clearance: 10 mm", "clearance: 9 mm")
    assert changed(sites(old, new)) == {"motion": "incomparable"}
    assert [one.subject for one in sites(old, new).changes if one.relation.allows_more] == ["motion"]
