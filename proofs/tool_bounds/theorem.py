"""Bounds on the tool's speed and turning from its joints' motion: the rest of theorem 14's peaks."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from itertools import product
from types import SimpleNamespace
from typing import Any, Final

from aeros.spec.theorems.module_copies import ModuleSource, Mutant
from aeros.spec.theorems.smtlib import smt_and, smt_or
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically, term_of
from aeros.spec.theorems.theorem import SymbolicFunction, Theorem, TheoremObligation
from proofs.lib import kinematic_chain
from proofs.lib.loops import loops_of
from proofs.lib.symbolic_reals import (
    AXES,
    LARGER_DEFINITION,
    POLYNOMIALS,
    SIZE,
    SymbolicReal,
    cross,
    declare_reals,
    max_of_many_stub,
    max_stub,
    min_stub,
    sum_terms,
    symbolic_vector,
    vector_terms,
)

KINEMATIC_BOUNDS: Final = "aeros.runtime.motion.kinematic_bounds"
BEZIER: Final = "aeros.runtime.motion.bezier"

_JOINTS: Final = kinematic_chain.JOINTS
_A, _B, _C = ([f"{one}.{joint}" for joint in _JOINTS] for one in "abc")
_BOUNDED: Final = declare_reals(*_A, *_B, *_C)
"""Of each joint, the most that its first, second and third derivative are, by the parameter of the piece."""

# Derivatives of the tool's place, where those of the joints are known.


def _sum(vectors: Iterable[tuple[str, ...]]) -> tuple[str, ...]:
    return tuple(map(sum_terms, zip(*vectors, strict=True)))


def _scale_vector(factor: str, of: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(f"(* {factor} {one})" for one in of)


_MOTION: Final = ("rate", "bend", "turn")


def _motion(name: str, code: ModuleSource) -> TheoremObligation:
    peaks = code.module(KINEMATIC_BOUNDS)
    links = kinematic_chain.chain_module(code)
    place = _MOTION.index(name)

    def run(ask: DecideBranch, axis: int, slides: tuple[bool, ...]) -> str:
        first, second = (
            [SymbolicReal(f"{one}.{joint}", ask) for joint in _JOINTS] for one in ("first", "second")
        )
        posture = kinematic_chain.symbolic_posture(links, ask, slides)
        return term_of(
            peaks._point_derivatives(posture, symbolic_vector(ask, "p"), first, second)[place][axis]
        )

    claims, tables = [], []
    # One choice after the other: with the kinds as unknowns, solvers do not compare the polynomials.
    for slides in kinematic_chain.KIND_CHOICES:
        kinds, wanted = kinematic_chain.letters_of(slides), _wanted(name, slides)
        for axis, letter in enumerate(AXES):
            explored = execute_symbolically(partial(run, axis=axis, slides=slides))
            tables.append(SymbolicFunction(f"{kinds}.{letter}", "Real", explored))
            claims.append(f"(= {kinds}.{letter} {wanted[axis]})")
    return TheoremObligation(
        "`_point_derivatives` gives the first and second derivative of the tool's place by the parameter,\n"
        "and the rate of its rotation, where the joints' are these: of each choice of revolute (r) and\n"
        "prismatic (p) joints.",
        (
            *kinematic_chain.POINTS,
            *declare_reals(*(f"{what}.{joint}" for what in ("first", "second") for joint in _JOINTS)),
        ),
        smt_and(claims),
        tables=tuple(tables),
        logic=POLYNOMIALS,
    )


def _wanted(name: str, slides: tuple[bool, ...]) -> tuple[str, ...]:
    """The derivative of that name, written as sums over joints and pairs of joints."""
    arms = {joint: kinematic_chain.derivative_terms(joint, slides[joint]) for joint in _JOINTS}
    turning = {joint: vector_terms(f"z{joint}") for joint in _JOINTS if not slides[joint]}
    if name == "rate":
        return _sum(_scale_vector(f"first.{joint}", arms[joint]) for joint in _JOINTS)
    if name == "turn":
        return _sum((_NOTHING, *(_scale_vector(f"first.{joint}", axis) for joint, axis in turning.items())))
    return _sum(
        (
            *(_scale_vector(f"second.{joint}", arms[joint]) for joint in _JOINTS),
            # A derivative by two joints turns the arm of the outer about the axis of the inner one.
            *(
                _scale_vector(f"(* first.{i} first.{j})", cross(turning[min(i, j)], arms[max(i, j)]))
                for i, j in product(_JOINTS, repeat=2)
                if min(i, j) in turning
            ),
        )
    )


_NOTHING: Final = ("0.0", "0.0", "0.0")


def _third(code: ModuleSource) -> TheoremObligation:
    peaks = code.module(KINEMATIC_BOUNDS)

    def run(ask: DecideBranch, slides: tuple[bool, ...]) -> str:
        max_first, max_second, third = (
            [SymbolicReal(one, ask) for one in several] for several in (_A, _B, _C)
        )
        known = SimpleNamespace(max_first=max_first, max_second=max_second, third=third)
        reaches = [SymbolicReal(f"reach.{joint}", ask) for joint in _JOINTS]
        return term_of(peaks._third_derivative_bound(reaches, known, slides))

    claims, tables = [], []
    for slides in kinematic_chain.KIND_CHOICES:
        kinds = kinematic_chain.letters_of(slides)
        tables.append(
            SymbolicFunction(f"third.{kinds}", "Real", execute_symbolically(partial(run, slides=slides)))
        )
        every = [f"(* reach.{i} c.{i})" for i in _JOINTS]
        # A prismatic joint is the outermost one, or the derivative is 0.
        every += [
            f"(* 3.0 reach.{max(i, j)} b.{i} a.{j})"
            for i, j in product(_JOINTS, repeat=2)
            if not slides[min(i, j)]
        ]
        every += [
            f"(* reach.{max(several)} {' '.join(f'a.{one}' for one in several)})"
            for several in product(_JOINTS, repeat=3)
            if not any(slides[one] for one in sorted(several)[:2])
        ]
        claims.append(f"(= third.{kinds} {sum_terms(every)})")
    return TheoremObligation(
        "`_third_derivative_bound` is the sum of what bounds each part of the third derivative: by one,\n"
        "by two and by three joints, each as long as the reach of the outermost at most; of each choice of\n"
        "revolute (r) and prismatic (p) joints.",
        (*_BOUNDED, *declare_reals(*(f"reach.{joint}" for joint in _JOINTS))),
        smt_and(claims),
        tables=tuple(tables),
    )


# All of a piece, from its middle.

_BOUND_NAMES: Final = ("speed", "acceleration", "jerk", "turning", "turning-1", "turning-2")


def _execute_bounds(
    code: ModuleSource, what: str, name: str | None = None, slides: tuple[bool, ...] = (False,) * len(_JOINTS)
) -> SymbolicFunction:
    """Execute `_bounds` on a piece for its result, or for a value that it asks for, without the geometry."""
    peaks = code.module(KINEMATIC_BOUNDS)

    def run(ask: DecideBranch) -> str:
        seen: dict[str, Any] = {}
        vectors = {"first": "first", "second": "second", "turn": "turn"}

        def posture(_: Any, at: Any) -> Any:
            seen["at"] = at[0]
            return SimpleNamespace(
                frames=[SimpleNamespace(to_base=lambda tool: tool)],
                displacement_bound=spread,
                slides=slides,
            )

        def spread(joints: int, _: Any, width: Any) -> Any:
            seen["joints"], seen["far"] = joints, width[0]
            return None, "reaches"

        def joints(several: Iterable[str]) -> tuple[SymbolicReal, ...]:
            return tuple(SymbolicReal(one, ask) for one in several)

        known = SimpleNamespace(
            first="first'", second="second'", max_first=joints(_A), max_second=joints(_B), third=joints(_C)
        )
        vars(peaks).update(
            derivatives=lambda _: known,
            ForwardKinematics=posture,
            joint_box=lambda _: SimpleNamespace(middle=joints(["middle"]), width=joints(["width"])),
            _third_derivative_bound=lambda reaches, _, __: SymbolicReal({"reaches": "third"}[reaches], ask),
            _point_derivatives=lambda _, __, first, second: {("first'", "second'"): tuple(vectors)}[
                first, second
            ],
            _add_scaled=lambda a, b, factor: {
                ("first", "second", 0.5): "ahead",
                ("first", "second", -0.5): "behind",
            }[a, b, factor],
            norm=lambda of: SymbolicReal(f"long.{of}", ask),
            max=max_stub,
        )
        corners = tuple(joints([one]) for one in ("p", "q", "r", "s"))
        seen.update(
            zip(_BOUND_NAMES, peaks._bounds(SimpleNamespace(tool_offset="tool"), corners), strict=True)
        )
        return term_of(seen[what])

    return SymbolicFunction(name or what, "Real", execute_symbolically(run))


_LENGTH_DECLARATIONS: Final = declare_reals(
    "long.ahead", "long.behind", "long.second", "long.turn", "third", "h"
)
_FROM_THE_MIDDLE: Final = {
    "on-the-piece": "(<= (- (/ 1 2)) h (/ 1 2))",
    "square": "(<= (* h h) (/ 1 4))",
    "a-bound": "(<= 0.0 third)",
    "grows": "(and (<= (* third (* h h)) (* third (/ 1 4))) (<= (* third (size h)) (* third (/ 1 2))))",
}


def _position_bounds(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "`_bounds`: by Taylor's theorem from the middle of a piece, where the derivatives are known, the\n"
        "tool's place has no larger ones anywhere on it.",
        (
            SIZE,
            LARGER_DEFINITION,
            *_BOUNDED,
            *_LENGTH_DECLARATIONS,
            *declare_reals("straight", "is.1", "is.2"),
        ),
        "(and (<= is.1 speed) (<= is.2 acceleration) (= jerk third))",
        tables=tuple(_execute_bounds(code, one) for one in _BOUND_NAMES[:3]),
        assumptions={
            **_FROM_THE_MIDDLE,
            "ends": "(<= straight (larger long.ahead long.behind))",
            "taylor.1": "(<= is.1 (+ straight (* (/ 1 2) third (* h h))))",
            "taylor.2": "(<= is.2 (+ long.second (* third (size h))))",
        },
    )


def _convex_norm_bound(_: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "Between two ends a vector is no longer than the longer of them, as it is their mixture.",
        (LARGER_DEFINITION, *declare_reals("share", "ahead", "behind")),
        "(<= (+ (* share ahead) (* (- 1.0 share) behind)) (larger ahead behind))",
        assumptions={"share": "(<= 0.0 share 1.0)"},
        logic=POLYNOMIALS,
    )


def _rotation_bounds(code: ModuleSource) -> TheoremObligation:
    """An axis is turned by the joints further in that turn, which turn those in between as well."""
    claims, tables, taylor = [], [], {}
    for slides in kinematic_chain.KIND_CHOICES:
        kinds, turning = kinematic_chain.letters_of(slides), [joint for joint in _JOINTS if not slides[joint]]
        inner = {i: sum_terms(f"a.{j}" for j in turning if j < i) for i in turning}
        turned = {i: sum_terms(f"(+ b.{j} (* a.{j} {inner[j]}))" for j in turning if j < i) for i in turning}
        first = sum_terms(f"(+ b.{i} (* a.{i} {inner[i]}))" for i in turning)
        second = sum_terms(
            f"(+ c.{i} (* 2.0 b.{i} {inner[i]}) (* a.{i} (+ {turned[i]} (* {inner[i]} {inner[i]}))))"
            for i in turning
        )
        claims += [
            f"(<= {first} {kinds}.rate)",
            f"(<= {second} {kinds}.bend)",
            f"(<= is.{kinds} {kinds}.turn)",
        ]
        taylor[f"taylor.{kinds}"] = f"(<= is.{kinds} (+ long.turn (* (/ 1 2) {first})))"
        for name, what in zip(("turn", "rate", "bend"), _BOUND_NAMES[3:], strict=True):
            tables.append(_execute_bounds(code, what, f"{kinds}.{name}", slides))
    monomials = [f"(* {' '.join(one)})" for one in product(_A, _B)]
    monomials += [f"(* {' '.join(one)})" for n in (2, 3) for one in product(_A, repeat=n)]
    return TheoremObligation(
        "`_bounds`: the derivatives of the rotation's rate are no larger than what axes that are turned,\n"
        "and turn each other, come to; and the rate no larger than from the middle: of each choice of\n"
        "revolute (r) and prismatic (p) joints.",
        (
            SIZE,
            *_BOUNDED,
            *_LENGTH_DECLARATIONS,
            *declare_reals(
                *(f"is.{kinematic_chain.letters_of(slides)}" for slides in kinematic_chain.KIND_CHOICES)
            ),
        ),
        smt_and(claims),
        tables=tuple(tables),
        assumptions={
            **taylor,
            **{f"bound.{one}": f"(<= 0.0 {one})" for one in (*_A, *_B, *_C)},
            **{f"monomial.{n}": f"(<= 0.0 {one})" for n, one in enumerate(monomials)},
        },
    )


def _reach_obligation(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "`_bounds` takes the posture in the middle of a piece, and the reach of the tool while the joints\n"
        "are as far from there as any that are on it.",
        (
            SIZE,
            *_BOUNDED,
            *_LENGTH_DECLARATIONS,
            *declare_reals("p", "q", "r", "s", "middle", "width", "joint"),
        ),
        "(and (<= (size (- joint at)) far) (= at (/ (+ p (* 3.0 q) (* 3.0 r) s) 8.0)))",
        tables=(_execute_bounds(code, "at"), _execute_bounds(code, "far")),
        assumptions={"on-the-piece": "(<= (size (- joint middle)) width)"},
    )


def _middle(code: ModuleSource) -> TheoremObligation:
    bezier = code.module(BEZIER, max=max_stub)

    def run(ask: DecideBranch, field: str) -> str:
        piece = tuple((SymbolicReal(corner, ask),) for corner in "abcd")
        return term_of(getattr(bezier.derivatives(piece), field)[0])

    return TheoremObligation(
        "`derivatives` gives the first and second derivative of a cubic piece in its middle.",
        declare_reals(*"abcd"),
        "(and (= first (* (/ 3 4) (- (+ c d) a b))) (= second (* 3.0 (- (+ a d) b c))))",
        tables=tuple(
            SymbolicFunction(field, "Real", execute_symbolically(partial(run, field=field)))
            for field in ("first", "second")
        ),
    )


def _span(code: ModuleSource) -> TheoremObligation:
    bezier = code.module(BEZIER, min=min_stub, max=max_of_many_stub)

    def run(ask: DecideBranch, field: int) -> str:
        piece = tuple((SymbolicReal(corner, ask),) for corner in "abcd")
        return term_of(bezier.joint_box([piece])[field][0])

    return TheoremObligation(
        "`joint_box` holds the control points of a piece, and so what is between them.",
        (SIZE, LARGER_DEFINITION, *declare_reals(*"abcd")),
        smt_and(f"(<= (size (- {one} middle)) width)" for one in "abcd"),
        tables=tuple(
            SymbolicFunction(name, "Real", execute_symbolically(partial(run, field=field)))
            for field, name in enumerate(("middle", "width"))
        ),
    )


# Pieces that are halved, and a path of them.

_ORDERS: Final = (1, 2, 3) * 2


def _halving_induction(code: ModuleSource) -> TheoremObligation:
    """An induction over halvings: what is said of the halves bounds the derivatives by their parameters."""
    peaks = code.module(KINEMATIC_BOUNDS)
    piece = peaks._piece

    def run(ask: DecideBranch, place: int) -> str:
        def bounds(of: str) -> list[SymbolicReal]:
            return [SymbolicReal(f"{of}.{number}", ask) for number in range(6)]

        class Depth:
            """Symbolic number of times that a piece has been halved."""

            def __eq__(self, _: object) -> bool:
                return ask("is-deepest")

            def __add__(self, _: int) -> Depth:
                return self

            __hash__ = None  # type: ignore[assignment]

        vars(peaks).update(
            _bounds=lambda _, of: bounds(of),
            _piece=lambda _, of, __, ___: bounds(of),
            split_in_half=lambda _: ("first", "second"),
            max=max_stub,
            min=min_stub,
        )
        return term_of(piece(None, "whole", SymbolicReal("allowed", ask), Depth())[place])

    numbers = range(6)
    by_half = {
        half: smt_and(
            f"(<= is.{number} (* {2**order}.0 {half}.{number}))"
            for number, order in zip(numbers, _ORDERS, strict=True)
        )
        for half in ("first", "second")
    }
    return TheoremObligation(
        "`_piece` bounds the derivatives by the parameter of a piece, where those by the parameters of its\n"
        "halves, which run twice as fast, are bounded.",
        (
            *declare_reals(
                "allowed", *(f"{of}.{n}" for of in ("whole", "first", "second", "is") for n in numbers)
            ),
            "(declare-const is-deepest Bool)",
        ),
        smt_and(f"(<= is.{number} found.{number})" for number in numbers),
        tables=tuple(
            SymbolicFunction(f"found.{number}", "Real", execute_symbolically(partial(run, place=number)))
            for number in numbers
        ),
        assumptions={
            "bounds": smt_and(f"(<= is.{number} whole.{number})" for number in numbers),
            "on-a-half": smt_or(by_half.values()),
        },
    )


def _path(code: ModuleSource) -> TheoremObligation:
    peaks = code.module(KINEMATIC_BOUNDS)

    def run(ask: DecideBranch, place: int) -> str:
        vars(peaks).update(
            _piece=lambda _, of, __, ___: [SymbolicReal(f"{of}.{number}", ask) for number in range(6)],
            rates_in_time=lambda *given: given[:3] if given[3].term == "duration" else None,
            max=max_stub,
        )
        duration, limit = SymbolicReal("duration", ask), SymbolicReal("limit", ask)
        moving, turning = peaks.tool_rates(None, ("one", "other"), duration, limit)
        return term_of((*moving, *turning)[place])

    numbers = range(6)
    on = [smt_and(f"(<= is.{number} {piece}.{number})" for number in numbers) for piece in ("one", "other")]
    return TheoremObligation(
        "`tool_rates` has `rates_in_time` bound the rates of a tool whose derivatives by s are bounded:\n"
        "on a path of two, a piece runs twice as fast.",
        declare_reals("duration", "limit", *(f"{of}.{n}" for of in ("one", "other", "is") for n in numbers)),
        smt_and(
            f"(<= (* {2**order}.0 is.{number}) by-s.{number})"
            for number, order in zip(numbers, _ORDERS, strict=True)
        ),
        tables=tuple(
            SymbolicFunction(f"by-s.{number}", "Real", execute_symbolically(partial(run, place=number)))
            for number in numbers
        ),
        assumptions={"on-a-piece": smt_or(on)},
    )


_LOOPS: Final = loops_of(
    "aeros.runtime.motion.bezier",
    "aeros.runtime.motion.kinematic_bounds",
)

THEOREM = Theorem(
    "no tool moves or turns faster or more abruptly than the bounds that the gate uses",
    {
        **{name: partial(_motion, name) for name in _MOTION},
        "third": _third,
        "middle": _middle,
        "span": _span,
        "in-reach": _reach_obligation,
        "of-place": _position_bounds,
        "ends": _convex_norm_bound,
        "of-rotation": _rotation_bounds,
        "halved": _halving_induction,
        "path": _path,
        "loops": _LOOPS,
    },
    (
        Mutant(
            "takes-the-rotation-of-the-last-joint-for-all",
            "turn",
            KINEMATIC_BOUNDS,
            "wx, wy, wz = wx + zx, wy + zy, wz + zz",
            "wx, wy, wz = zx, zy, zz",
        ),
        Mutant(
            "has-a-prismatic-joint-turn",
            "turn",
            KINEMATIC_BOUNDS,
            "            zx = zy = zz = 0.0\n",
            "",
        ),
        Mutant(
            "has-a-prismatic-joint-bend-nothing",
            "third",
            KINEMATIC_BOUNDS,
            " + 3.0 * a * sa**2)",
            ")",
        ),
        Mutant(
            "takes-the-last-control-points-for-all",
            "span",
            BEZIER,
            "max(values)) for values",
            "values[-1]) for values",
        ),
        Mutant(
            "counts-pairs-once",
            "third",
            KINEMATIC_BOUNDS,
            "3.0 * (sa * sb - pairs)",
            "1.0 * (sa * sb - pairs)",
        ),
        Mutant(
            "takes-the-middle-of-the-box-for-that-of-the-piece",
            "in-reach",
            KINEMATIC_BOUNDS,
            "[w + abs(m - q) for w, m, q in",
            "[w for w, m, q in",
        ),
        Mutant(
            "looks-at-one-end",
            "of-place",
            KINEMATIC_BOUNDS,
            "max(norm(_add_scaled(first_at, second_at, 0.5)), norm(_add_scaled(first_at, second_at, -0.5)))",
            "norm(_add_scaled(first_at, second_at, 0.5))",
        ),
        Mutant(
            "forgets-that-axes-are-turned",
            "of-rotation",
            KINEMATIC_BOUNDS,
            "bend = sb + 0.5 * sa * sa",
            "bend = sb",
        ),
        Mutant(
            "takes-a-half-for-as-fast-as-the-whole",
            "halved",
            KINEMATIC_BOUNDS,
            "scale = (2.0, 4.0, 8.0) * 2",
            "scale = (2.0, 2.0, 2.0) * 2",
        ),
        Mutant(
            "takes-the-latest-piece-for-the-fastest",
            "path",
            KINEMATIC_BOUNDS,
            "most = [max(pair) for pair in zip(most, _piece(body, piece, allowed, 0), strict=True)]",
            "most = _piece(body, piece, allowed, 0)",
        ),
        Mutant(
            "looks-at-two-pieces-only",
            "loops",
            "aeros.runtime.motion.kinematic_bounds",
            "    for piece in path:\n",
            "    for piece in path[:2]:\n",
        ),
    ),
)
