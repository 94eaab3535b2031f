"""Peaks of the motion profile, and bounds in time of what moves along a path: a part of theorem 14."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import partial
from itertools import pairwise, zip_longest
from types import SimpleNamespace
from typing import Any, Final

from aeros.spec.theorems.module_copies import ModuleSource, Mutant
from aeros.spec.theorems.smtlib import smt_and, smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, Theorem, TheoremObligation
from proofs.lib.loops import loops_of
from proofs.lib.symbolic_reals import POLYNOMIALS, SIZE, SymbolicReal, max_stub

KINEMATIC_BOUNDS: Final = "aeros.runtime.motion.kinematic_bounds"
BEZIER: Final = "aeros.runtime.motion.bezier"
PROFILE: Final = "aeros.sim.robot.profile"

# The profile, whatever is moved and however long it takes.


class _Polynomial:
    """A polynomial in u with exact coefficients, from the constant on: what code makes of a symbol u."""

    def __init__(self, *coefficients: Fraction) -> None:
        self.coefficients = coefficients

    def __add__(self, other: Any) -> _Polynomial:
        pairs = zip_longest(self.coefficients, _to_polynomial(other).coefficients, fillvalue=Fraction(0))
        return _Polynomial(*(a + b for a, b in pairs))

    def __neg__(self) -> _Polynomial:
        return self * -1

    def __sub__(self, other: Any) -> _Polynomial:
        return self + -_to_polynomial(other)

    def __rsub__(self, other: Any) -> _Polynomial:
        return _to_polynomial(other) - self

    def __mul__(self, other: Any) -> _Polynomial:
        theirs = _to_polynomial(other).coefficients
        product = [Fraction(0)] * (len(self.coefficients) + len(theirs) - 1)
        for i, a in enumerate(self.coefficients):
            for j, b in enumerate(theirs):
                product[i + j] += a * b
        return _Polynomial(*product)

    __radd__, __rmul__ = __add__, __mul__

    def __pow__(self, power: int) -> _Polynomial:
        return self if power == 1 else self * self ** (power - 1)

    def term(self) -> str:
        """At u, as Horner has it."""
        term = "0.0"
        for one in reversed(self.coefficients):
            term = f"(+ {smt_literal(one)} (* u {term}))"
        return term


def _to_polynomial(value: Any) -> _Polynomial:
    return value if isinstance(value, _Polynomial) else _Polynomial(Fraction(value))


def _derivative(polynomial: _Polynomial) -> _Polynomial:
    return _Polynomial(*(n * one for n, one in enumerate(polynomial.coefficients) if n))


_U: Final = _Polynomial(Fraction(0), Fraction(1))


def _peak_bound(order: int, code: ModuleSource) -> TheoremObligation:
    s, _, __ = code.module(PROFILE).minimum_jerk(_U)
    for _ in range(order):
        s = _derivative(s)
    bound = smt_literal(Fraction(code.module(KINEMATIC_BOUNDS).TIMING_PEAKS[order - 1]))
    return TheoremObligation(
        f"The derivative of order {order} of the profile by u is nowhere in [0, 1] larger than"
        " `TIMING_PEAKS`.",
        (SIZE, "(declare-const u Real)", f"(define-fun derivative () Real {s.term()})"),
        f"(<= (size derivative) {bound})",
        assumptions={"in-the-motion": "(<= 0.0 u 1.0)"},
        logic=POLYNOMIALS,
    )


def _profile_derivatives(code: ModuleSource) -> TheoremObligation:
    s, first, second = code.module(PROFILE).minimum_jerk(_U)
    names = {"s": s, "first": first, "second": second, "of-s": _derivative(s), "of-first": _derivative(first)}
    return TheoremObligation(
        "The speed and acceleration that `minimum_jerk` gives are the derivatives of its position, which\n"
        "goes from 0 to 1 and rests at both ends.",
        (
            "(declare-const u Real)",
            *(f"(define-fun {name} () Real {one.term()})" for name, one in names.items()),
        ),
        "(and (= first of-s) (= second of-first) (=> (= u 0.0) (= s first second 0.0))"
        " (=> (= u 1.0) (and (= s 1.0) (= first second 0.0))))",
    )


# Along a path.


class _SymbolicDuration:
    """A duration, known by its inverse: whatever is divided by it is multiplied by that."""

    def __init__(self, inverse: Any) -> None:
        self._inverse = inverse

    def __pow__(self, power: int) -> _SymbolicDuration:
        return _SymbolicDuration(self._inverse**power)

    def __rtruediv__(self, other: float) -> Any:
        return self._inverse * other


_MAXIMA: Final = ("first", "second", "third")
_RATES: Final = ("speed", "acceleration", "jerk")

# ẋ, ẍ and x⃛ by the chain rule, where p.N is the derivative of the path of order N and s.N that of the timing.
_CHAIN: Final = {
    "speed": ("(* p.1 s.1)",),
    "acceleration": ("(* p.2 s.1 s.1)", "(* p.1 s.2)"),
    "jerk": ("(* p.3 s.1 s.1 s.1)", "(* 3.0 p.2 s.1 s.2)", "(* p.1 s.3)"),
}


def _time_scaling(rate: str, code: ModuleSource) -> TheoremObligation:
    peaks = code.module(KINEMATIC_BOUNDS)
    place = _RATES.index(rate)

    def run(ask: DecideBranch) -> str:
        most = (SymbolicReal(f"most.{name}", ask) for name in _MAXIMA)
        found = peaks.rates_in_time(*most, _SymbolicDuration(SymbolicReal("per-duration", ask)))
        return str(found[place].term)

    limits = {
        f"s.{order}": " ".join(
            ["*", smt_literal(Fraction(peaks.TIMING_PEAKS[order - 1])), *["per-duration"] * order]
        )
        for order in (1, 2, 3)
    }
    declarations = [SIZE, "(declare-const per-duration Real)"]
    declarations += [f"(declare-const most.{name} Real)" for name in _MAXIMA]
    declarations += [f"(declare-const {one}.{order} Real)" for one in "ps" for order in (1, 2, 3)]

    def most_of(factor: str) -> str:
        if factor.startswith("p."):
            return f"most.{_MAXIMA[int(factor[2:]) - 1]}"
        return f"({limits[factor]})" if factor in limits else factor

    products = {}
    for number, summand in enumerate(_CHAIN[rate]):
        factors = summand.strip("()").split()[1:]
        products[f"product.{number}"] = f"(<= (size {summand}) (* {' '.join(map(most_of, factors))}))"
    total = _CHAIN[rate][0] if len(_CHAIN[rate]) == 1 else f"(+ {' '.join(_CHAIN[rate])})"
    return TheoremObligation(
        f"`rates_in_time` bounds the {rate} of whatever moves along a path, from bounds of the path's\n"
        "derivatives and of the profile's, for every duration.",
        declarations,
        f"(<= (size {total}) bound)",
        tables=(SymbolicFunction("bound", "Real", execute_symbolically(run)),),
        assumptions={"a-duration": "(< 0.0 per-duration)", **products},
    )


def _products(_: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "A product is no larger than that of bounds of its factors; of more than two, by saying so again.",
        (SIZE, *(f"(declare-const {name}{what} Real)" for name in "xy" for what in ("", ".size"))),
        "(<= (size (* x y)) (* x.size y.size))",
        assumptions={name: f"(<= (size {name}) {name}.size)" for name in "xy"},
    )


# A piece of a path of the joints.

_POINTS: Final = "abcd"


def _piece(name: str, code: ModuleSource) -> TheoremObligation:
    bezier = code.module(BEZIER, max=max_stub)

    def run(ask: DecideBranch, field: str) -> str:
        piece = tuple((SymbolicReal(point, ask),) for point in _POINTS)
        return str(getattr(bezier.derivatives(piece), field)[0].term)

    order = _MAXIMA.index(name) + 1
    field = ("max_first", "max_second", "third")[order - 1]
    u, v, w = "(- b a)", "(- c b)", "(- d c)"
    exact = {
        "first": f"(* 3.0 (+ (* {u} y y) (* 2.0 {v} x y) (* {w} x x)))",
        "second": f"(* 6.0 (+ (* (- {v} {u}) y) (* (- {w} {v}) x)))",
        "third": f"(* 6.0 (- (- {w} {v}) (- {v} {u})))",
    }[name]
    return TheoremObligation(
        f"`derivatives` bounds the {name} derivative of a cubic piece wherever it is, by its parameter x.",
        (
            SIZE,
            *(f"(declare-const {point} Real)" for point in _POINTS),
            "(declare-const x Real)",
            "(define-fun y () Real (- 1.0 x))",
        ),
        f"(<= (size {exact}) bound)",
        tables=(SymbolicFunction("bound", "Real", execute_symbolically(partial(run, field=field))),),
        assumptions={"on-the-piece": "(<= 0.0 x 1.0)"},
        logic=POLYNOMIALS,
    )


# A path of the joints: its pieces follow each other, each with the same share of the path parameter.

_PIECES: Final = ("earlier", "later")
_DERIVATIVES: Final = ("max_first", "max_second", "third")


def _joint_rates(code: ModuleSource) -> TheoremObligation:
    """Two pieces of any number, each with two joints."""

    def run(ask: DecideBranch) -> str:
        given: list[SymbolicReal] = []

        def derivatives(piece: str) -> Any:
            bounds = {
                name: tuple(SymbolicReal(f"{piece}.{joint}.{order}", ask) for joint in "ab")
                for order, name in enumerate(_DERIVATIVES, 1)
            }
            return SimpleNamespace(**bounds)

        def rates_in_time(*bounds: Any) -> None:
            given.extend(bounds)

        peaks = code.module(
            KINEMATIC_BOUNDS,
            derivatives=derivatives,
            rates_in_time=rates_in_time,
            max=max_stub,
            len=lambda _: SymbolicReal("pieces", ask),
            float=lambda value: value,
        )
        peaks.joint_rates(_PIECES, SymbolicReal("duration", ask))
        return f"(rates {' '.join(one.term for one in given)})"

    pieces = [f"{piece}.{joint}.{order}" for piece in _PIECES for joint in "ab" for order in (1, 2, 3)]
    fields = [f"{joint}.{order}-of" for joint in "ab" for order in (1, 2, 3, "duration")]
    covered = (
        f"(<= (* {one} {' '.join(['pieces'] * int(one[-1]))}) ({one[-3:]}-of found))" for one in pieces
    )
    return TheoremObligation(
        "`joint_rates` hands to `rates_in_time`, for each joint, bounds of its derivatives by the path\n"
        "parameter on every piece of the path: those by the piece's parameter, times the number of pieces\n"
        "to the power of the order.",
        (
            "(declare-datatypes ((Rates 0)) (((rates "
            + " ".join(f"({field} Real)" for field in fields)
            + "))))",
            *(f"(declare-const {name} Real)" for name in (*pieces, "pieces", "duration")),
        ),
        smt_and([*covered, *(f"(= ({joint}.duration-of found) duration)" for joint in "ab")]),
        tables=(SymbolicFunction("found", "Rates", execute_symbolically(run)),),
        assumptions={"some-pieces": "(<= 2.0 pieces)"},
    )


_JUMP: Final = smt_literal(Fraction(1e-9))
"""The largest jump that rounding explains, rad: a part of the claim, not read from the code."""


def _smooth(code: ModuleSource) -> TheoremObligation:
    """Three pieces of a path of two joints."""
    peaks = code.module(KINEMATIC_BOUNDS)
    names = [[[f"{joint}.{piece}.{point}" for joint in "ab"] for point in _POINTS] for piece in range(3)]

    def run(ask: DecideBranch) -> str:
        path = [tuple(tuple(SymbolicReal(one, ask) for one in point) for point in piece) for piece in names]
        return smt_literal(bool(peaks.is_c2_continuous(path)))

    small = []
    for left, right in pairwise(names):
        for joint in range(2):
            (_, b, c, d), (e, f, g, _) = ([point[joint] for point in piece] for piece in (left, right))
            jumps = (
                f"(- {d} {e})",
                f"(- (- {d} {c}) (- {f} {e}))",
                f"(- (+ (- {d} {c}) (- {b} {c})) (+ (- {g} {f}) (- {e} {f})))",
            )
            small += [f"(<= (size {jump}) {_JUMP})" for jump in jumps]
    return TheoremObligation(
        "`is_c2_continuous` exactly if no joint jumps from one piece to the next by more than 1e-9 rad: not\n"
        "its position, nor a third of its derivative by the piece's parameter, nor a sixth of the second.",
        (SIZE, *(f"(declare-const {one} Real)" for piece in names for point in piece for one in point)),
        f"(= smooth {smt_and(small)})",
        tables=(SymbolicFunction("smooth", "Bool", execute_symbolically(run)),),
    )


_TIMED: dict[str, Callable[[ModuleSource], TheoremObligation]] = {
    f"timed-{one}": partial(_time_scaling, one) for one in _RATES
}

_LOOPS: Final = loops_of(
    "aeros.runtime.motion.bezier",
    "aeros.runtime.motion.kinematic_bounds",
)

THEOREM = Theorem(
    "the gate's bounds on speed, acceleration and jerk of a timed motion are upper bounds",
    {
        **{f"peak-{order}": partial(_peak_bound, order) for order in (1, 2, 3)},
        "profile": _profile_derivatives,
        **_TIMED,
        "products": _products,
        **{f"piece-{name}": partial(_piece, name) for name in _MAXIMA},
        "joint-rates": _joint_rates,
        "smooth": _smooth,
        "loops": _LOOPS,
    },
    (
        Mutant(
            "takes-the-mean-acceleration",
            "peak-2",
            KINEMATIC_BOUNDS,
            "10.0 / sqrt(3.0) *",
            "5.0 / sqrt(3.0) *",
        ),
        Mutant(
            "forgets-that-a-path-bends",
            "timed-acceleration",
            KINEMATIC_BOUNDS,
            "(second * v * v + first * a) * _ROUNDING",
            "(first * a) * _ROUNDING",
        ),
        Mutant(
            "looks-at-both-ends-alone",
            "piece-first",
            BEZIER,
            "3.0 * max(abs(u), abs(v), abs(w))",
            "3.0 * max(abs(u), abs(w))",
        ),
        Mutant(
            "has-the-profile-stop-late",
            "profile",
            PROFILE,
            "ds = 30.0 * u**2 * (1.0 - u) ** 2",
            "ds = 30.0 * u**2 * (1.0 - u)",
        ),
        Mutant(
            "forgets-that-a-piece-is-a-part-of-the-path",
            "joint-rates",
            KINEMATIC_BOUNDS,
            "max(b) * n**2, max(c) * n**3",
            "max(b), max(c)",
        ),
        Mutant(
            "accepts-a-path-with-a-jump",
            "smooth",
            KINEMATIC_BOUNDS,
            "_CONTINUITY_TOLERANCE: Final = 1e-9",
            "_CONTINUITY_TOLERANCE: Final = 1.0",
        ),
        Mutant(
            "looks-at-the-first-joins-only",
            "loops",
            "aeros.runtime.motion.kinematic_bounds",
            "for left, right in pairwise(path):",
            "for left, right in pairwise(path[:3]):",
        ),
    ),
)
