"""A chain of joints as `kinematic_chain.py` computes it, and what `kinematics.py` says of it, explored.

Three joints and a point that they move.

The geometry of one joint is proved, of its axis and of any point (`link_obligations`).  What is claimed of a
chain is an induction over its joints, from the tip inwards; its step takes from the geometry what is named in
`reaching`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import partial
from itertools import product
from types import ModuleType
from typing import Any, Final

from aeros.kinematic_chain import ORIGIN, Frame
from aeros.spec.theorems.module_copies import Code
from aeros.spec.theorems.smtlib import conjunction, literal
from aeros.spec.theorems.symbolic_execution import Ask, explore, term_of
from aeros.spec.theorems.theorem import Obligation, Table
from proofs.lib.symbolic_reals import (
    AXES,
    POLYNOMIALS,
    Real,
    cross,
    declared,
    declared_vectors,
    dot,
    minus,
    norm_of,
    symbols,
    total,
    vector,
)

LINKS: Final = "aeros.kinematic_chain"
KINEMATICS: Final = "aeros.runtime.motion.kinematics"

JOINTS: Final = (0, 1, 2)
"""Three joints, from the base to the tip; they stand for any number."""

# One joint.

_TURNS: Final = {
    "alpha": ("ca", "sa"),
    "angle": ("c", "s"),
    # By the addition theorems, what the angle is after it has grown by another.
    "grown": ("(- (* c cp) (* s sp))", "(+ (* s cp) (* c sp))"),
}
_PARTS: Final = ("origin", "x", "y", "z")


def _links(code: Code) -> ModuleType:
    return code.module(
        LINKS,
        cos=lambda turn: Real(_TURNS[turn.term][0], turn.ask),
        sin=lambda turn: Real(_TURNS[turn.term][1], turn.ask),
    )


def _next_frame(code: Code, name: str, angle: str, *, of_the_base: bool = False) -> Iterator[Table]:
    """The coordinates of what `next_frame` makes of any frame."""
    links = _links(code)

    def run(ask: Ask, part: int, axis: int) -> str:
        any_frame = links.Frame(*(symbols(ask, one) for one in _PARTS))
        frame = links.ORIGIN if of_the_base else any_frame
        row = tuple(Real(one, ask) for one in ("a", "alpha", "d"))
        following = links.next_frame(frame, links.mounting_of(row), Real(angle, ask))
        return term_of(following[part][axis])

    for (part, which), (axis, letter) in product(enumerate(_PARTS), enumerate(AXES)):
        yield Table(f"{name}.{which}.{letter}", "Real", explore(partial(run, part=part, axis=axis)))


_FRAME: Final = (
    *declared_vectors(*_PARTS),
    *declared("a", "d", "ca", "sa", "c", "s", "cp", "sp"),
)


def _turns(code: Code) -> Obligation:
    claims = [f"(= grown.{part}.{axis} next.{part}.{axis})" for part in ("origin", "z") for axis in AXES]
    for axis in AXES:
        x, y = f"next.x.{axis}", f"next.y.{axis}"
        claims.append(f"(= grown.x.{axis} (+ (* cp {x}) (* sp {y})))")
        claims.append(f"(= grown.y.{axis} (- (* cp {y}) (* sp {x})))")
    return Obligation(
        "`next_frame`, where the joint's angle has grown: the frame is turned about its own z by as much,\n"
        "and its origin and its z are what they were.",
        _FRAME,
        conjunction(claims),
        tables=(*_next_frame(code, "next", "angle"), *_next_frame(code, "grown", "grown")),
    )


def _carries(code: Code) -> Obligation:
    claims = []
    for part, axis in product(_PARTS, AXES):
        summands = [f"(* local.{part}.{one} {one}.{axis})" for one in AXES]
        claims.append(
            f"(= next.{part}.{axis} {total([*summands, *([f'origin.{axis}'] * (part == 'origin'))])})"
        )
    return Obligation(
        "`next_frame` of any frame is that of the base, carried there: so whatever turns a frame turns all\n"
        "that are further out with it.",
        _FRAME,
        conjunction(claims),
        tables=(*_next_frame(code, "next", "angle"), *_next_frame(code, "local", "angle", of_the_base=True)),
    )


def _stands(code: Code) -> Obligation:
    frame = {one: vector(f"next.{one}") for one in AXES}
    claims = [
        f"(= {dot(frame[a], frame[b])} {literal(Fraction(int(a == b)))})" for a, b in product(AXES, AXES)
    ]
    claims += [
        f"(= {one} {other})" for one, other in zip(frame["z"], cross(frame["x"], frame["y"]), strict=True)
    ]
    return Obligation(
        "The axes of a frame, as `next_frame` makes it of the base's, are perpendicular, of length one, and\n"
        "right-handed.",
        _FRAME,
        conjunction(claims),
        tables=tuple(_next_frame(code, "next", "angle", of_the_base=True)),
        assumptions={"alpha": "(= (+ (* ca ca) (* sa sa)) 1.0)", "angle": "(= (+ (* c c) (* s s)) 1.0)"},
    )


def _moves(_: Code) -> Obligation:
    """In the coordinates of the joint's frame, where the point is at (x, y, z)."""
    return Obligation(
        "A point that is turned by an angle moves by no more than its distance from the axis times that;\n"
        "said of squares. Assumed of the cosine: 1 - cos p <= p^2/2.",
        declared("x", "y", "p", "cp", "sp"),
        "(<= (+ (* dx dx) (* dy dy)) (* p p (+ (* x x) (* y y))))",
        lemmas=(
            "(define-fun dx () Real (- (- (* cp x) (* sp y)) x))",
            "(define-fun dy () Real (- (+ (* sp x) (* cp y)) y))",
        ),
        assumptions={
            "cosine": "(<= (- 1.0 cp) (/ (* p p) 2.0))",
            "circle": "(= (+ (* cp cp) (* sp sp)) 1.0)",
        },
        logic=POLYNOMIALS,
    )


def _turned_is_no_longer(_: Code) -> Obligation:
    """So a derivative by a joint further in, which turns what it is the derivative of, lengthens nothing."""
    crossed = cross(vector("z"), vector("v"))
    return Obligation(
        "The product of an axis with a vector is no longer than the vector; said of squares.",
        declared_vectors("z", "v"),
        f"(<= {dot(crossed, crossed)} {dot(vector('v'), vector('v'))})",
        assumptions={"an-axis": f"(= {dot(vector('z'), vector('z'))} 1.0)"},
        logic=POLYNOMIALS,
    )


def _cauchy(_: Code) -> Obligation:
    uv, uu, vv = (dot(vector(a), vector(b)) for a, b in (("u", "v"), ("u", "u"), ("v", "v")))
    crossed = cross(vector("u"), vector("v"))
    return Obligation(
        "The scalar product of two vectors is no larger than the product of their lengths: the squares of\n"
        "these differ by the square of the vector product.",
        declared_vectors("u", "v"),
        f"(= (- (* {uu} {vv}) (* {uv} {uv})) {dot(crossed, crossed)})",
    )


def _triangle(_: Code) -> Obligation:
    return Obligation(
        "The sum of two vectors is no longer than both together.",
        declared("u.long", "v.long", "u.v", "long"),
        "(<= long (+ u.long v.long))",
        assumptions={
            "lengths": "(and (<= 0.0 u.long) (<= 0.0 v.long) (<= 0.0 long))",
            "sum": "(= (* long long) (+ (* u.long u.long) (* 2.0 u.v) (* v.long v.long)))",
            "cauchy": "(<= u.v (* u.long v.long))",
        },
        logic=POLYNOMIALS,
    )


# A chain of joints.

PLACES: Final = (
    *(line for joint in JOINTS for line in declared_vectors(f"o{joint}", f"z{joint}")),
    *declared_vectors("p"),
)
"""The origin and the axis of each joint, and a point that all of them move."""

CHAIN: Final = ("(declare-fun norm (Real Real Real) Real)", *PLACES)
"""The same, and lengths."""


def arm(joint: int) -> tuple[str, ...]:
    """How the point moves as that joint turns: the axis times the way from it to the point."""
    return cross(vector(f"z{joint}"), minus(vector("p"), vector(f"o{joint}")))


def off(joint: int) -> str:
    """How far the point is from the axis of that joint, in the posture."""
    return f"(norm {' '.join(arm(joint))})"


def posture_of(links: ModuleType, ask: Ask) -> Any:
    """Any posture of the chain."""
    posture = object.__new__(links.Posture)
    symbolic: Any = Frame
    posture.frames = [ORIGIN] + [
        symbolic(symbols(ask, f"o{joint}"), None, None, symbols(ask, f"z{joint}")) for joint in JOINTS
    ]
    return posture


def chain_module(code: Code) -> ModuleType:
    """A copy of `kinematics.py` that computes with symbols."""
    return code.module(KINEMATICS, hypot=length_of)


def length_of(x: Any, y: Any, z: Any) -> Real:
    """Stands for `hypot`."""
    return norm_of(x.ask, x, y, z)


REACHING: Final = (
    *declared(*(f"width.{joint}" for joint in JOINTS)),
    *declared(*(f"{what}.{joint}" for joint in (*JOINTS, len(JOINTS)) for what in ("far", "moved"))),
)
"""While the joints are within their widths: how far the point gets from each axis by what the joints beyond
do, and how far it is moved by each joint and those beyond it."""


def reaching() -> dict[str, str]:
    """What the geometry of a joint says of the point."""
    given = {"nothing-beyond": f"(= moved.{len(JOINTS)} 0.0)"}
    for joint in JOINTS:
        given[f"width.{joint}"] = f"(<= 0.0 width.{joint})"
        # By `triangle` and `turned-is-no-longer`: no further from the axis than it is moved towards it.
        given[f"far.{joint}"] = f"(<= 0.0 far.{joint} (+ {off(joint)} moved.{joint + 1}))"
        # By `moves`, and `triangle`.
        given[f"moved.{joint}"] = f"(<= moved.{joint} (+ moved.{joint + 1} (* width.{joint} far.{joint})))"
    return given


def reach_of(joint: int) -> str:
    """What `Posture.spread` says of that joint, by the reaches of those beyond it."""
    beyond = (f"(* width.{other} reach.{other})" for other in JOINTS if other > joint)
    return total((off(joint), *beyond))


def _grows(_: Code) -> Obligation:
    return Obligation(
        "A product grows with its factors, where the other is not negative.",
        declared("factor", "one", "other"),
        "(<= (* factor one) (* factor other))",
        assumptions={"factor": "(<= 0.0 factor)", "order": "(<= one other)"},
    )


def _spread(code: Code) -> Obligation:
    links = chain_module(code)

    def run(ask: Ask, joint: int | None) -> str:
        width = [Real(f"width.{joint}", ask) for joint in JOINTS]
        most, reaches = posture_of(links, ask).spread(len(JOINTS), symbols(ask, "p"), width)
        return term_of(most if joint is None else reaches[joint])

    reaches = [Table(f"reach.{joint}", "Real", explore(partial(run, joint=joint))) for joint in JOINTS]
    monotone = {
        f"product.{joint}": f"(=> (<= far.{joint} reach.{joint})"
        f" (<= (* width.{joint} far.{joint}) (* width.{joint} reach.{joint})))"
        for joint in JOINTS
    }
    return Obligation(
        "`Posture.spread` bounds how far a point gets from each axis, and from where it is, while the\n"
        "joints are within their widths.",
        (*CHAIN, *REACHING),
        conjunction(
            (
                *(f"(<= far.{joint} reach.{joint})" for joint in JOINTS),
                *(f"(= reach.{joint} {reach_of(joint)})" for joint in JOINTS),
                "(<= moved.0 total)",
            )
        ),
        tables=(*reaches, Table("total", "Real", explore(partial(run, joint=None)))),
        assumptions={**reaching(), **monotone},
    )


def link_obligations() -> dict[str, Callable[[Code], Obligation]]:
    """The geometry of one joint."""
    return {
        "turns": _turns,
        "carries": _carries,
        "stands": _stands,
        "moves": _moves,
        "turned-is-no-longer": _turned_is_no_longer,
        "cauchy": _cauchy,
        "triangle": _triangle,
        "grows": _grows,
        "spread": _spread,
    }
