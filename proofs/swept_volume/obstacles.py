"""An obstacle is checked as a barrier, or as a link that stands with the foot: of theorem 14."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, Final

from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.smtlib import smt_and, smt_apply
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically, term_of
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation
from proofs.lib.symbolic_reals import AXES, SymbolicReal, declare_reals, declare_vectors, symbolic_vector

OBSTACLES: Final = "aeros.runtime.motion.obstacle_contact"


def _hull_obligation(code: ModuleSource) -> TheoremObligation:
    """Any one corner, by the sides that it is on."""
    module = code.module(OBSTACLES)

    def run(ask: DecideBranch) -> str:
        box = SimpleNamespace(
            name="box", lower=symbolic_vector(ask, "lower"), upper=symbolic_vector(ask, "upper")
        )
        hull = module.obstacle_hull(box, symbolic_vector(ask, "base"))
        if (hull.link, hull.joint, hull.radius, len(hull.corners)) != ("box", 0, 0.0, 8):
            raise ValueError(hull)
        number = sum(place for place, x in zip((4, 2, 1), AXES, strict=True) if ask(f"high.{x}"))
        return smt_apply("point", *map(term_of, hull.corners[number]))

    return TheoremObligation(
        "The hull of an obstacle has all corners of its box, in the frame of a base that stands: so the box\n"
        "is their convex hull (`box`, `between`). It moves with no joint.",
        (
            "(declare-datatypes ((Point 0)) (((point (at.x Real) (at.y Real) (at.z Real)))))",
            *declare_vectors("lower", "upper", "base"),
            *(f"(declare-const high.{x} Bool)" for x in AXES),
        ),
        smt_and(f"(= (at.{x} corner) (- (ite high.{x} upper.{x} lower.{x}) base.{x}))" for x in AXES),
        tables=(SymbolicFunction("corner", "Point", execute_symbolically(run)),),
    )


def _contact_obligation(code: ModuleSource) -> TheoremObligation:
    """Of two obstacles, which stand for any number."""
    module = code.module(OBSTACLES)

    def run(ask: DecideBranch) -> str:
        links = ("link",) if ask("has-hulls") else ()
        held = "held" if ask("holds") else None

        def breach(moving: Any, boxes: Any, room: Any) -> Any:
            if boxes != ["barrier this", "barrier that"]:
                raise ValueError(boxes)
            return None if ask(f"(balls-clear {term_of(room)})") else "breach"

        def contact(compared: Any, room: Any) -> Any:
            if compared != (links, "left" if held else None, ["hull this", "hull that"]):
                raise ValueError(compared)
            is_clear = ask(f"(hulls-clear {term_of(room)})")
            return None if is_clear else SimpleNamespace(inner="this", outer="link", path_parameter=0.0)

        vars(module).update(
            find_breach=breach,
            find_link_contact=contact,
            as_barrier=lambda one: f"barrier {one}",
            obstacle_hull=lambda one, _: f"hull {one}",
            trim_held_space=lambda *_: "left",
            _against=lambda _, *compared: compared,
        )
        moving = SimpleNamespace(
            body=SimpleNamespace(hulls=links), held=held, base=None, base_path=(ask("drives"),)
        )
        room = SymbolicReal("clearance", ask)
        found = module.find_obstacle_contact(moving, ("this", "that"), room)
        return "true" if found is None else "false"

    return TheoremObligation(
        "`find_obstacle_contact` finds nothing only where the balls are clear of every obstacle (`breach`),\n"
        "or the base stands and the hulls of the links are (`contact`), with the whole clearance.",
        (
            *declare_reals("clearance"),
            "(declare-fun balls-clear (Real) Bool)",
            "(declare-fun hulls-clear (Real) Bool)",
            *(f"(declare-const {one} Bool)" for one in ("has-hulls", "holds", "drives")),
        ),
        "(=> nothing (or (balls-clear clearance) (and has-hulls (not drives) (hulls-clear clearance))))",
        tables=(SymbolicFunction("nothing", "Bool", execute_symbolically(run)),),
    )


def obstacle_obligations() -> dict[str, Callable[[ModuleSource], TheoremObligation]]:
    """Of what pictures show."""
    return {"obstacle": _hull_obligation, "obstacles": _contact_obligation}
