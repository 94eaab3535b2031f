"""Where a ball of a moving body stays on a stretch of path: the enclosures of theorem 14."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import product
from types import SimpleNamespace
from typing import Any, Final

from aeros.spec.theorems.module_copies import Code
from aeros.spec.theorems.smtlib import conjunction
from aeros.spec.theorems.symbolic_execution import Ask, explore, term_of
from aeros.spec.theorems.theorem import Obligation, Table
from proofs.lib import kinematic_chain
from proofs.lib.symbolic_reals import (
    AXES,
    LARGER,
    POLYNOMIALS,
    SIZE,
    Real,
    declared,
    largest_of,
    symbols,
    total,
)

SWEEP: Final = "aeros.runtime.motion.swept_volume"
BEZIER: Final = "aeros.runtime.motion.bezier"

# Where a point of the body stays while the joints are near a straight way.


class _Way(Real):
    """How far a joint goes; how long that is, is a symbol of its own."""

    __slots__ = ()

    def __abs__(self) -> Real:
        return Real(f"long.{self.term}", self.ask)


_REACH: Final = tuple(
    line
    for joint in reversed(kinematic_chain.JOINTS)
    for line in (
        f"(define-fun width.{joint} () Real (+ long.d.{joint} r.{joint}))",
        f"(define-fun reach.{joint} () Real {kinematic_chain.reach_of(joint)})",
    )
)


def _bend() -> str:
    """Half the sum over pairs of joints: what Taylor's theorem leaves, each second derivative bounded."""
    return total(
        f"(* (/ 1 2) width.{i} width.{j} reach.{max(i, j)})"
        for i, j in product(kinematic_chain.JOINTS, repeat=2)
    )


def _sweep(code: Code) -> Obligation:
    links = kinematic_chain.chain_module(code)

    def run(ask: Ask, edge: int | None) -> str:
        chord = [_Way(f"d.{joint}", ask) for joint in kinematic_chain.JOINTS]
        room = [Real(f"r.{joint}", ask) for joint in kinematic_chain.JOINTS]
        along = links.along_of(chord, room)
        edges, near = kinematic_chain.posture_of(links, ask).sweep(
            len(kinematic_chain.JOINTS), symbols(ask, "p"), along
        )
        return term_of(near if edge is None else edges[edge])

    tables = [Table(f"edge.{axis}", "Real", explore(partial(run, edge=at))) for at, axis in enumerate(AXES)]
    tables.append(Table("near", "Real", explore(partial(run, edge=None))))
    slopes = [
        total(f"(* {kinematic_chain.arm(joint)[at]} d.{joint})" for joint in kinematic_chain.JOINTS)
        for at in range(len(AXES))
    ]
    beside = total(f"(* {kinematic_chain.off(joint)} r.{joint})" for joint in kinematic_chain.JOINTS)
    return Obligation(
        "`along_of` and `Posture.sweep`: the edges are those of the derivative along the way, and how near\n"
        "the point stays is what the rest can do: first derivatives beside it, and Taylor's remainder.",
        (
            SIZE,
            *kinematic_chain.CHAIN,
            *declared(
                *(f"{what}.{joint}" for what in ("d", "r", "long.d") for joint in kinematic_chain.JOINTS)
            ),
            *_REACH,
        ),
        conjunction(
            (
                *(f"(= edge.{axis} (size {slope}))" for axis, slope in zip(AXES, slopes, strict=True)),
                f"(= near (+ {beside} {_bend()}))",
            )
        ),
        tables=tuple(tables),
    )


def _stays(_: Code) -> Obligation:
    """With what the sweep adds up named: slopes, arms and remainder."""
    beside = total(f"(* off.{joint} beside.{joint})" for joint in kinematic_chain.JOINTS)
    room = total(f"(* off.{joint} r.{joint})" for joint in kinematic_chain.JOINTS)
    return Obligation(
        "Where Taylor's theorem has a point be, is in the box of the derivative along the way or as near to\n"
        "it as `sweep` says: an edge for each coordinate, and a length for the rest.",
        (
            SIZE,
            *declared("share", "bend", "rest", *(f"slope.{axis}" for axis in AXES)),
            *declared(
                *(f"{what}.{joint}" for what in ("off", "beside", "r") for joint in kinematic_chain.JOINTS)
            ),
        ),
        conjunction(
            (
                *(f"(<= (size (* share slope.{axis})) (size slope.{axis}))" for axis in AXES),
                f"(<= rest (+ {room} bend))",
            )
        ),
        assumptions={
            "share": "(<= (- 1.0) share 1.0)",
            "taylor": f"(<= rest (+ {beside} bend))",
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


def _piece(ask: Ask, name: str = "") -> Any:
    """A piece of the path of one joint."""
    return tuple((Real(f"{corner}{name}", ask),) for corner in _CORNERS)


def _at(x: str, piece: tuple[str, ...]) -> str:
    """Where a piece is, by its parameter."""
    y = f"(- 1.0 {x})"
    factors = (f"{y} {y} {y}", f"3.0 {y} {y} {x}", f"3.0 {y} {x} {x}", f"{x} {x} {x}")
    return total(f"(* {factor} {corner})" for factor, corner in zip(factors, piece, strict=True))


def _weights(_: Code) -> Obligation:
    y = "(- 1.0 x)"
    weights = (f"(* {y} {y} {y})", f"(* 3.0 {y} {y} x)", f"(* 3.0 {y} x x)", "(* x x x)")
    return Obligation(
        "Wherever on a cubic piece, its control points have weights that are not negative, and are one\n"
        "together.",
        declared("x"),
        conjunction((*(f"(<= 0.0 {one})" for one in weights), f"(= {total(weights)} 1.0)")),
        assumptions={"on-the-piece": "(<= 0.0 x 1.0)"},
        logic=POLYNOMIALS,
    )


def _chord(pieces: int, code: Code) -> Obligation:
    bezier = code.module(BEZIER, max=largest_of)

    def run(ask: Ask, field: str) -> str:
        found = bezier.chord_of([_piece(ask, str(one)) for one in range(pieces)])
        return term_of(getattr(found, field)[0])

    claims = []
    for number, corner in product(range(pieces), range(4)):
        share = (3 * number + corner) * (2.0 / (3 * pieces)) - 1.0  # as the code has it, rounded
        claims.append(f"(<= (- 1.0) {term_of(share)} 1.0)")
        claims.append(
            f"(<= (size (- {_CORNERS[corner]}{number} (+ middle (* {term_of(share)} half)))) width)"
        )
    return Obligation(
        f"`chord_of` of a path of {pieces}: each control point is as near to its place on the straight way\n"
        "as it says, and that place is on it.",
        (SIZE, LARGER, *declared(*(f"{corner}{one}" for corner in _CORNERS for one in range(pieces)))),
        conjunction(claims),
        tables=tuple(
            Table(field, "Real", explore(partial(run, field=field))) for field in ("middle", "half", "width")
        ),
    )


def _mixture(_: Code) -> Obligation:
    each = range(4)
    place = total(f"(* w{one} (+ middle (* share{one} half) away{one}))" for one in each)
    share, away = (total(f"(* w{one} {what}{one})" for one in each) for what in ("share", "away"))
    return Obligation(
        "What has weights of four places that are beside a way, is beside that way as their mixture is.",
        (
            *declared("middle", "half", "w0", "w1", "w2"),
            *declared(*(f"{what}{one}" for what in ("share", "away") for one in each)),
            "(define-fun w3 () Real (- 1.0 w0 w1 w2))",
        ),
        f"(= {place} (+ middle (* {share} half) {away}))",
    )


def _between(_: Code) -> Obligation:
    each = range(4)
    return Obligation(
        "By weights that are not negative, and one together, four numbers mix to none that is larger than\n"
        "each is at most.",
        (
            *declared("most", *(f"weighted{one}" for one in each)),
            *declared(*(f"weighted.most{one}" for one in each)),
            SIZE,
        ),
        f"(<= (size {total(f'weighted{one}' for one in each)}) most)",
        assumptions={
            # By `weights`; these are products with them.
            "one-together": f"(= {total(f'weighted.most{one}' for one in each)} most)",
            **{
                f"grows{one}": f"(<= (- weighted.most{one}) weighted{one} weighted.most{one})" for one in each
            },
        },
    )


def _parts(which: str, code: Code) -> Obligation:
    bezier = code.module(BEZIER)

    def run(ask: Ask, corner: int) -> str:
        if which == "rest":
            found = bezier._end_of(_piece(ask), Real("u", ask))
        else:
            found = bezier.halves(_piece(ask))[which == "second"]
        return term_of(found[corner][0])

    place = {"first": "(/ x 2.0)", "second": "(/ (+ 1.0 x) 2.0)", "rest": "(+ u (* (- 1.0 u) x))"}[which]
    return Obligation(
        f"`{'_end_of' if which == 'rest' else 'halves'}`: the {which} of a piece is where that is.",
        declared("x", "u", *_CORNERS),
        f"(= {_at('x', tuple(f'part.{one}' for one in _CORNERS))} {_at(place, tuple(_CORNERS))})",
        tables=tuple(
            Table(f"part.{name}", "Real", explore(partial(run, corner=corner)))
            for corner, name in enumerate(_CORNERS)
        ),
    )


def _enclosures(code: Code) -> Obligation:
    """Of one joint and one ball, with the geometry put aside."""
    sweep = code.module(SWEEP)

    def run(ask: Ask, told: str) -> str:
        found: dict[str, str] = {}
        chord = tuple((Real(name, ask),) for name in ("middle", "half", "width"))

        def posture(_: Any, q: Any) -> Any:
            found["q"] = q[0].term
            return SimpleNamespace(frames=[None, SimpleNamespace(place=lambda _: "centre")], sweep=swept)

        def along_of(chord: Any, room: Any) -> str:
            found["chord"], found["room"] = chord[0].term, room[0].term
            return "along"

        def swept(joint: int, centre: str, along: str) -> Any:
            if (joint, centre, along) != (1, "centre", "along"):
                raise ValueError(joint, centre, along)
            return "edges", Real("near", ask)

        put = {"chord_of": lambda _: chord, "Posture": posture, "along_of": along_of}
        vars(sweep).update(put)
        ball = SimpleNamespace(joint=1, centre=None, radius=Real("ball", ask))
        (one,) = sweep.enclosures(None, [], (Real("slack", ask),), [ball])
        found["radius"] = one.radius.term
        return found[told]

    told = {"q": "middle", "chord": "half", "room": "(+ width slack)", "radius": "(+ ball near)"}
    return Obligation(
        "`enclosures` asks for what stays near the chord, with the slack that joints have beside it,\n"
        "and adds the radius of the ball.",
        declared("middle", "half", "width", "slack", "near", "ball"),
        conjunction(f"(= told.{name} {wanted})" for name, wanted in told.items()),
        tables=tuple(Table(f"told.{name}", "Real", explore(partial(run, told=name))) for name in told),
    )


def ball_obligations() -> dict[str, Callable[[Code], Obligation]]:
    """Of one stretch of path: the way of the joints, and the enclosures of what they carry."""
    return {
        **kinematic_chain.link_obligations(),
        "sweep": _sweep,
        "stays": _stays,
        "weights": _weights,
        "chord-of-one": partial(_chord, 1),
        "chord-of-two": partial(_chord, 2),
        "mixture": _mixture,
        "between": _between,
        **{f"part-{which}": partial(_parts, which) for which in ("first", "second", "rest")},
        "enclosures": _enclosures,
    }
