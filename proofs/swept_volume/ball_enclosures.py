"""Enclosures of a moving body's ball on a stretch of path, for theorem 14."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import product
from types import SimpleNamespace
from typing import Any, Final

from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.smtlib import smt_and
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically, term_of
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation
from proofs.lib import kinematic_chain
from proofs.lib.symbolic_reals import (
    AXES,
    LARGER_DEFINITION,
    POLYNOMIALS,
    SIZE,
    SymbolicReal,
    declare_reals,
    max_of_many_stub,
    sum_terms,
    symbolic_vector,
)

SWEEP: Final = "aeros.runtime.motion.swept_volume"
LINKS: Final = "aeros.runtime.motion.link_distance"
BEZIER: Final = "aeros.runtime.motion.bezier"

# Where a point of the body stays while the joints are near a straight way.


class _JointDisplacement(SymbolicReal):
    """Symbolic displacement of a joint; its absolute value is a symbol of its own."""

    __slots__ = ()

    def __abs__(self) -> SymbolicReal:
        return SymbolicReal(f"long.{self.term}", self.ask)


def _reaches(slides: tuple[bool, ...]) -> Iterator[str]:
    """Define how far the point may be from each axis, one for a prismatic joint, from the tip inwards."""
    kinds = kinematic_chain.letters_of(slides)
    for joint in reversed(kinematic_chain.JOINTS):
        reach = kinematic_chain.reach_terms(joint, slides, f".{kinds}")
        yield f"(define-fun reach.{kinds}.{joint} () Real {reach})"


def _taylor_remainder(slides: tuple[bool, ...]) -> str:
    """Half the sum over pairs of joints: what Taylor's theorem leaves, each second derivative bounded.

    By a prismatic joint and one further out, or itself, the second derivative is 0.
    """
    kinds = kinematic_chain.letters_of(slides)
    return sum_terms(
        f"(* (/ 1 2) width.{i} width.{j} reach.{kinds}.{max(i, j)})"
        for i, j in product(kinematic_chain.JOINTS, repeat=2)
        if not slides[min(i, j)]
    )


def _sweep(code: ModuleSource) -> TheoremObligation:
    links = kinematic_chain.chain_module(code)
    joints = kinematic_chain.JOINTS

    def run(ask: DecideBranch, edge: int | None, slides: tuple[bool, ...]) -> str:
        chord = [_JointDisplacement(f"d.{joint}", ask) for joint in joints]
        room = [SymbolicReal(f"r.{joint}", ask) for joint in joints]
        along = links.chord_terms(chord, room, slides)
        posture = kinematic_chain.symbolic_posture(links, ask, slides)
        edges, near = posture.chord_deviation_bound(len(joints), symbolic_vector(ask, "p"), along)
        return term_of(near if edge is None else edges[edge])

    tables: list[SymbolicFunction] = []
    claims: list[str] = []
    reaches: list[str] = []
    for slides in kinematic_chain.KIND_CHOICES:
        kinds = kinematic_chain.letters_of(slides)
        reaches += _reaches(slides)
        for at, axis in enumerate(AXES):
            explored = execute_symbolically(partial(run, edge=at, slides=slides))
            tables.append(SymbolicFunction(f"edge.{kinds}.{axis}", "Real", explored))
            slope = sum_terms(
                f"(* {kinematic_chain.derivative_terms(joint, slides[joint])[at]} d.{joint})"
                for joint in joints
            )
            claims.append(f"(= edge.{kinds}.{axis} (size {slope}))")
        explored = execute_symbolically(partial(run, edge=None, slides=slides))
        tables.append(SymbolicFunction(f"near.{kinds}", "Real", explored))
        first_order = sum_terms(
            f"(* {'1.0' if slides[joint] else kinematic_chain.axis_distance(joint)} r.{joint})"
            for joint in joints
        )
        claims.append(f"(= near.{kinds} (+ {first_order} {_taylor_remainder(slides)}))")
    return TheoremObligation(
        "`chord_terms` and `chord_deviation_bound`: the edges are those of the derivative along the\n"
        "way, and how near the point stays is what the rest can do: first derivatives beside it,"
        " and Taylor's remainder;\nof each choice of revolute (r) and prismatic (p) joints.",
        (
            SIZE,
            *kinematic_chain.CHAIN,
            *declare_reals(*(f"{what}.{joint}" for what in ("d", "r", "long.d") for joint in joints)),
            *(f"(define-fun width.{joint} () Real (+ long.d.{joint} r.{joint}))" for joint in joints),
            *reaches,
        ),
        smt_and(claims),
        tables=tuple(tables),
    )


def _enclosure_obligation(_: ModuleSource) -> TheoremObligation:
    """With what the sweep adds up named: slopes, arms and remainder."""
    first_order = sum_terms(f"(* off.{joint} beside.{joint})" for joint in kinematic_chain.JOINTS)
    room = sum_terms(f"(* off.{joint} r.{joint})" for joint in kinematic_chain.JOINTS)
    return TheoremObligation(
        "Where Taylor's theorem has a point be, is in the box of the derivative along the way or as near to\n"
        "it as `sweep` says: an edge for each coordinate, and a length for the rest.",
        (
            SIZE,
            *declare_reals("share", "bend", "rest", *(f"slope.{axis}" for axis in AXES)),
            *declare_reals(
                *(f"{what}.{joint}" for what in ("off", "beside", "r") for joint in kinematic_chain.JOINTS)
            ),
        ),
        smt_and(
            (
                *(f"(<= (size (* share slope.{axis})) (size slope.{axis}))" for axis in AXES),
                f"(<= rest (+ {room} bend))",
            )
        ),
        assumptions={
            "share": "(<= (- 1.0) share 1.0)",
            "taylor": f"(<= rest (+ {first_order} bend))",
            **{
                f"beside.{joint}": f"(and (<= 0.0 off.{joint}) (<= beside.{joint} r.{joint}))"
                for joint in kinematic_chain.JOINTS
            },
            **{
                f"grows.{joint}": f"(=> (and (<= 0.0 off.{joint}) (<= beside.{joint} r.{joint}))"
                f" (<= (* off.{joint} beside.{joint}) (* off.{joint} r.{joint})))"
                for joint in kinematic_chain.JOINTS
            },
        },
    )


# The way of the joints.

_CORNERS: Final = "abcd"


def _piece(ask: DecideBranch, name: str = "") -> Any:
    """A piece of the path of one joint."""
    return tuple((SymbolicReal(f"{corner}{name}", ask),) for corner in _CORNERS)


def _evaluate_piece(x: str, piece: tuple[str, ...]) -> str:
    """Evaluate a piece at its parameter."""
    y = f"(- 1.0 {x})"
    factors = (f"{y} {y} {y}", f"3.0 {y} {y} {x}", f"3.0 {y} {x} {x}", f"{x} {x} {x}")
    return sum_terms(f"(* {factor} {corner})" for factor, corner in zip(factors, piece, strict=True))


def _weights(_: ModuleSource) -> TheoremObligation:
    y = "(- 1.0 x)"
    weights = (f"(* {y} {y} {y})", f"(* 3.0 {y} {y} x)", f"(* 3.0 {y} x x)", "(* x x x)")
    return TheoremObligation(
        "Wherever on a cubic piece, its control points have weights that are not negative, and are one\n"
        "together.",
        declare_reals("x"),
        smt_and((*(f"(<= 0.0 {one})" for one in weights), f"(= {sum_terms(weights)} 1.0)")),
        assumptions={"on-the-piece": "(<= 0.0 x 1.0)"},
        logic=POLYNOMIALS,
    )


def _chord(pieces: int, code: ModuleSource) -> TheoremObligation:
    bezier = code.module(BEZIER, max=max_of_many_stub)

    def run(ask: DecideBranch, field: str) -> str:
        found = bezier.path_chord([_piece(ask, str(one)) for one in range(pieces)])
        return term_of(getattr(found, field)[0])

    claims = []
    for number, corner in product(range(pieces), range(4)):
        share = (3 * number + corner) * (2.0 / (3 * pieces)) - 1.0  # as the code has it, rounded
        claims.append(f"(<= (- 1.0) {term_of(share)} 1.0)")
        claims.append(
            f"(<= (size (- {_CORNERS[corner]}{number} (+ middle (* {term_of(share)} half)))) width)"
        )
    return TheoremObligation(
        f"`path_chord` of a path of {pieces}: each control point is as near to its place on the straight\n"
        "way as it says, and that place is on it.",
        (
            SIZE,
            LARGER_DEFINITION,
            *declare_reals(*(f"{corner}{one}" for corner in _CORNERS for one in range(pieces))),
        ),
        smt_and(claims),
        tables=tuple(
            SymbolicFunction(field, "Real", execute_symbolically(partial(run, field=field)))
            for field in ("middle", "half", "width")
        ),
    )


def _mixture_bound(_: ModuleSource) -> TheoremObligation:
    each = range(4)
    place = sum_terms(f"(* w{one} (+ middle (* share{one} half) away{one}))" for one in each)
    share, away = (sum_terms(f"(* w{one} {what}{one})" for one in each) for what in ("share", "away"))
    return TheoremObligation(
        "What has weights of four places that are beside a way, is beside that way as their mixture is.",
        (
            *declare_reals("middle", "half", "w0", "w1", "w2"),
            *declare_reals(*(f"{what}{one}" for what in ("share", "away") for one in each)),
            "(define-fun w3 () Real (- 1.0 w0 w1 w2))",
        ),
        f"(= {place} (+ middle (* {share} half) {away}))",
    )


def _convex_combination(_: ModuleSource) -> TheoremObligation:
    each = range(4)
    return TheoremObligation(
        "By weights that are not negative, and one together, four numbers mix to none that is larger than\n"
        "each is at most.",
        (
            *declare_reals("most", *(f"weighted{one}" for one in each)),
            *declare_reals(*(f"weighted.most{one}" for one in each)),
            SIZE,
        ),
        f"(<= (size {sum_terms(f'weighted{one}' for one in each)}) most)",
        assumptions={
            # By `weights`; these are products with them.
            "one-together": f"(= {sum_terms(f'weighted.most{one}' for one in each)} most)",
            **{
                f"grows{one}": f"(<= (- weighted.most{one}) weighted{one} weighted.most{one})" for one in each
            },
        },
    )


def _chord_parts(which: str, code: ModuleSource) -> TheoremObligation:
    bezier = code.module(BEZIER)

    def run(ask: DecideBranch, corner: int) -> str:
        if which == "rest":
            found = bezier._split_after(_piece(ask), SymbolicReal("u", ask))
        else:
            found = bezier.split_in_half(_piece(ask))[which == "second"]
        return term_of(found[corner][0])

    place = {"first": "(/ x 2.0)", "second": "(/ (+ 1.0 x) 2.0)", "rest": "(+ u (* (- 1.0 u) x))"}[which]
    return TheoremObligation(
        f"`{'_split_after' if which == 'rest' else 'split_in_half'}`: "
        f"the {which} of a piece is where that is.",
        declare_reals("x", "u", *_CORNERS),
        f"(= {_evaluate_piece('x', tuple(f'part.{one}' for one in _CORNERS))}"
        f" {_evaluate_piece(place, tuple(_CORNERS))})",
        tables=tuple(
            SymbolicFunction(f"part.{name}", "Real", execute_symbolically(partial(run, corner=corner)))
            for corner, name in enumerate(_CORNERS)
        ),
    )


def _enclosures(code: ModuleSource) -> TheoremObligation:
    """Of one joint and one ball, with the geometry put aside."""
    sweep = code.module(SWEEP)

    def run(ask: DecideBranch, name: str) -> str:
        found: dict[str, str] = {}
        chord = tuple((SymbolicReal(name, ask),) for name in ("middle", "half", "width"))

        def posture(_: Any, q: Any) -> Any:
            found["q"] = q[0].term
            return SimpleNamespace(
                frames=[None, SimpleNamespace(to_base=lambda _: "centre")],
                chord_deviation_bound=swept,
                slides="kinds",
            )

        def chord_terms(chord: Any, room: Any, slides: str) -> str:
            if slides != "kinds":
                raise ValueError(slides)
            found["chord"], found["room"] = chord[0].term, room[0].term
            return "along"

        def swept(joint: int, centre: str, along: str) -> Any:
            if (joint, centre, along) != (1, "centre", "along"):
                raise ValueError(joint, centre, along)
            return "edges", SymbolicReal("near", ask)

        put = {"path_chord": lambda _: chord, "ForwardKinematics": posture, "chord_terms": chord_terms}
        vars(sweep).update(put)
        ball = SimpleNamespace(joint=1, centre=None, radius=SymbolicReal("ball", ask))
        (one,) = sweep.ball_enclosures(None, [], (SymbolicReal("slack", ask),), [ball])
        found["radius"] = one.radius.term
        return found[name]

    expected = {"q": "middle", "chord": "half", "room": "(+ width slack)", "radius": "(+ ball near)"}
    return TheoremObligation(
        "`ball_enclosures` asks for what stays near the chord, with the slack that joints have beside it,\n"
        "and adds the radius of the ball.",
        declare_reals("middle", "half", "width", "slack", "near", "ball"),
        smt_and(f"(= told.{name} {term})" for name, term in expected.items()),
        tables=tuple(
            SymbolicFunction(f"told.{name}", "Real", execute_symbolically(partial(run, name=name)))
            for name in expected
        ),
    )


def ball_obligations() -> dict[str, Callable[[ModuleSource], TheoremObligation]]:
    """Of one stretch of path: the way of the joints, and the enclosures of what they carry."""
    return {
        **kinematic_chain.link_obligations(),
        "sweep": _sweep,
        "stays": _enclosure_obligation,
        "weights": _weights,
        "chord-of-one": partial(_chord, 1),
        "chord-of-two": partial(_chord, 2),
        "mixture": _mixture_bound,
        "between": _convex_combination,
        **{f"part-{which}": partial(_chord_parts, which) for which in ("first", "second", "rest")},
        "enclosures": _enclosures,
    }
