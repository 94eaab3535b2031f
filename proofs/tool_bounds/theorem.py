"""How fast the tool moves and turns at most, from how its joints do: the rest of theorem 14's peaks."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from itertools import product
from types import SimpleNamespace
from typing import Any, Final

from aeros.spec.theorems.module_copies import Code, Mutant
from aeros.spec.theorems.smtlib import conjunction, disjunction
from aeros.spec.theorems.symbolic_execution import Ask, explore, term_of
from aeros.spec.theorems.theorem import Obligation, Table, Theorem
from proofs.lib import kinematic_chain
from proofs.lib.symbolic_reals import (
    AXES,
    LARGER,
    POLYNOMIALS,
    SIZE,
    Real,
    cross,
    declared,
    largest,
    largest_of,
    smallest,
    symbols,
    total,
    vector,
)

PEAKS: Final = "aeros.runtime.motion.kinematic_bounds"
BEZIER: Final = "aeros.runtime.motion.bezier"

_JOINTS: Final = kinematic_chain.JOINTS
_A, _B, _C = ([f"{one}.{joint}" for joint in _JOINTS] for one in "abc")
_BOUNDED: Final = declared(*_A, *_B, *_C)
"""Of each joint, the most that its first, second and third derivative are, by the parameter of the piece."""

# Derivatives of the tool's place, where those of the joints are known.


def _sum(vectors: Iterable[tuple[str, ...]]) -> tuple[str, ...]:
    return tuple(map(total, zip(*vectors, strict=True)))


def _times(factor: str, of: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(f"(* {factor} {one})" for one in of)


_MOTION: Final = ("rate", "bend", "turn")


def _motion(name: str, code: Code) -> Obligation:
    peaks = code.module(PEAKS)
    links = kinematic_chain.chain_module(code)
    place = _MOTION.index(name)

    def run(ask: Ask, axis: int) -> str:
        first, second = ([Real(f"{one}.{joint}", ask) for joint in _JOINTS] for one in ("first", "second"))
        posture = kinematic_chain.posture_of(links, ask)
        return term_of(peaks._motion(posture, symbols(ask, "p"), first, second)[place][axis])

    arms = {joint: kinematic_chain.arm(joint) for joint in _JOINTS}
    turning = {joint: vector(f"z{joint}") for joint in _JOINTS}
    wanted = {
        "rate": _sum(_times(f"first.{joint}", arms[joint]) for joint in _JOINTS),
        "bend": _sum(
            (
                *(_times(f"second.{joint}", arms[joint]) for joint in _JOINTS),
                # A derivative by two joints turns the arm of the outer about the axis of the inner one.
                *(
                    _times(f"(* first.{i} first.{j})", cross(turning[min(i, j)], arms[max(i, j)]))
                    for i, j in product(_JOINTS, repeat=2)
                ),
            )
        ),
        "turn": _sum(_times(f"first.{joint}", turning[joint]) for joint in _JOINTS),
    }
    return Obligation(
        "`_motion` gives the first and second derivative of the tool's place by the parameter, and the\n"
        "rate of its rotation, where the joints' are these.",
        (
            *kinematic_chain.PLACES,
            *declared(*(f"{what}.{joint}" for what in ("first", "second") for joint in _JOINTS)),
        ),
        conjunction(f"(= {name}.{axis} {term})" for axis, term in zip(AXES, wanted[name], strict=True)),
        tables=tuple(
            Table(f"{name}.{letter}", "Real", explore(partial(run, axis=axis)))
            for axis, letter in enumerate(AXES)
        ),
        logic=POLYNOMIALS,
    )


def _third(code: Code) -> Obligation:
    peaks = code.module(PEAKS)

    def run(ask: Ask) -> str:
        most_first, most_second, third = ([Real(one, ask) for one in several] for several in (_A, _B, _C))
        known = SimpleNamespace(most_first=most_first, most_second=most_second, third=third)
        return term_of(peaks._third([Real(f"reach.{joint}", ask) for joint in _JOINTS], known))

    every = [f"(* reach.{i} c.{i})" for i in _JOINTS]
    every += [f"(* 3.0 reach.{max(i, j)} b.{i} a.{j})" for i, j in product(_JOINTS, repeat=2)]
    every += [f"(* reach.{max(i, j, k)} a.{i} a.{j} a.{k})" for i, j, k in product(_JOINTS, repeat=3)]
    return Obligation(
        "`_third` is the sum of what bounds each part of the third derivative: by one, by two and by three\n"
        "joints, each as long as the reach of the outermost at most.",
        (*_BOUNDED, *declared(*(f"reach.{joint}" for joint in _JOINTS))),
        f"(= third {total(every)})",
        tables=(Table("third", "Real", explore(run)),),
    )


# All of a piece, from its middle.

_FOUND: Final = ("speed", "acceleration", "jerk", "turning", "turning.1", "turning.2")


def _explored(code: Code, what: str) -> Table:
    """What `_bounds` finds of a piece, or asks for on the way, with the geometry put aside."""
    peaks = code.module(PEAKS)

    def run(ask: Ask) -> str:
        seen: dict[str, Any] = {}
        vectors = {"first": "first", "second": "second", "turn": "turn"}

        def posture(_: Any, at: Any) -> Any:
            seen["at"] = at[0]
            return SimpleNamespace(frames=[SimpleNamespace(place=lambda tool: tool)], spread=spread)

        def spread(joints: int, _: Any, width: Any) -> Any:
            seen["joints"], seen["far"] = joints, width[0]
            return None, "reaches"

        def joints(several: Iterable[str]) -> tuple[Real, ...]:
            return tuple(Real(one, ask) for one in several)

        known = SimpleNamespace(
            first="first'", second="second'", most_first=joints(_A), most_second=joints(_B), third=joints(_C)
        )
        vars(peaks).update(
            derivatives=lambda _: known,
            Posture=posture,
            span_of=lambda _: SimpleNamespace(middle=joints(["middle"]), width=joints(["width"])),
            _third=lambda reaches, _: Real({"reaches": "third"}[reaches], ask),
            _motion=lambda _, __, first, second: {("first'", "second'"): tuple(vectors)}[first, second],
            _plus=lambda a, b, factor: {
                ("first", "second", 0.5): "ahead",
                ("first", "second", -0.5): "behind",
            }[a, b, factor],
            norm=lambda of: Real(f"long.{of}", ask),
            max=largest,
        )
        corners = tuple(joints([one]) for one in ("p", "q", "r", "s"))
        seen.update(zip(_FOUND, peaks._bounds(SimpleNamespace(tool="tool"), corners), strict=True))
        return term_of(seen[what])

    return Table(what, "Real", explore(run))


_LONG: Final = declared("long.ahead", "long.behind", "long.second", "long.turn", "third", "h")
_FROM_THE_MIDDLE: Final = {
    "on-the-piece": "(<= (- (/ 1 2)) h (/ 1 2))",
    "square": "(<= (* h h) (/ 1 4))",
    "a-bound": "(<= 0.0 third)",
    "grows": "(and (<= (* third (* h h)) (* third (/ 1 4))) (<= (* third (size h)) (* third (/ 1 2))))",
}


def _of_place(code: Code) -> Obligation:
    return Obligation(
        "`_bounds`: by Taylor's theorem from the middle of a piece, where the derivatives are known, the\n"
        "tool's place has no larger ones anywhere on it.",
        (SIZE, LARGER, *_BOUNDED, *_LONG, *declared("straight", "is.1", "is.2")),
        "(and (<= is.1 speed) (<= is.2 acceleration) (= jerk third))",
        tables=tuple(_explored(code, one) for one in _FOUND[:3]),
        assumptions={
            **_FROM_THE_MIDDLE,
            "ends": "(<= straight (larger long.ahead long.behind))",
            "taylor.1": "(<= is.1 (+ straight (* (/ 1 2) third (* h h))))",
            "taylor.2": "(<= is.2 (+ long.second (* third (size h))))",
        },
    )


def _ends(_: Code) -> Obligation:
    return Obligation(
        "Between two ends a vector is no longer than the longer of them, as it is their mixture.",
        (LARGER, *declared("share", "ahead", "behind")),
        "(<= (+ (* share ahead) (* (- 1.0 share) behind)) (larger ahead behind))",
        assumptions={"share": "(<= 0.0 share 1.0)"},
        logic=POLYNOMIALS,
    )


def _inner(joint: int, each: Callable[[int], str]) -> str:
    """The sum over the joints further in than that one."""
    return total(each(other) for other in _JOINTS if other < joint)


def _of_rotation(code: Code) -> Obligation:
    """An axis is turned by the joints further in, which turn those in between as well."""
    inner = {joint: _inner(joint, lambda other: f"a.{other}") for joint in _JOINTS}
    turned = {
        joint: _inner(joint, lambda other: f"(+ b.{other} (* a.{other} {inner[other]}))") for joint in _JOINTS
    }
    first = total(f"(+ b.{i} (* a.{i} {inner[i]}))" for i in _JOINTS)
    second = total(
        f"(+ c.{i} (* 2.0 b.{i} {inner[i]}) (* a.{i} (+ {turned[i]} (* {inner[i]} {inner[i]}))))"
        for i in _JOINTS
    )
    monomials = [f"(* {' '.join(one)})" for one in product(_A, _B)]
    monomials += [f"(* {' '.join(one)})" for n in (2, 3) for one in product(_A, repeat=n)]
    return Obligation(
        "`_bounds`: the derivatives of the rotation's rate are no larger than what axes that are turned,\n"
        "and turn each other, come to; and the rate no larger than from the middle.",
        (SIZE, *_BOUNDED, *_LONG, *declared("is.turning")),
        f"(and (<= {first} turning.1) (<= {second} turning.2) (<= is.turning turning))",
        tables=tuple(_explored(code, one) for one in _FOUND[3:]),
        assumptions={
            "taylor": f"(<= is.turning (+ long.turn (* (/ 1 2) {first})))",
            **{f"bound.{one}": f"(<= 0.0 {one})" for one in (*_A, *_B, *_C)},
            **{f"monomial.{n}": f"(<= 0.0 {one})" for n, one in enumerate(monomials)},
        },
    )


def _in_reach(code: Code) -> Obligation:
    return Obligation(
        "`_bounds` takes the posture in the middle of a piece, and the reach of the tool while the joints\n"
        "are as far from there as any that are on it.",
        (SIZE, *_BOUNDED, *_LONG, *declared("p", "q", "r", "s", "middle", "width", "joint")),
        "(and (<= (size (- joint at)) far) (= at (/ (+ p (* 3.0 q) (* 3.0 r) s) 8.0)))",
        tables=(_explored(code, "at"), _explored(code, "far")),
        assumptions={"on-the-piece": "(<= (size (- joint middle)) width)"},
    )


def _middle(code: Code) -> Obligation:
    bezier = code.module(BEZIER, max=largest)

    def run(ask: Ask, field: str) -> str:
        piece = tuple((Real(corner, ask),) for corner in "abcd")
        return term_of(getattr(bezier.derivatives(piece), field)[0])

    return Obligation(
        "`derivatives` gives the first and second derivative of a cubic piece in its middle.",
        declared(*"abcd"),
        "(and (= first (* (/ 3 4) (- (+ c d) a b))) (= second (* 3.0 (- (+ a d) b c))))",
        tables=tuple(
            Table(field, "Real", explore(partial(run, field=field))) for field in ("first", "second")
        ),
    )


def _span(code: Code) -> Obligation:
    bezier = code.module(BEZIER, min=smallest, max=largest_of)

    def run(ask: Ask, field: int) -> str:
        piece = tuple((Real(corner, ask),) for corner in "abcd")
        return term_of(bezier.span_of([piece])[field][0])

    return Obligation(
        "`span_of` holds the control points of a piece, and so what is between them.",
        (SIZE, LARGER, *declared(*"abcd")),
        conjunction(f"(<= (size (- {one} middle)) width)" for one in "abcd"),
        tables=tuple(
            Table(name, "Real", explore(partial(run, field=field)))
            for field, name in enumerate(("middle", "width"))
        ),
    )


# Pieces that are halved, and a path of them.

_ORDERS: Final = (1, 2, 3) * 2


def _halved(code: Code) -> Obligation:
    """An induction over halvings: what is said of the halves bounds the derivatives by their parameters."""
    peaks = code.module(PEAKS)
    piece = peaks._piece

    def run(ask: Ask, place: int) -> str:
        def bounds(of: str) -> list[Real]:
            return [Real(f"{of}.{number}", ask) for number in range(6)]

        class Depth:
            """How often it has been halved."""

            def __eq__(self, _: object) -> bool:
                return ask("is-deepest")

            def __add__(self, _: int) -> Depth:
                return self

            __hash__ = None  # type: ignore[assignment]

        vars(peaks).update(
            _bounds=lambda _, of: bounds(of),
            _piece=lambda _, of, __, ___: bounds(of),
            halves=lambda _: ("first", "second"),
            max=largest,
            min=smallest,
        )
        return term_of(piece(None, "whole", Real("allowed", ask), Depth())[place])

    numbers = range(6)
    by_half = {
        half: conjunction(
            f"(<= is.{number} (* {2**order}.0 {half}.{number}))"
            for number, order in zip(numbers, _ORDERS, strict=True)
        )
        for half in ("first", "second")
    }
    return Obligation(
        "`_piece` bounds the derivatives by the parameter of a piece, where those by the parameters of its\n"
        "halves, which run twice as fast, are bounded.",
        (
            *declared(
                "allowed", *(f"{of}.{n}" for of in ("whole", "first", "second", "is") for n in numbers)
            ),
            "(declare-const is-deepest Bool)",
        ),
        conjunction(f"(<= is.{number} found.{number})" for number in numbers),
        tables=tuple(
            Table(f"found.{number}", "Real", explore(partial(run, place=number))) for number in numbers
        ),
        assumptions={
            "bounds": conjunction(f"(<= is.{number} whole.{number})" for number in numbers),
            "on-a-half": disjunction(by_half.values()),
        },
    )


def _path(code: Code) -> Obligation:
    peaks = code.module(PEAKS)

    def run(ask: Ask, place: int) -> str:
        vars(peaks).update(
            _piece=lambda _, of, __, ___: [Real(f"{of}.{number}", ask) for number in range(6)],
            timed=lambda *given: given[:3] if given[3].term == "duration" else None,
            max=largest,
        )
        duration, limit = Real("duration", ask), Real("limit", ask)
        moving, turning = peaks.tool_rates(None, ("one", "other"), duration, limit)
        return term_of((*moving, *turning)[place])

    numbers = range(6)
    on = [
        conjunction(f"(<= is.{number} {piece}.{number})" for number in numbers) for piece in ("one", "other")
    ]
    return Obligation(
        "`tool_rates` has `timed` bound the rates of a tool whose derivatives by s are bounded: on a path\n"
        "of two, a piece runs twice as fast.",
        declared("duration", "limit", *(f"{of}.{n}" for of in ("one", "other", "is") for n in numbers)),
        conjunction(
            f"(<= (* {2**order}.0 is.{number}) by-s.{number})"
            for number, order in zip(numbers, _ORDERS, strict=True)
        ),
        tables=tuple(
            Table(f"by-s.{number}", "Real", explore(partial(run, place=number))) for number in numbers
        ),
        assumptions={"on-a-piece": disjunction(on)},
    )


THEOREM = Theorem(
    "no tool moves or turns faster, nor any more suddenly, than the bounds that the gate decides by",
    {
        **{name: partial(_motion, name) for name in _MOTION},
        "third": _third,
        "middle": _middle,
        "span": _span,
        "in-reach": _in_reach,
        "of-place": _of_place,
        "ends": _ends,
        "of-rotation": _of_rotation,
        "halved": _halved,
        "path": _path,
    },
    (
        Mutant(
            "takes-the-rotation-of-the-last-joint-for-all",
            "turn",
            PEAKS,
            "wx, wy, wz = wx + zx, wy + zy, wz + zz",
            "wx, wy, wz = zx, zy, zz",
        ),
        Mutant(
            "takes-the-last-control-points-for-all",
            "span",
            BEZIER,
            "high = [max(values) for values",
            "high = [values[-1] for values",
        ),
        Mutant(
            "counts-pairs-once",
            "third",
            PEAKS,
            "3.0 * (sa * sb - pairs)",
            "1.0 * (sa * sb - pairs)",
        ),
        Mutant(
            "takes-the-middle-of-the-box-for-that-of-the-piece",
            "in-reach",
            PEAKS,
            "[w + abs(m - q) for w, m, q in",
            "[w for w, m, q in",
        ),
        Mutant(
            "looks-at-one-end",
            "of-place",
            PEAKS,
            "max(norm(_plus(first_at, second_at, 0.5)), norm(_plus(first_at, second_at, -0.5)))",
            "norm(_plus(first_at, second_at, 0.5))",
        ),
        Mutant(
            "forgets-that-axes-are-turned",
            "of-rotation",
            PEAKS,
            "bend = sb + 0.5 * sa * sa",
            "bend = sb",
        ),
        Mutant(
            "takes-a-half-for-as-fast-as-the-whole",
            "halved",
            PEAKS,
            "scale = (2.0, 4.0, 8.0) * 2",
            "scale = (2.0, 2.0, 2.0) * 2",
        ),
        Mutant(
            "takes-the-latest-piece-for-the-fastest",
            "path",
            PEAKS,
            "most = [max(pair) for pair in zip(most, _piece(body, piece, allowed, 0), strict=True)]",
            "most = _piece(body, piece, allowed, 0)",
        ),
    ),
)
