"""A motion that the search calls clear of a box is clear of it: the rest of theorem 14's sweep."""

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
    SIZE,
    SymbolicReal,
    declare_reals,
    declare_vectors,
    max_stub,
    min_stub,
    symbolic_vector,
    vector_terms,
)
from proofs.swept_volume.ball_enclosures import SWEEP

# A box that what is swept is to be kept out of, or inside of.


class _SquareRoot:
    """A square root; what is compared with it is not negative."""

    def __init__(self, square: Any) -> None:
        self._square = square

    def __ge__(self, other: Any) -> Any:
        return other * other <= self._square


def _clear_obligation(which: str, code: ModuleSource) -> TheoremObligation:
    """An induction over halvings of the way: `kept` is what the code says of a part of it."""
    inside = which == "inside"
    sweep = code.module(SWEEP)
    clear = sweep.is_clear
    gaps: dict[str, str] = {}

    def run(ask: DecideBranch) -> str:
        def gap(*values: Any) -> Any:
            found = max_stub(*values)
            if len(values) == 3:
                gaps[found.term] = values[0].term.partition("lower.")[2][0]
            return found

        def kept(_: Any, start: Any, edges: Any, way: Any, room: Any) -> bool:
            whole = [one.term for one in edges] == list(vector_terms("edge")) and room.term == "room"
            parts = " ".join(map(term_of, (*start, *way)))
            return whole and ask(f"(kept {parts})")

        stubs = {
            "max": gap,
            "min": min_stub,
            "sqrt": _SquareRoot,
            "norm": lambda way: length(*way),
            "is_clear": kept,
        }

        def length(*parts: Any) -> Any:
            return SymbolicReal(f"(norm {' '.join(map(term_of, parts))})", ask)

        vars(sweep).update(stubs)
        box = SimpleNamespace(
            lower=symbolic_vector(ask, "lower"), upper=symbolic_vector(ask, "upper"), keep_inside=inside
        )
        given = (symbolic_vector(ask, name) for name in ("p", "edge", "way"))
        return "true" if clear(box, *given, SymbolicReal("room", ask)) else "false"

    answer = SymbolicFunction("said", "Bool", execute_symbolically(run))
    if inside:
        claim = smt_and(f"(<= (+ lower.{x} room) at.{x} (- upper.{x} room))" for x in AXES)
    else:
        claim = f"(<= (* room room) (+ {' '.join(f'(* from.{x} from.{x})' for x in AXES)}))"
    half, middle = (
        [f"({form.format(x)})" for x in AXES] for form in ("/ way.{0} 2.0", "+ p.{0} (/ way.{0} 2.0)")
    )
    first = f"(kept {' '.join((*vector_terms('p'), *half))})"
    second = f"(kept {' '.join((*middle, *half))})"

    def between(low: str, high: str) -> str:
        return smt_and(
            f"(or (<= {one} gone.{x} {other}) (<= {other} gone.{x} {one}))"
            for x in AXES
            for one, other in ((low.format(x), high.format(x)),)
        )

    in_first, in_second = between("0.0", "(/ way.{0} 2.0)"), between("(/ way.{0} 2.0)", "way.{0}")
    return TheoremObligation(
        f"Where `is_clear` says so, whatever is in a box of these edges, anywhere on its way, keeps its room "
        f"{'inside' if inside else 'from'}\nwhat {'it is to stay in' if inside else 'it is to keep out of'}.",
        (
            SIZE,
            "(declare-fun norm (Real Real Real) Real)",
            "(declare-fun kept (Real Real Real Real Real Real) Bool)",
            *declare_vectors("lower", "upper", "p", "edge", "way", "gone", "beside", "in"),
            *declare_reals("room"),
            *(f"(define-fun at.{x} () Real (+ p.{x} gone.{x} beside.{x}))" for x in AXES),
            *(f"(define-fun from.{x} () Real (size (- at.{x} in.{x})))" for x in AXES),
        ),
        f"(=> said {claim})",
        tables=(answer,),
        assumptions={
            "room": "(<= 0.0 room)",
            **{f"edge.{x}": f"(<= (size beside.{x}) edge.{x})" for x in AXES},
            **{f"in-the-box.{x}": f"(<= lower.{x} in.{x} upper.{x})" for x in AXES},
            "on-the-way": f"(or {in_first} {in_second})",
            "first-half": smt_implies(smt_and((first, in_first)), claim),
            "second-half": smt_implies(smt_and((second, in_second)), claim),
            **{
                f"squares.{number}": f"(=> (<= 0.0 {gap} from.{x})"
                f" (<= (* {gap} {gap}) (* from.{x} from.{x})))"
                for number, (gap, x) in enumerate(gaps.items())
            },
            **(
                {}
                if inside
                else {
                    f"square.{x}": f"(=> (<= room from.{x}) (<= (* room room) (* from.{x} from.{x})))"
                    for x in AXES
                }
            ),
            **{f"real.{x}": f"(<= 0.0 (* from.{x} from.{x}))" for x in AXES},
        },
    )


# The whole motion, stretch by stretch.

_NEXT: Final = {("piece",): (("piece.0",), ("piece.1",)), ("one", "other"): (("one",), ("other",))}
"""Paths of one piece and of two, and what they are divided into; more pieces are divided as two are."""


def _search(pieces: tuple[str, ...], code: ModuleSource) -> TheoremObligation:
    """An induction over the stretches that are searched: `safe` is what is said of a part of one."""
    sweep = code.module(SWEEP)

    def run(ask: DecideBranch) -> str:
        ball = SimpleNamespace(link="link")
        box = SimpleNamespace(id="box", is_in_base_frame=ask("in-base"))
        pairs: Any = [(ball, [box])]

        def safe(path: Any, low: Any, high: Any, left: Any, _: Any) -> Any:
            if [(ball, [*boxes]) for ball, boxes in left] != pairs:
                raise ValueError(left)
            return None if ask(f"(safe {'-'.join(path)} {term_of(low)} {term_of(high)})") else "breach"

        def clear(_: Any, start: Any, edges: Any, way: Any, room: Any) -> bool:
            return edges == "edges" and ask(f"(clear {' '.join(map(term_of, (*start, *way, room)))})")

        found = (symbolic_vector(ask, "p"), "edges", SymbolicReal("radius", ask))
        vars(sweep).update(
            is_clear=clear,
            ball_enclosures=lambda _, path, __, balls: (
                [found] if (tuple(path), balls) == (pieces, [ball]) else []
            ),
            split_in_half=lambda piece: (f"{piece}.0", f"{piece}.1"),
        )
        moving = SimpleNamespace(
            body=None,
            joint_tolerance=(),
            base=symbolic_vector(ask, "base"),
            base_path=symbolic_vector(ask, "way"),
            is_synchronous=ask("in-step"),
        )
        searched = sweep._SweepSearch(moving, SymbolicReal("clearance", ask))
        searched.search = safe
        low, high = (_PathParameter(name, ask) for name in ("low", "high"))
        breach: Any = sweep._SweepSearch.search(
            searched, list(pieces), low, high, pairs, _SubdivisionDepth(ask)
        )
        return "true" if breach is None else "false"

    start = [f"(ite in-base p.{x} (+ p.{x} base.{x} (ite in-step (times low way.{x}) 0.0)))" for x in AXES]
    way = [f"(ite in-base 0.0 (ite in-step (times (- high low) way.{x}) way.{x}))" for x in AXES]
    first, second = ("-".join(part) for part in _NEXT[pieces])
    return TheoremObligation(
        "`_SweepSearch.search` of a stretch finds nothing only where a ball is clear of a volume on all of\n"
        "the way that the base may be on meanwhile, or nothing is found on either half of the stretch.",
        (
            "(declare-datatypes ((Path 0)) (((piece.0) (piece.1) (one) (other))))",
            "(declare-fun safe (Path Real Real) Bool)",
            "(declare-fun times (Real Real) Real)",
            "(declare-fun clear (Real Real Real Real Real Real Real) Bool)",
            *declare_vectors("p", "base", "way"),
            *declare_reals("low", "high", "radius", "clearance"),
            *(f"(declare-const {name} Bool)" for name in ("in-step", "in-base", "is-deepest")),
        ),
        f"(=> nothing (or (clear {' '.join((*start, *way))} (+ radius clearance))"
        f" (and (safe {first} low (/ (+ low high) 2.0)) (safe {second} (/ (+ low high) 2.0) high))))",
        tables=(SymbolicFunction("nothing", "Bool", execute_symbolically(run)),),
    )


class _PathParameter(SymbolicReal):
    """A place on the path; what is multiplied by it stays a product."""

    __slots__ = ()

    def _apply(self, operator: str, *parts: Any) -> SymbolicReal:
        several = all(isinstance(one, SymbolicReal) for one in parts)
        made = SymbolicReal._apply(self, "times" if operator == "*" and several else operator, *parts)
        return _PathParameter(made.term, made.ask)


class _SubdivisionDepth:
    """Symbolic number of times that a piece has been halved."""

    def __init__(self, ask: DecideBranch) -> None:
        self._ask = ask

    def __eq__(self, _: object) -> bool:
        return self._ask("is-deepest")

    def __add__(self, _: int) -> _SubdivisionDepth:
        return self

    __hash__ = None  # type: ignore[assignment]


def _breach_obligation(code: ModuleSource) -> TheoremObligation:
    """Of two balls, volumes and paths, which stand for any number; `safe` depends on the room kept."""
    sweep = code.module(SWEEP)
    balls, boxes, paths = ("here", "there", "held"), ("first", "second"), ("one", "other")
    rooms: set[str] = set()

    def run(ask: DecideBranch) -> str:
        def searching(_: Any, clearance: Any) -> Any:
            def search(path: str, low: float, high: float, pairs: Any, depth: int) -> Any:
                if (low, high, depth) != (0.0, 1.0, 0):
                    raise ValueError(low, high, depth)
                room = term_of(clearance)
                rooms.add(room)
                several = [(ball.link, box.id) for ball, heeded in pairs for box in heeded]
                kept = all(ask(f"(safe.{path}.{one}.{other} {room})") for one, other in several)
                return None if kept else "breach"

            return SimpleNamespace(search=search)

        vars(sweep).update(_SweepSearch=searching)
        here, there, held = (SimpleNamespace(link=one) for one in balls)
        body = SimpleNamespace(balls=[here, there])
        moving = SimpleNamespace(body=body, held=held if ask("holds") else None, paths=paths)

        class Links:
            """The links that heed a volume."""

            def __init__(self, box: str) -> None:
                self._box = box

            def __contains__(self, link: str) -> bool:
                return ask(f"heeds.{self._box}.{link}")

        given = [
            SimpleNamespace(id=box, links=None if ask(f"everyone-heeds.{box}") else Links(box))
            for box in boxes
        ]
        clearance = SymbolicReal("clearance", ask)
        return "true" if sweep.find_breach(moving, given, clearance) is None else "false"

    each = list(product(paths, balls, boxes))
    table = SymbolicFunction("nothing", "Bool", execute_symbolically(run))
    return TheoremObligation(
        "`find_breach` finds nothing only where the search finds nothing on any path, of any ball or held\n"
        "object and any volume that it heeds, with the whole clearance as room.",
        (
            *declare_reals("clearance"),
            "(declare-const holds Bool)",
            *(f"(declare-fun safe.{path}.{ball}.{box} (Real) Bool)" for path, ball, box in each),
            *(f"(declare-const heeds.{box}.{ball} Bool)" for ball, box in product(balls, boxes)),
            *(f"(declare-const everyone-heeds.{box} Bool)" for box in boxes),
        ),
        smt_implies(
            "nothing",
            smt_and(
                f"(=> (and {'holds' if ball == 'held' else 'true'}"
                f" (or everyone-heeds.{box} heeds.{box}.{ball}))"
                f" (safe.{path}.{ball}.{box} clearance))"
                for path, ball, box in each
            ),
        ),
        tables=(table,),
        assumptions={
            f"more-room.{number}.{path}.{ball}.{box}": f"(=> (and (<= clearance {room})"
            f" (safe.{path}.{ball}.{box} {room})) (safe.{path}.{ball}.{box} clearance))"
            for number, room in enumerate(sorted(rooms))
            for path, ball, box in each
        },
    )


def search_obligations() -> dict[str, Callable[[ModuleSource], TheoremObligation]]:
    """Of the whole motion, where the enclosures of each stretch are known."""
    return {
        "search": partial(_search, ("piece",)),
        "search-of-two": partial(_search, ("one", "other")),
        "breach": _breach_obligation,
        **{f"clear-{which}": partial(_clear_obligation, which) for which in ("inside", "outside")},
    }
