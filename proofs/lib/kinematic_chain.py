"""A chain of joints as `kinematic_chain.py` computes it, and what `kinematic_bounds.py` says of it, explored.

Three joints and a point that they move. Each of the joints is revolute or prismatic: obligations
are of every choice (`KIND_CHOICES`).

The geometry of one joint of each kind is proved, of its axis and of any point (`link_obligations`).  What is
claimed of a chain is an induction over its joints, from the tip inwards; its step takes from the geometry
what is named in `_reach_assumptions`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import partial
from itertools import product
from types import ModuleType
from typing import Any, Final

from aeros.kinematic_chain import ORIGIN, JointFrame
from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.smtlib import smt_and, smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically, term_of
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation
from proofs.lib.symbolic_reals import (
    AXES,
    POLYNOMIALS,
    SymbolicReal,
    cross,
    declare_reals,
    declare_vectors,
    dot,
    minus,
    norm_stub,
    sum_terms,
    symbolic_vector,
    vector_terms,
)

LINKS: Final = "aeros.kinematic_chain"
KINEMATICS: Final = "aeros.runtime.motion.kinematic_bounds"

JOINTS: Final = (0, 1, 2)
"""Three joints, from the base to the tip; they stand for any number."""

# One joint.

_TURNS: Final = {
    "alpha": ("ca", "sa"),
    "(+ angle zero)": ("c", "s"),
    # By the addition theorems, what the angle is after it has grown by another.
    "(+ grown zero)": ("(- (* c cp) (* s sp))", "(+ (* s cp) (* c sp))"),
    # Of a prismatic joint.
    "zero": ("c", "s"),
}
_PARTS: Final = ("origin", "x", "y", "z")


def _symbolic_links(code: ModuleSource) -> ModuleType:
    return code.module(
        LINKS,
        cos=lambda turn: SymbolicReal(_TURNS[turn.term][0], turn.ask),
        sin=lambda turn: SymbolicReal(_TURNS[turn.term][1], turn.ask),
    )


def _next_frame(
    code: ModuleSource, name: str, position: str, *, of_the_base: bool = False, slides: bool = False
) -> Iterator[SymbolicFunction]:
    """The coordinates of what `child_frame` makes of any frame, of a joint that turns or slides."""
    links = _symbolic_links(code)
    parameters = ("a", "alpha", "d", "zero", "slides") if slides else ("a", "alpha", "d", "zero")

    def run(ask: DecideBranch, part: int, axis: int) -> str:
        any_frame = links.JointFrame(*(symbolic_vector(ask, one) for one in _PARTS))
        frame = links.ORIGIN if of_the_base else any_frame
        row = tuple(SymbolicReal(one, ask) for one in parameters)
        following = links.child_frame(frame, links.mounting_of(row), SymbolicReal(position, ask))
        return term_of(following[part][axis])

    for (part, which), (axis, letter) in product(enumerate(_PARTS), enumerate(AXES)):
        yield SymbolicFunction(
            f"{name}.{which}.{letter}", "Real", execute_symbolically(partial(run, part=part, axis=axis))
        )


_FRAME: Final = (
    *declare_vectors(*_PARTS),
    *declare_reals("a", "d", "ca", "sa", "c", "s", "cp", "sp", "way"),
)

_KINDS: Final = {False: "revolute", True: "prismatic"}
"""Names of the kinds of a joint, by whether it slides."""

_POSITION: Final = {False: "angle", True: "way"}
"""Symbol of the joint's position."""


def _turning_obligation(code: ModuleSource) -> TheoremObligation:
    claims = [f"(= grown.{part}.{axis} next.{part}.{axis})" for part in ("origin", "z") for axis in AXES]
    for axis in AXES:
        x, y = f"next.x.{axis}", f"next.y.{axis}"
        claims.append(f"(= grown.x.{axis} (+ (* cp {x}) (* sp {y})))")
        claims.append(f"(= grown.y.{axis} (- (* cp {y}) (* sp {x})))")
    return TheoremObligation(
        "`child_frame`, where the joint's angle has grown: the frame is turned about its own z by as much,\n"
        "and its origin and its z are what they were.",
        _FRAME,
        smt_and(claims),
        tables=(*_next_frame(code, "next", "angle"), *_next_frame(code, "grown", "grown")),
    )


def _sliding_obligation(code: ModuleSource) -> TheoremObligation:
    claims = [f"(= grown.{part}.{axis} next.{part}.{axis})" for part in "xyz" for axis in AXES]
    claims += [f"(= grown.origin.{axis} (+ next.origin.{axis} (* more next.z.{axis})))" for axis in AXES]
    return TheoremObligation(
        "`child_frame`, where the position of a prismatic joint has grown: the frame is moved along its\n"
        "own z by as much, and its axes are what they were.",
        (*_FRAME, *declare_reals("more")),
        smt_and(claims),
        tables=(
            *_next_frame(code, "next", "way", slides=True),
            *_next_frame(code, "grown", "(+ way more)", slides=True),
        ),
    )


def _carrying_obligation(slides: bool, code: ModuleSource) -> TheoremObligation:
    claims = []
    position = _POSITION[slides]
    for part, axis in product(_PARTS, AXES):
        summands = [f"(* local.{part}.{one} {one}.{axis})" for one in AXES]
        claims.append(
            f"(= next.{part}.{axis} {sum_terms([*summands, *([f'origin.{axis}'] * (part == 'origin'))])})"
        )
    return TheoremObligation(
        f"`child_frame` of any frame and a {_KINDS[slides]} joint is that of the base, carried there: so\n"
        "whatever turns or moves a frame turns and moves all that are further out with it.",
        _FRAME,
        smt_and(claims),
        tables=(
            *_next_frame(code, "next", position, slides=slides),
            *_next_frame(code, "local", position, of_the_base=True, slides=slides),
        ),
    )


def _origin_obligation(slides: bool, code: ModuleSource) -> TheoremObligation:
    frame = {one: vector_terms(f"next.{one}") for one in AXES}
    claims = [
        f"(= {dot(frame[a], frame[b])} {smt_literal(Fraction(int(a == b)))})" for a, b in product(AXES, AXES)
    ]
    claims += [
        f"(= {one} {other})" for one, other in zip(frame["z"], cross(frame["x"], frame["y"]), strict=True)
    ]
    return TheoremObligation(
        f"The axes of a frame, as `child_frame` makes it of the base's and a {_KINDS[slides]} joint, are\n"
        "perpendicular, of length one, and right-handed.",
        _FRAME,
        smt_and(claims),
        tables=tuple(_next_frame(code, "next", _POSITION[slides], of_the_base=True, slides=slides)),
        assumptions={"alpha": "(= (+ (* ca ca) (* sa sa)) 1.0)", "angle": "(= (+ (* c c) (* s s)) 1.0)"},
    )


def _point_velocity(_: ModuleSource) -> TheoremObligation:
    """In the coordinates of the joint's frame, where the point is at (x, y, z)."""
    return TheoremObligation(
        "A point that is turned by an angle moves by no more than its distance from the axis times that;\n"
        "said of squares. Assumed of the cosine: 1 - cos p <= p^2/2.",
        declare_reals("x", "y", "p", "cp", "sp"),
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


def _rotation_preserves_length(_: ModuleSource) -> TheoremObligation:
    """So a derivative by a joint further in, which turns what it is the derivative of, lengthens nothing.

    A prismatic joint further in turns nothing, so that a derivative by it of another derivative is 0.
    """
    crossed = cross(vector_terms("z"), vector_terms("v"))
    return TheoremObligation(
        "The product of an axis with a vector is no longer than the vector; said of squares.",
        declare_vectors("z", "v"),
        f"(<= {dot(crossed, crossed)} {dot(vector_terms('v'), vector_terms('v'))})",
        assumptions={"an-axis": f"(= {dot(vector_terms('z'), vector_terms('z'))} 1.0)"},
        logic=POLYNOMIALS,
    )


def _cauchy_schwarz(_: ModuleSource) -> TheoremObligation:
    uv, uu, vv = (dot(vector_terms(a), vector_terms(b)) for a, b in (("u", "v"), ("u", "u"), ("v", "v")))
    crossed = cross(vector_terms("u"), vector_terms("v"))
    return TheoremObligation(
        "The scalar product of two vectors is no larger than the product of their lengths: the squares of\n"
        "these differ by the square of the vector product.",
        declare_vectors("u", "v"),
        f"(= (- (* {uu} {vv}) (* {uv} {uv})) {dot(crossed, crossed)})",
    )


def _triangle_inequality(_: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "The sum of two vectors is no longer than both together.",
        declare_reals("u.long", "v.long", "u.v", "long"),
        "(<= long (+ u.long v.long))",
        assumptions={
            "lengths": "(and (<= 0.0 u.long) (<= 0.0 v.long) (<= 0.0 long))",
            "sum": "(= (* long long) (+ (* u.long u.long) (* 2.0 u.v) (* v.long v.long)))",
            "cauchy": "(<= u.v (* u.long v.long))",
        },
        logic=POLYNOMIALS,
    )


# A chain of joints.

POINTS: Final = (
    *(line for joint in JOINTS for line in declare_vectors(f"o{joint}", f"z{joint}")),
    *declare_vectors("p"),
)
"""The origin and the axis of each joint, and a point that all of them move."""


KIND_CHOICES: Final = tuple(product((False, True), repeat=len(JOINTS)))
"""Of each joint, True if it is prismatic: every choice."""


def letters_of(slides: tuple[bool, ...]) -> str:
    """Write a choice as a letter for each joint: `r` for revolute, `p` for prismatic."""
    return "".join("p" if one else "r" for one in slides)


CHAIN: Final = ("(declare-fun norm (Real Real Real) Real)", *POINTS)
"""The same, and lengths."""


def _lever_arm(joint: int) -> tuple[str, ...]:
    """The axis of a revolute joint crossed with the vector from it to the point."""
    return cross(vector_terms(f"z{joint}"), minus(vector_terms("p"), vector_terms(f"o{joint}")))


def derivative_terms(joint: int, slides: bool) -> tuple[str, ...]:
    """Velocity of the point per joint rate, by the kind of the joint; of a prismatic one its axis."""
    return vector_terms(f"z{joint}") if slides else _lever_arm(joint)


def axis_distance(joint: int) -> str:
    """Distance of the point from the axis of that joint, in the posture."""
    return f"(norm {' '.join(_lever_arm(joint))})"


def symbolic_posture(links: ModuleType, ask: DecideBranch, slides: tuple[bool, ...]) -> Any:
    """Any posture of the chain, whose joints have these kinds."""
    posture = object.__new__(links.ForwardKinematics)
    symbolic: Any = JointFrame
    posture.slides = slides
    posture.frames = [ORIGIN] + [
        symbolic(symbolic_vector(ask, f"o{joint}"), None, None, symbolic_vector(ask, f"z{joint}"))
        for joint in JOINTS
    ]
    return posture


def chain_module(code: ModuleSource) -> ModuleType:
    """A copy of `kinematic_bounds.py` that computes with symbols."""
    return code.module(KINEMATICS, hypot=hypot_stub)


def hypot_stub(x: Any, y: Any, z: Any) -> SymbolicReal:
    """Stands for `hypot`."""
    return norm_stub(x.ask, x, y, z)


REACH_DECLARATIONS: Final = (
    *declare_reals(*(f"width.{joint}" for joint in JOINTS)),
    *declare_reals(*(f"{what}.{joint}" for joint in (*JOINTS, len(JOINTS)) for what in ("far", "moved"))),
)
"""While the joints are within their widths: how far the point gets from each axis by what the joints beyond
do, or one for a prismatic joint; and how far it is moved by each joint and those beyond it."""


def _reach_assumptions(slides: tuple[bool, ...]) -> dict[str, str]:
    """Assume the geometric facts about a joint and the point."""
    given = {"nothing-beyond": f"(= moved.{len(JOINTS)} 0.0)"}
    for joint in JOINTS:
        given[f"width.{joint}"] = f"(<= 0.0 width.{joint})"
        # By `triangle` and `turned-is-no-longer`: no further from the axis than it is moved towards it.
        far = "1.0" if slides[joint] else f"(+ {axis_distance(joint)} moved.{joint + 1})"
        given[f"far.{joint}"] = f"(<= 0.0 far.{joint} {far})"
        # By `moves` or `slides`, and `triangle`.
        given[f"moved.{joint}"] = f"(<= moved.{joint} (+ moved.{joint + 1} (* width.{joint} far.{joint})))"
    return given


def reach_terms(joint: int, slides: tuple[bool, ...], suffix: str = "") -> str:
    """Bound of the point's distance from an axis, from those of the axes beyond; one if it is prismatic."""
    beyond = (f"(* width.{other} reach{suffix}.{other})" for other in JOINTS if other > joint)
    return "1.0" if slides[joint] else sum_terms((axis_distance(joint), *beyond))


def _reach_grows(_: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "A product grows with its factors, where the other is not negative.",
        declare_reals("factor", "one", "other"),
        "(<= (* factor one) (* factor other))",
        assumptions={"factor": "(<= 0.0 factor)", "order": "(<= one other)"},
    )


def _spread(slides: tuple[bool, ...], code: ModuleSource) -> TheoremObligation:
    links = chain_module(code)

    def run(ask: DecideBranch, joint: int | None) -> str:
        width = [SymbolicReal(f"width.{joint}", ask) for joint in JOINTS]
        most, reaches = symbolic_posture(links, ask, slides).displacement_bound(
            len(JOINTS), symbolic_vector(ask, "p"), width
        )
        return term_of(most if joint is None else reaches[joint])

    reaches = [
        SymbolicFunction(f"reach.{joint}", "Real", execute_symbolically(partial(run, joint=joint)))
        for joint in JOINTS
    ]
    monotone = {
        f"product.{joint}": f"(=> (<= far.{joint} reach.{joint})"
        f" (<= (* width.{joint} far.{joint}) (* width.{joint} reach.{joint})))"
        for joint in JOINTS
    }
    return TheoremObligation(
        "`ForwardKinematics.displacement_bound` bounds how far a point gets from each axis, and from where\n"
        f"it is, while the joints are within their widths: of joints {letters_of(slides)}, revolute (r) and\n"
        "prismatic (p).",
        (*CHAIN, *REACH_DECLARATIONS),
        smt_and(
            (
                *(f"(<= far.{joint} reach.{joint})" for joint in JOINTS),
                *(f"(= reach.{joint} {reach_terms(joint, slides)})" for joint in JOINTS),
                "(<= moved.0 total)",
            )
        ),
        tables=(*reaches, SymbolicFunction("total", "Real", execute_symbolically(partial(run, joint=None)))),
        assumptions={**_reach_assumptions(slides), **monotone},
    )


def link_obligations() -> dict[str, Callable[[ModuleSource], TheoremObligation]]:
    """The geometry of one joint."""
    return {
        "turns": _turning_obligation,
        "slides": _sliding_obligation,
        "carries": partial(_carrying_obligation, False),
        "carries-sliding": partial(_carrying_obligation, True),
        "stands": partial(_origin_obligation, False),
        "stands-sliding": partial(_origin_obligation, True),
        "moves": _point_velocity,
        "turned-is-no-longer": _rotation_preserves_length,
        "cauchy": _cauchy_schwarz,
        "triangle": _triangle_inequality,
        "grows": _reach_grows,
        **{
            f"spread-{letters_of(slides)}" if any(slides) else "spread": partial(_spread, slides)
            for slides in KIND_CHOICES
        },
    }
