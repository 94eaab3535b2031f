from __future__ import annotations

import re
import sys
import time
from collections.abc import Callable
from fractions import Fraction

import pytest

from aeros.spec.backends import compiled, z3_solver
from aeros.spec.backends.solver_results import SatResult, ScalarValue
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower, scalar_variables, size_bounds
from aeros.spec.expr.parser import parse
from aeros.spec.expr.random_terms import MODE
from aeros.spec.expr.scope import ExpressionTypeError
from aeros.spec.expr.semantics import Value, evaluate, is_true
from aeros.spec.expr.syntax import TextRange
from aeros.spec.expr.typecheck.check import MAX_HEIGHT, check, check_condition, infer
from aeros.spec.expr.typecheck.traversal import TypeChecker
from aeros.spec.expr.types import BOOL, RealType, Type, VectorType
from aeros.spec.expr.units import LENGTH, NUMBER
from tests.unit.spec.expr.scope import GRIP, SCOPE, SPEED, term_of
from tests.unit.spec.expr.typecheck.type_rules import type_of

ENV: dict[str, Value] = {
    "kettle.hot": True,
    "kettle.level": Fraction(1, 10),
    "kettle.spout": (Fraction(1), Fraction(2), Fraction(3)),
    "a": True,
    "b": False,
    "mode": "idle",
    "arm": "j2",
    "n": Fraction(3),
    "x": Fraction(1),
    "y": Fraction(-2),
    "p": (Fraction(3), Fraction(4), Fraction(0)),
    "q": (Fraction(0), Fraction(0), Fraction(0)),
    "joint": (Fraction(1), Fraction(2), Fraction(3)),
    "ready": (True, False, True),
    "speed": Fraction(1, 4),
    "k": Fraction(2),
    "laps": Fraction(7),
    "v": (Fraction(1), Fraction(2), Fraction(2)),
    "grip": "stop",
    "inputs.pace": Fraction(1),
    "inputs.grip": "open",
}
TRUE = [
    "2 * laps + 1 == 15",
    "laps * 0.5 <= 3.5 and laps > n",
    "speed <= 250 mm/s",
    "speed < inputs.pace",
    "speed == 0.25 m/s",
    "speed != 1 m/s",
    "0 m < x <= reach + 15 cm",
    "x > y and x >= y and not y > x",
    "x - y == 3 m",
    "x - 25 cm == 75 cm",
    "-y == 2 m",
    "y * k == -4 m",
    "x * x == 1 m^2",
    "x / 4 == 25 cm",
    "x / 2 m == 50 %",
    "p / 2 == vec(1.5 m, 2 m, 0 m)",
    "k * p == p * k and p + q == p and p - p == q and -p != p",
    "v / 2 == vec(0.5 m/s, 1 m/s, 1 m/s)",
    "norm(p) == 5 m and norm(p) <= 5 m and norm(p) >= 5 m and 5 m == norm(p)",
    "not norm(p) < 5 m and not norm(p) > 5 m and not norm(p) != 5 m",
    "norm(p) > -6 m and norm(p) >= -6 m and norm(p) != -5 m and -6 m < norm(p)",
    "not norm(p) < -6 m and not norm(p) <= -6 m and not norm(p) == -5 m",
    "norm(q) <= 0 m and norm(q) == 0 m and not norm(q) < 0 m",
    "distance(p, q) == norm(p) and distance(p, p) < distance(p, q) and norm(p) != norm(q)",
    "distance(p, home) <= 5 m < distance(vec(6 m, 0 m, 0 m), home)",
    "dot(p, v) == 11 m^2/s",
    "min(x, y) == y and max(x, y) == x and abs(y) == 2 m",
    "clamp(y, 0 m, 1 m) == 0 m and clamp(3 m, 0 m, 1 m) == 1 m and clamp(x, 2 m, 1 m) == 1 m",
    "grip == (if a then stop else open)",
    "limit[j1] / 2 m == 50 %",
    "mode == idle and idle == mode and mode != stop",
    "grip == stop and stop == grip and stop != inputs.grip",
    "mode in {idle, move} and mode not in {stop}",
    "q in cell and p not in cell and vec(1 m, -1 m, 1 m) in cell",
    "joint[arm] == 2 m and joint[j1] == 1 m and joint[if a then j3 else j1] == 3 m",
    "limit[arm] == joint[arm]",
    "ready[j1] and not ready[arm]",
    "all(joint[j] <= limit[j] for j in Joint)",
    "any(joint[j] > 2 m for j in Joint) and not any(joint[j] > 3 m for j in Joint)",
    "any(all(joint[i] >= joint[j] for j in Joint) for i in Joint)",
    "any(j == arm and j2 == j for j in Joint)",
    "any(stop == g for g in Grip)",
    "sum(k * joint[j] for j in Joint) == 12 m and count(joint[j] > 1 m for j in Joint) == 2",
    "sum(joint[j] * joint[j] for j in Joint) == 14 m^2",
    "all(vec(0 m, joint[j], 0 m) in cell or joint[j] > 1 m for j in Joint)",
    "not cell.lower == cell.upper and cell.upper.x == 1 m",
    "any(vec(x, joint[j], x) == vec(x, 3 m, x) for j in Joint)",
    "all(limit[j] <= joint[if ready[j] then j else arm] for j in Joint)",
    "sum(abs(joint[j] - 2 m) for j in Joint) == 2 m",
    "sum(max(joint[j], 2 m) + min(2 m, joint[j]) - clamp(joint[j], 1 m, 3 m) for j in Joint) == 6 m",
    "sum(if joint[j] < 2 m then 5 m else joint[j] for j in Joint) == 10 m",
    "3 m == norm(p - vec(1 m, 2 m, 1 m)) and k != k - 1",
    "(if b then p else q) == q and (if a then mode else stop) == idle",
    "b implies a implies b",
    "a == true and b != true",
    "p.x == 3 m and (p + p).y == 8 m",
]


def _decided_by_all(term: t.Term) -> set[bool]:
    """Decide `term` at `ENV` by each back end; the set has one element if they agree."""
    names = [scalar.name for one in SCOPE.variables.values() for scalar in scalar_variables(one)]
    ranges = dict.fromkeys([*names, "inputs.pace"], (Fraction(-10), Fraction(10)))
    variables = {one.name: one for one in (*SCOPE.variables.values(), *SCOPE.inputs.values())}
    exact: dict[str, ScalarValue] = {}
    for name, variable in variables.items():
        value = ENV[name]
        parts = value if isinstance(value, tuple) else (value,)
        exact |= {part.name: v for part, v in zip(scalar_variables(variable), parts, strict=True)}
    raw = {name: float(value) if isinstance(value, Fraction) else value for name, value in exact.items()}
    session = z3_solver.IncrementalSolver(variables.values(), ranges)
    return {
        is_true(term, ENV),
        is_true(lower(term), exact),
        compiled.compile_condition(term, ranges)(raw),
        session.check_at_values(exact, term).result is SatResult.SAT,
        session.check_at_values(exact, t.Not(term)).result is SatResult.UNSAT,
    }


@pytest.mark.parametrize("text", TRUE)
def test_a_condition_means_what_an_engineer_reads(text: str) -> None:
    term = term_of(text)
    assert type_of(term) == type_of(lower(term)) == BOOL
    assert _decided_by_all(term) == {True}


FAULTS = [
    ("sped <= 1 m/s", "AE202", "`sped` is not declared here", "sped", "did you mean `speed`?"),
    ("mode == idel", "AE202", "`idel` is not a member of Mode", "idel", "did you mean `idle`?"),
    ("mode in {idel}", "AE202", "`idel` is not a member of Mode", "idel", "did you mean `idle`?"),
    ("mode in {speed}", "AE202", "`speed` is not a member of Mode", "speed", None),
    ("mode in {arm}", "AE202", "`arm` is not a member of Mode", "arm", None),
    ("stop == stop", "AE202", "`stop` is a member of Mode and of Grip", "stop", "variable == member"),
    ("nrom(p) <= 1 m", "AE202", "there is no function `nrom`", "nrom", "did you mean `norm`?"),
    ("p in cel", "AE202", "`cel` is not a volume of this site", "cel", "did you mean `cell`?"),
    ("all(a for j in Joints)", "AE202", "`Joints` is not a set", "Joints", "did you mean `Joint`?"),
    ("speed <= inputs.pase", "AE202", "there is no input `pase`", "inputs.pase", "`pace`"),
    (
        "all(a for x in Joint)",
        "AE202",
        "`x` already has a meaning here",
        "x",
        "choose another name for the index",
    ),
    ("all(a for reach in Joint)", "AE202", "`reach` already has a meaning here", "reach", None),
    ("all(a for inputs in Joint)", "AE202", "`inputs` already has a meaning here", "inputs", None),
    ("all(a for j1 in Joint)", "AE202", "`j1` already has a meaning here", "j1", None),
    ("all(all(a for j in Mode) for j in Joint)", "AE202", "`j` already has a meaning here", "j", None),
    ("all(a for j in Joint) and j == j1", "AE202", "`j` is not declared here", "j", None),
    (
        "once a",
        "AE209",
        "`once` reads the past, which only a site's invariants may do",
        "once a",
        "as an inv",
    ),
    ("x + speed <= 1 m", "AE204", "real [m] is added to real [m/s]", "speed", "same unit"),
    ("x <= 3", "AE204", "real [m] is compared with real [1]", "3", "as in `3 m`"),
    ("p == v", "AE204", "vec3 [m] is compared with vec3 [m/s]", "v", None),
    ("distance(p, v) <= 1 m", "AE204", "vec3 [m] is compared with vec3 [m/s]", "v", None),
    ("norm(p) <= 1 m/s", "AE204", "real [m] is compared with real [m/s]", "1 m/s", None),
    ("norm(v) < distance(p, q)", "AE204", "real [m/s] is compared with real [m]", "distance(p, q)", None),
    ("min(x, speed) <= 1 m", "AE204", "real [m] is combined with real [m/s]", "speed", None),
    ("vec(x, x, n) == p", "AE204", "real [m] is combined with real [1]", "n", None),
    ("v in cell", "AE204", "a point is a vec3 [m], not vec3 [m/s]", "v", None),
    ("(if a then x else n) <= x", "AE204", "real [m] is the alternative of real [1]", "n", None),
    ("a + x <= x", "AE203", "bool cannot be added to anything", "a", None),
    ("x <= p", "AE203", "real [m] is compared with vec3 [m]", "p", None),
    ("p <= q", "AE203", "vec3 [m] has no order", "p", "compare with `==` or `!=`"),
    ("mode < stop", "AE203", "Mode has no order", "mode", None),
    ("a < b", "AE203", "bool has no order", "a", None),
    ("mode == arm", "AE203", "Mode is compared with Joint", "arm", None),
    ("x and a", "AE203", "expected a condition, found real [m]", "x", None),
    ("not x", "AE203", "expected a condition, found real [m]", "x", None),
    ("x", "AE203", "expected bool, found real [m]", "x", None),
    ("p * q == p", "AE203", "a factor must be a real number, not vec3 [m]", "q", None),
    ("a * x == x", "AE203", "a factor must be a real number, not bool", "a", None),
    ("x * a == x", "AE203", "bool cannot be multiplied", "a", None),
    ("x.y <= x", "AE203", "real [m] has no component `y`", "y", "x, y and z"),
    ("p.w <= x", "AE203", "vec3 [m] has no component `w`", "w", None),
    ("x[j1] <= x", "AE203", "real [m] cannot be indexed", "x", None),
    ("joint[mode] <= x", "AE203", "the index must be a member of Joint, not Mode", "mode", None),
    ("joint == joint", "AE203", "a whole family cannot be compared", "joint", "compare each"),
    (
        "(if a then joint else limit)[j1] <= x",
        "AE203",
        "a whole family cannot be chosen",
        "joint",
        "its elements",
    ),
    ("x in {idle}", "AE203", "real [m] is not an enumeration", "x", None),
    ("x in cell", "AE203", "a point must be a vec3, not real [m]", "x", None),
    ("norm(x) <= x", "AE203", "the argument of `norm` must be a vec3, not real [m]", "x", None),
    (
        "norm(p) + x <= x",
        "AE203",
        "a `norm` or `distance` can only be compared",
        "norm(p)",
        "alone on one side",
    ),
    ("x + norm(p) <= x", "AE203", "a `norm` or `distance` can only be compared", "norm(p)", None),
    ("2 * norm(p) <= x", "AE203", "a `norm` or `distance` can only be compared", "norm(p)", None),
    ("norm(p) / 2 <= x", "AE203", "a `norm` or `distance` can only be compared", "norm(p)", None),
    ("-norm(p) <= x", "AE203", "a `norm` or `distance` can only be compared", "norm(p)", None),
    ("min(norm(p), x) <= x", "AE203", "a `norm` or `distance` can only be compared", "norm(p)", None),
    (
        "(if a then norm(p) else x) <= x",
        "AE203",
        "a `norm` or `distance` can only be compared",
        "norm(p)",
        None,
    ),
    ("sum(a for j in Joint) <= 1", "AE203", "what is summed must be a real number, not bool", "a", None),
    ("x / a <= x", "AE203", "a divisor must be a real number, not bool", "a", None),
    ("min(a, x) <= x", "AE203", "`min` takes real numbers, not bool", "a", None),
    ("norm(p, q) <= x", "AE205", "`norm` takes 1 argument(s), not 2", "norm(p, q)", None),
    ("min() <= x", "AE205", "`min` takes 2 argument(s), not 0", "min()", None),
    ("x / k <= x", "AE206", "the divisor must be a constant other than zero", "k", "a <= c * b"),
    ("x / 0 <= x", "AE206", "the divisor must be a constant other than zero", "0", None),
    ("x / (1 - 1) <= x", "AE206", "the divisor must be a constant other than zero", "1 - 1", None),
]


@pytest.mark.parametrize(("text", "code", "message", "underlined", "cure"), FAULTS)
def test_an_error_states_problem_and_place(
    text: str, code: str, message: str, underlined: str, cure: str | None
) -> None:
    with pytest.raises(ExpressionTypeError) as raised:
        term_of(text)
    fault = raised.value
    assert (fault.code, fault.message) == (code, message)
    assert text[fault.extent.start : fault.extent.end] == underlined
    if cure is not None:
        assert cure in (fault.cure or "")


def _type_at(text: str, extent: TextRange) -> str:
    return str(TypeChecker(SCOPE).check(parse(text[extent.start : extent.end])).type)


_WITHOUT_LABEL = ("no component", "cannot be indexed", "the index must", "a whole family", "only be compared")


@pytest.mark.parametrize("text", [text for text, code, *_ in FAULTS if code in ("AE203", "AE204")])
def test_a_type_error_labels_its_places_with_their_types(text: str) -> None:
    with pytest.raises(ExpressionTypeError) as raised:
        term_of(text)
    fault = raised.value
    if any(words in fault.message for words in _WITHOUT_LABEL):
        assert fault.label == ""
    else:
        assert fault.label == _type_at(text, fault.extent)
    between = re.search(" is (compared with|added to|combined with|the alternative of) ", fault.message)
    assert (fault.related is None) is (between is None)
    if fault.related is not None:
        assert fault.related[1] == _type_at(text, fault.related[0])


@pytest.mark.parametrize(
    "written",
    [
        "a", "true", "not a", "a and b", "a or b", "a implies b", "x < y", "x < y <= x", "norm(p) < x",
        "mode in {idle}", "p not in cell", "all(a for j in Joint)", "ready[j1]", "if a then a else b",
        "mode", "inputs.grip", "p", "vec(x, y, x)", "p + q", "2 * p", "if a then p else q",
        "count(a for j in Joint)", "n", "n - 1", "n * n", "n / 2", "-n", "abs(n)", "dot(p, q)",
    ],
)  # fmt: skip
def test_an_operand_of_a_wrong_type_is_underlined_from_end_to_end(written: str) -> None:
    text = f"x + ({written}) <= x"
    with pytest.raises(ExpressionTypeError) as raised:
        term_of(text)
    assert text[raised.value.extent.start : raised.value.extent.end] == written


def test_a_type_mismatch_shows_both_sides() -> None:
    with pytest.raises(ExpressionTypeError) as raised:
        term_of("x <= speed")
    assert raised.value.label == "real [m/s]"
    assert raised.value.related is not None
    assert raised.value.related[1] == "real [m]"


@pytest.mark.parametrize(
    ("text", "type_", "value"),
    [
        ("2 * 3 m", RealType(LENGTH), Fraction(6)),
        ("1 / 3", RealType(NUMBER), Fraction(1, 3)),
        ("speed / 2", SPEED, Fraction(1, 8)),
        ("p * 2", VectorType(LENGTH), (Fraction(6), Fraction(8), Fraction(0))),
    ],
)
def test_a_term_of_another_type_has_its_value(text: str, type_: Type, value: Value) -> None:
    assert evaluate(term_of(text, type_), ENV) == value


def test_the_wrong_unit_for_a_value_is_a_unit_fault() -> None:
    with pytest.raises(ExpressionTypeError) as raised:
        term_of("1 m", SPEED)
    assert raised.value.code == "AE204"


def _left(depth: int, wrap: Callable[[str], str], leaf: str) -> str:
    text = leaf
    for _ in range(depth):
        text = wrap(text)
    return text


BLOW_UPS = {
    "quantifiers": _left(30, lambda e: f"all({e} for IX in Joint)", "a"),
    "dots": _left(30, lambda e: f"dot(p * {e}, q) / 1 m^2", "n") + " <= 1",
    "distances": _left(9, lambda e: f"distance(if {e} then p else q, q) <= 1 m", "a"),
    "norms": _left(9, lambda e: f"norm(vec(if {e} then x else y, x, x)) <= 1 m", "a"),
}


@pytest.mark.parametrize("text", BLOW_UPS.values(), ids=BLOW_UPS)
def test_a_short_text_with_a_huge_scalar_core_is_refused_quickly(text: str) -> None:
    for number in range(30):
        text = text.replace("IX", f"i{number}", 1)
    started = time.monotonic()
    with pytest.raises(ExpressionTypeError) as raised:
        term_of(text)
    assert raised.value.code == "AE201"
    assert raised.value.message == "this expression is too large after its sets and vectors are expanded"
    assert raised.value.cure == "split it into several rules"
    assert (raised.value.extent.start, raised.value.extent.end) == (0, len(text))
    assert time.monotonic() - started < 2


DEEP = {
    "sum": "+".join(["x"] * 97) + " <= x",
    "difference": "-".join(["x"] * 97) + " <= x",
    "product": "*".join(["n"] * 97) + " <= 1",
    "vector sum": "(" + " + ".join(["p"] * 95) + ").x <= x",
    "vector multiple": "(p" + " * n" * 90 + ").x <= x",
    "nots": "not " * 39 + "a",
    "brackets": _left(37, lambda e: f"({e} + x)", "x") + " <= x",
    "conditionals": "(" + _left(17, lambda e: f"if x <= y then x * x else {e}", "x * x") + ") <= x * x",
    "conditions": _left(18, lambda e: f"if {e} then x + y <= n * x else x * n <= y", "a"),
    "nested conditions": _left(18, lambda e: f"(if {e} then x + y else x * n) <= y", "a"),
    "minima": _left(36, lambda e: f"min(x + y, {e})", "x") + " <= x",
    "absolutes": _left(36, lambda e: f"abs({e} + y)", "x") + " <= x",
    "implications": "a implies " * 38 + "b",
    "indices": _left(6, lambda e: f"joint[if {e} <= x then arm else j1]", "x") + " <= x",
    "chain": " <= ".join(["x + y"] * 400),
    "conjunction": " and ".join(["x < y * n"] * 250),
    "distances": _left(3, lambda e: f"distance(if {e} then p else q, q) <= 1 m", "a"),
}


@pytest.mark.parametrize("text", DEEP.values(), ids=DEEP)
def test_deep_but_allowed_terms_pass_through_every_stage(text: str) -> None:
    term = term_of(text)
    size, height = size_bounds(term)
    assert count(lower(term)) <= size
    assert height_of(lower(term)) <= height <= MAX_HEIGHT
    assert len(_decided_by_all(term)) == 1


def count(term: t.Term) -> int:
    return 1 + sum(map(count, t.children(term)))


def height_of(term: t.Term) -> int:
    return 1 + max(map(height_of, t.children(term)), default=0)


def test_a_constant_condition_is_folded() -> None:
    assert lower(term_of("1 m + 2 m <= 3 m")) == t.TRUE
    assert lower(term_of("a or 1 < 2")) == t.TRUE
    assert lower(term_of("a and true")) == SCOPE.variables["a"]
    assert term_of("a", BOOL) == SCOPE.variables["a"]


@pytest.mark.parametrize(
    ("text", "cure"),
    [("2", "write its unit after it, as in `2 m/s`"), ("2 * 3", None), ("2 m", None), ("k", None)],
)
def test_a_bare_number_is_cured_by_its_unit(text: str, cure: str | None) -> None:
    with pytest.raises(ExpressionTypeError) as raised:
        term_of(text, SPEED)
    assert raised.value.cure == cure
    if cure is not None:
        with pytest.raises(ExpressionTypeError) as in_metres:
            term_of(text, RealType(LENGTH))
        assert in_metres.value.cure == "write its unit after it, as in `2 km`"


@pytest.mark.parametrize(
    ("text", "conjuncts", "premises", "alternatives"),
    [
        ("a", ["a"], [], ["a"]),
        ("a and 0 m <= x < 1 m", ["a", "0 m <= x", "x < 1 m"], [], ["a and 0 m <= x < 1 m"]),
        ("a or b", ["a or b"], [], ["a", "b"]),
        ("a and b implies (x <= 1 m or not a)", ["..."], ["a", "b"], ["x <= 1 m", "not a"]),
        ("a implies (b implies x <= 1 m)", ["..."], ["a", "b"], ["x <= 1 m"]),
        ("a or (b implies x <= 1 m)", ["..."], ["b"], ["a", "x <= 1 m"]),
    ],
)
def test_a_condition_has_parts_that_are_explained_one_by_one(
    text: str, conjuncts: list[str], premises: list[str], alternatives: list[str]
) -> None:
    term, *parts = check_condition(parse(text), SCOPE)
    assert term == term_of(text)
    found = [[text[extent.start : extent.end] for _, extent in some] for some in parts]
    assert found == [[text] if conjuncts == ["..."] else conjuncts, premises, alternatives]
    assert [[lower(one) for one, _ in some] for some in parts[1:]] == [
        [lower(term_of(written)) for written in some] for some in (premises, alternatives)
    ]


def test_the_expected_type_chooses_the_enum_of_a_bare_member() -> None:
    for enum in (GRIP, MODE):
        assert check(parse("stop"), SCOPE, enum) == t.Literal("stop", enum)
        assert infer(parse("stop"), SCOPE, enum) == (t.Literal("stop", enum), enum)
        assert check(parse("if a then stop else stop"), SCOPE, enum) == t.Conditional(
            SCOPE.variables["a"], t.Literal("stop", enum), t.Literal("stop", enum)
        )


@pytest.mark.parametrize(("limit", "position"), [("MAX_SIZE", 0), ("MAX_HEIGHT", 1)])
def test_an_expression_may_be_as_large_as_the_limit(
    limit: str, position: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    node = parse("all(joint[j] <= 2 m for j in Joint)")
    bound = size_bounds(check(node, SCOPE, BOOL))[position]
    module = sys.modules["aeros.spec.expr.typecheck.check"]
    monkeypatch.setattr(module, limit, bound)
    check(node, SCOPE, BOOL)
    monkeypatch.setattr(module, limit, bound - 1)
    with pytest.raises(ExpressionTypeError, match="too large"):
        check(node, SCOPE, BOOL)
