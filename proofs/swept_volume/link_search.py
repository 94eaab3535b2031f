"""Links that the search calls apart are apart: hulls, directions, and stretches of path, for theorem 14."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import product
from types import SimpleNamespace
from typing import Any, Final

from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.smtlib import smt_and, smt_implies
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically, term_of
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation
from proofs.lib.symbolic_reals import (
    AXES,
    POLYNOMIALS,
    SIZE,
    SymbolicReal,
    declare_reals,
    declare_vectors,
    dot,
    max_stub,
    min_stub,
    minus,
    symbolic_vector,
    vector_terms,
)
from proofs.swept_volume.ball_enclosures import LINKS, SWEEP

_CORNERS: Final = ("one", "other")
"""Corners of a hull; two stand for any number."""


def _enclosure(sweep: Any, ask: DecideBranch, name: str) -> Any:
    centre, edges = (symbolic_vector(ask, f"{part}.{name}") for part in ("centre", "edge"))
    return sweep.Enclosure(centre, edges, SymbolicReal(f"radius.{name}", ask))


def _box_obligation(code: ModuleSource) -> TheoremObligation:
    sweep = code.module(SWEEP)

    def run(ask: DecideBranch, part: str, axis: int) -> str:
        vars(sweep).update(min=min_stub, max=max_stub)
        found = sweep.enclosing_box([_enclosure(sweep, ask, name) for name in _CORNERS])
        return term_of(found.radius if part == "radius" else getattr(found, part)[axis])

    parts = [("radius", 0), *product(("centre", "edges"), range(3))]
    names = {(part, axis): "radius" if part == "radius" else f"{part}.{AXES[axis]}" for part, axis in parts}
    return TheoremObligation(
        "`enclosing_box` is a box around the boxes of all enclosures, so around the convex hull of points\n"
        "in them, and has the greatest of their radii.",
        (
            SIZE,
            *declare_reals(*(f"radius.{name}" for name in _CORNERS)),
            *declare_vectors(
                *(f"{part}.{name}" for part in ("centre", "edge", "beside") for name in _CORNERS)
            ),
        ),
        smt_and(
            (
                *(f"(<= radius.{name} found.radius)" for name in _CORNERS),
                *(
                    f"(<= (size (- (+ centre.{name}.{x} beside.{name}.{x}) found.centre.{x}))"
                    f" found.edges.{x})"
                    for name in _CORNERS
                    for x in AXES
                ),
            )
        ),
        tables=tuple(
            SymbolicFunction(
                f"found.{name}", "Real", execute_symbolically(partial(run, part=part, axis=axis))
            )
            for (part, axis), name in names.items()
        ),
        assumptions={
            f"in-the-box.{name}.{x}": f"(<= (size beside.{name}.{x}) edge.{name}.{x})"
            for name in _CORNERS
            for x in AXES
        },
    )


def _separation_obligation(code: ModuleSource) -> TheoremObligation:
    """Products with the direction are symbols; the lemmas about them are `cauchy` and those of one axis."""
    module = code.module(LINKS)

    def run(ask: DecideBranch) -> str:
        vars(module).update(
            min=min_stub,
            max=max_stub,
            abs=lambda one: SymbolicReal(f"(size {one.term})", ask),
            norm=lambda _: SymbolicReal("length", ask),
        )
        inner = [symbolic_vector(ask, f"still.{name}") for name in _CORNERS]
        outer = [_enclosure(module, ask, name) for name in _CORNERS]
        return term_of(module.separation(inner, outer, symbolic_vector(ask, "n")))

    n = vector_terms("n")
    place = {
        name: [f"(+ centre.{name}.{x} beside.{name}.{x} away.{name}.{x})" for x in AXES] for name in _CORNERS
    }
    return TheoremObligation(
        "`separation` is at most the direction times the difference of any outer and any inner corner, each\n"
        "outer one anywhere in its enclosure.",
        (
            SIZE,
            *declare_reals("length", *(f"radius.{name}" for name in _CORNERS)),
            *declare_vectors(
                "n",
                *(f"still.{name}" for name in _CORNERS),
                *(f"{part}.{name}" for part in ("centre", "edge", "beside", "away") for name in _CORNERS),
            ),
        ),
        smt_and(
            f"(<= found {dot(n, minus(tuple(place[a]), vector_terms(f'still.{b}')))})"
            for a, b in product(_CORNERS, repeat=2)
        ),
        tables=(SymbolicFunction("found", "Real", execute_symbolically(run)),),
        assumptions={
            **{
                f"beside.{name}.{x}": f"(<= (- (* (size n.{x}) edge.{name}.{x})) (* n.{x} beside.{name}.{x}))"
                for name in _CORNERS
                for x in AXES
            },
            **{
                f"away.{name}": f"(<= (- (* length radius.{name})) {dot(n, vector_terms(f'away.{name}'))})"
                for name in _CORNERS
            },
        },
        logic=POLYNOMIALS,
    )


def _product_obligation(_: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "A product is no less than minus the product of the sizes of its factors.",
        (SIZE, *declare_reals("n", "beside", "edge")),
        "(<= (- (* (size n) edge)) (* n beside))",
        assumptions={"in-the-box": "(<= (size beside) edge)"},
        logic=POLYNOMIALS,
    )


def _apart_obligation(_: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "Points whose difference along a direction is at least `reach` times its length are that far apart.",
        declare_reals("length", "distance", "reach", "along"),
        "(<= reach distance)",
        assumptions={
            "direction": "(< 0.0 length)",
            "found": "(<= (* reach length) along)",
            "cauchy": "(<= along (* length distance))",
        },
        logic=POLYNOMIALS,
    )


def _gap_obligation(code: ModuleSource) -> TheoremObligation:
    """Of a pair's balls and hulls, with the search of a direction put aside."""
    module = code.module(LINKS)
    reaches: dict[str, set[str]] = {"balls": set(), "hulls": set()}

    def run(ask: DecideBranch) -> str:
        def hull(kind: str, side: str, joint: int) -> Any:
            radius = SymbolicReal(f"radius.{kind}.{side}", ask)
            return SimpleNamespace(link=side, kind=kind, joint=joint, radius=radius, corners=(side,))

        def search(inner: Any, outer: Any, reach: Any) -> Any:
            (still, kind, joint), (moved, same, outer_joint, standing) = inner, outer
            if (still, moved, kind, joint, outer_joint, standing) != ("inner", "outer", same, 1, 3, 1):
                raise ValueError(inner, outer)
            reaches[kind].add(term_of(reach))
            apart = ask(f"(apart.{kind} {term_of(reach)})")
            return module.Separation("direction" if apart else None, SymbolicReal("distance", ask))

        vars(module).update(search_separation=search, max=max_stub)
        pair = module.HullPair(
            *(hull("hulls", side, joint) for side, joint in (("inner", 1), ("outer", 3))),
            *(hull("balls", side, joint) for side, joint in (("inner", 1), ("outer", 3))),
        )
        near = object.__new__(module.PostureRange)
        vars(near).update(_posture=SimpleNamespace(frames=[None] * 4))
        near._corners = lambda one: (one.link, one.kind, one.joint)
        near._enclosures = lambda one, standing: (one.link, one.kind, one.joint, standing)
        return "true" if near.find_gap(pair, SymbolicReal("room", ask)) is None else "false"

    table = SymbolicFunction("nothing", "Bool", execute_symbolically(run))
    whole = {kind: f"(+ room radius.{kind}.inner radius.{kind}.outer)" for kind in reaches}
    return TheoremObligation(
        "`PostureRange.find_gap` finds no gap only where the balls or the hulls are apart by the room and\n"
        "both radii, while the joints up to the inner link stand.",
        (
            *declare_reals("room", "distance"),
            *declare_reals(*(f"radius.{kind}.{side}" for kind in reaches for side in ("inner", "outer"))),
            *(f"(declare-fun apart.{kind} (Real) Bool)" for kind in reaches),
        ),
        f"(=> nothing (or {' '.join(f'(apart.{kind} {whole[kind]})' for kind in reaches)}))",
        tables=(table,),
        assumptions={
            f"more.{kind}.{number}": f"(=> (and (<= {whole[kind]} {reach}) (apart.{kind} {reach}))"
            f" (apart.{kind} {whole[kind]}))"
            for kind, several in reaches.items()
            for number, reach in enumerate(sorted(several))
        },
    )


def _standing_obligation(code: ModuleSource) -> TheoremObligation:
    """Of three joints, of which the first stands."""
    module = code.module(LINKS)

    def run(ask: DecideBranch, part: str, joint: int) -> str:
        asked: dict[str, Any] = {}

        def terms(half: Any, room: Any, slides: str) -> str:
            asked.update(half=half, room=room)
            return "terms" if slides == "kinds" else "other terms"

        vars(module).update(chord_terms=terms)
        near = object.__new__(module.PostureRange)
        half, room = ([SymbolicReal(f"{name}.{k}", ask) for k in range(3)] for name in ("half", "room"))
        vars(near).update(_half=half, _room=room, _posture=SimpleNamespace(slides="kinds"))
        if near._chord_terms(1) != "terms":
            raise ValueError(asked)
        return term_of(asked[part][joint])

    parts = [*product(("half", "room"), range(3))]
    return TheoremObligation(
        "`PostureRange._chord_terms` has the joints that stand keep their place, and all others their way.",
        declare_reals(*(f"{part}.{joint}" for part, joint in parts)),
        smt_and(f"(= asked.{part}.{joint} {f'{part}.{joint}' if joint else '0.0'})" for part, joint in parts),
        tables=tuple(
            SymbolicFunction(
                f"asked.{part}.{joint}", "Real", execute_symbolically(partial(run, part=part, joint=joint))
            )
            for part, joint in parts
        ),
    )


_NEXT: Final = {("piece",): (("piece.0",), ("piece.1",)), ("one", "other"): (("one",), ("other",))}
"""Paths of one piece and of two, and what they are divided into; more pieces are divided as two are."""


def _search(pieces: tuple[str, ...], code: ModuleSource) -> TheoremObligation:
    """An induction over the stretches that are searched: `safe` is what is said of a part of one."""
    module = code.module(LINKS)

    def run(ask: DecideBranch) -> str:
        pairs: Any = [SimpleNamespace(inner=SimpleNamespace(link="a"), outer=SimpleNamespace(link="b"))]

        def near(body: Any, middle: Any, half: Any, room: Any) -> Any:
            if (body, middle, half) != ("body", "middle", "half"):
                raise ValueError(body, middle, half)
            kept = " ".join(map(term_of, room))
            return SimpleNamespace(
                find_gap=lambda pair, clearance: (
                    None if ask(f"(apart {kept} {term_of(clearance)})") else SymbolicReal("gap", ask)
                )
            )

        def safe(path: Any, low: Any, high: Any, left: Any, _: Any) -> Any:
            if left != pairs:
                raise ValueError(left)
            return None if ask(f"(safe {'-'.join(path)})") else "contact"

        vars(module).update(
            path_chord=lambda path: (
                ("middle", "half", [SymbolicReal("width", ask)]) if tuple(path) == pieces else None
            ),
            PostureRange=near,
            split_in_half=lambda piece: (f"{piece}.0", f"{piece}.1"),
            _MAX_LINK_SUBDIVISIONS=1,
        )
        moving = SimpleNamespace(body="body", joint_tolerance=(SymbolicReal("slack", ask),))
        searched = module._ContactSearch(moving, SymbolicReal("clearance", ask))
        searched.search = safe
        depth = 1 if ask("is-deepest") else 0
        found: Any = module._ContactSearch.search(searched, list(pieces), 0.0, 1.0, pairs, depth)
        return "true" if found is None else "false"

    first, second = ("-".join(part) for part in _NEXT[pieces])
    return TheoremObligation(
        "`_ContactSearch.search` of a stretch finds nothing only where a pair is apart on all of it, with\n"
        "the slack of the joints, or nothing is found on either half of the stretch.",
        (
            "(declare-datatypes ((Path 0)) (((piece.0) (piece.1) (one) (other))))",
            "(declare-fun safe (Path) Bool)",
            "(declare-fun apart (Real Real) Bool)",
            *declare_reals("width", "slack", "clearance", "gap"),
            "(declare-const is-deepest Bool)",
        ),
        f"(=> nothing (or (apart (+ width slack) clearance) (and (safe {first}) (safe {second}))))",
        tables=(SymbolicFunction("nothing", "Bool", execute_symbolically(run)),),
    )


def _contact_obligation(code: ModuleSource) -> TheoremObligation:
    """Of two pairs and two paths, which stand for any number."""
    module = code.module(LINKS)
    pairs, paths = ("these", "those"), ("one", "other")
    rooms: set[str] = set()

    def run(ask: DecideBranch) -> str:
        def searching(_: Any, clearance: Any) -> Any:
            room = term_of(clearance)
            rooms.add(room)

            def search(path: str, low: float, high: float, left: Any, depth: int) -> Any:
                if (low, high, depth) != (0.0, 1.0, 0):
                    raise ValueError(low, high, depth)
                return None if all(ask(f"(safe.{path}.{pair} {room})") for pair in left) else "contact"

            return SimpleNamespace(search=search)

        vars(module).update(
            _ContactSearch=searching,
            hull_pairs=lambda body, held: [*pairs] if (body, held) == ("body", "held") else [],
        )
        moving = SimpleNamespace(body="body", held="held", paths=paths)
        found = module.find_link_contact(moving, SymbolicReal("clearance", ask))
        return "true" if found is None else "false"

    each = list(product(paths, pairs))
    table = SymbolicFunction("nothing", "Bool", execute_symbolically(run))
    return TheoremObligation(
        "`find_link_contact` finds nothing only where the search finds nothing on any path, of any pair of\n"
        "the body's links and of what it holds, with the whole clearance as room.",
        (
            *declare_reals("clearance"),
            *(f"(declare-fun safe.{path}.{pair} (Real) Bool)" for path, pair in each),
        ),
        smt_implies("nothing", smt_and(f"(safe.{path}.{pair} clearance)" for path, pair in each)),
        tables=(table,),
        assumptions={
            f"more-room.{number}.{path}.{pair}": f"(=> (and (<= clearance {room})"
            f" (safe.{path}.{pair} {room})) (safe.{path}.{pair} clearance))"
            for number, room in enumerate(sorted(rooms))
            for path, pair in each
        },
    )


def link_obligations() -> dict[str, Callable[[ModuleSource], TheoremObligation]]:
    """Of pairs of links, and of what is held."""
    return {
        "box": _box_obligation,
        "product": _product_obligation,
        "separation": _separation_obligation,
        "apart": _apart_obligation,
        "gap": _gap_obligation,
        "standing": _standing_obligation,
        "pairs": partial(_search, ("piece",)),
        "pairs-of-two": partial(_search, ("one", "other")),
        "contact": _contact_obligation,
    }
