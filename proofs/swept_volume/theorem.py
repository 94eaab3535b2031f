"""What the sweep calls clear is clear wherever the motion gets: the swept volume of theorem 14."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import product
from types import SimpleNamespace
from typing import Any, Final

from aeros.spec.theorems.exploring import Ask, explore, term_of
from aeros.spec.theorems.formulas import conjunction, implication
from aeros.spec.theorems.shipped import Code, Mutant
from aeros.spec.theorems.theorem import Obligation, Table, Theorem
from proofs import chains
from proofs.reals import (
    AXES,
    LARGER,
    POLYNOMIALS,
    SIZE,
    Real,
    declared,
    declared_vectors,
    largest,
    largest_of,
    smallest,
    symbols,
    total,
    vector,
)

SWEEP: Final = "aeros.runtime.sweep"
BEZIER: Final = "aeros.runtime.bezier"

# Where a point of the body stays while the joints are near a straight way.


class _Way(Real):
    """How far a joint goes; how long that is, is a symbol of its own."""

    __slots__ = ()

    def __abs__(self) -> Real:
        return Real(f"long.{self.term}", self.ask)


_REACH: Final = tuple(
    line
    for joint in reversed(chains.JOINTS)
    for line in (
        f"(define-fun width.{joint} () Real (+ long.d.{joint} r.{joint}))",
        f"(define-fun reach.{joint} () Real {chains.reach_of(joint)})",
    )
)


def _bend() -> str:
    """Half the sum over pairs of joints: what Taylor's theorem leaves, each second derivative bounded."""
    return total(
        f"(* (/ 1 2) width.{i} width.{j} reach.{max(i, j)})" for i, j in product(chains.JOINTS, repeat=2)
    )


def _sweep(code: Code) -> Obligation:
    links = chains.chain_module(code)

    def run(ask: Ask, edge: int | None) -> str:
        chord = [_Way(f"d.{joint}", ask) for joint in chains.JOINTS]
        room = [Real(f"r.{joint}", ask) for joint in chains.JOINTS]
        along = links.along_of(chord, room)
        edges, near = chains.posture_of(links, ask).sweep(len(chains.JOINTS), symbols(ask, "p"), along)
        return term_of(near if edge is None else edges[edge])

    tables = [Table(f"edge.{axis}", "Real", explore(partial(run, edge=at))) for at, axis in enumerate(AXES)]
    tables.append(Table("near", "Real", explore(partial(run, edge=None))))
    slopes = [
        total(f"(* {chains.arm(joint)[at]} d.{joint})" for joint in chains.JOINTS) for at in range(len(AXES))
    ]
    beside = total(f"(* {chains.off(joint)} r.{joint})" for joint in chains.JOINTS)
    return Obligation(
        "`along_of` and `Posture.sweep`: the edges are those of the derivative along the way, and how near\n"
        "the point stays is what the rest can do: first derivatives beside it, and Taylor's remainder.",
        (
            SIZE,
            *chains.CHAIN,
            *declared(*(f"{what}.{joint}" for what in ("d", "r", "long.d") for joint in chains.JOINTS)),
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
    beside = total(f"(* off.{joint} beside.{joint})" for joint in chains.JOINTS)
    room = total(f"(* off.{joint} r.{joint})" for joint in chains.JOINTS)
    return Obligation(
        "Where Taylor's theorem has a point be, is in the box of the derivative along the way or as near to\n"
        "it as `sweep` says: an edge for each coordinate, and a length for the rest.",
        (
            SIZE,
            *declared("share", "bend", "rest", *(f"slope.{axis}" for axis in AXES)),
            *declared(*(f"{what}.{joint}" for what in ("off", "beside", "r") for joint in chains.JOINTS)),
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
                for joint in chains.JOINTS
            },
            **{
                f"grows.{joint}": f"(=> (and (<= 0.0 off.{joint}) (<= beside.{joint} r.{joint}))"
                f" (<= (* off.{joint} beside.{joint}) (* off.{joint} r.{joint})))"
                for joint in chains.JOINTS
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


# A box that what is swept is to be kept out of, or inside of.


class _Root:
    """A square root; what is compared with it is not negative."""

    def __init__(self, square: Any) -> None:
        self._square = square

    def __ge__(self, other: Any) -> Any:
        return other * other <= self._square


def _clear(which: str, code: Code) -> Obligation:
    """An induction over halvings of the way: `kept` is what the code says of a part of it."""
    inside = which == "inside"
    sweep = code.module(SWEEP)
    clear = sweep.clear
    gaps: dict[str, str] = {}

    def run(ask: Ask) -> str:
        def gap(*values: Any) -> Any:
            found = largest(*values)
            if len(values) == 3:
                gaps[found.term] = values[0].term.partition("lower.")[2][0]
            return found

        def kept(_: Any, start: Any, edges: Any, way: Any, room: Any) -> bool:
            whole = [one.term for one in edges] == list(vector("edge")) and room.term == "room"
            parts = " ".join(map(term_of, (*start, *way)))
            return whole and ask(f"(kept {parts})")

        stubs = {"max": gap, "min": smallest, "sqrt": _Root, "norm": lambda way: length(*way), "clear": kept}

        def length(*parts: Any) -> Any:
            return Real(f"(norm {' '.join(map(term_of, parts))})", ask)

        vars(sweep).update(stubs)
        box = SimpleNamespace(lower=symbols(ask, "lower"), upper=symbols(ask, "upper"), inside=inside)
        given = (symbols(ask, name) for name in ("p", "edge", "way"))
        return "true" if clear(box, *given, Real("room", ask)) else "false"

    said = Table("said", "Bool", explore(run))
    if inside:
        claim = conjunction(f"(<= (+ lower.{x} room) at.{x} (- upper.{x} room))" for x in AXES)
    else:
        claim = f"(<= (* room room) (+ {' '.join(f'(* from.{x} from.{x})' for x in AXES)}))"
    half, middle = (
        [f"({form.format(x)})" for x in AXES] for form in ("/ way.{0} 2.0", "+ p.{0} (/ way.{0} 2.0)")
    )
    first = f"(kept {' '.join((*vector('p'), *half))})"
    second = f"(kept {' '.join((*middle, *half))})"

    def between(low: str, high: str) -> str:
        return conjunction(
            f"(or (<= {one} gone.{x} {other}) (<= {other} gone.{x} {one}))"
            for x in AXES
            for one, other in ((low.format(x), high.format(x)),)
        )

    in_first, in_second = between("0.0", "(/ way.{0} 2.0)"), between("(/ way.{0} 2.0)", "way.{0}")
    return Obligation(
        f"Where `clear` says so, whatever is in a box of these edges, anywhere on its way, keeps its room "
        f"{'inside' if inside else 'from'}\nwhat {'it is to stay in' if inside else 'it is to keep out of'}.",
        (
            SIZE,
            "(declare-fun norm (Real Real Real) Real)",
            "(declare-fun kept (Real Real Real Real Real Real) Bool)",
            *declared_vectors("lower", "upper", "p", "edge", "way", "gone", "beside", "in"),
            *declared("room"),
            *(f"(define-fun at.{x} () Real (+ p.{x} gone.{x} beside.{x}))" for x in AXES),
            *(f"(define-fun from.{x} () Real (size (- at.{x} in.{x})))" for x in AXES),
        ),
        f"(=> said {claim})",
        tables=(said,),
        assumptions={
            "room": "(<= 0.0 room)",
            **{f"edge.{x}": f"(<= (size beside.{x}) edge.{x})" for x in AXES},
            **{f"in-the-box.{x}": f"(<= lower.{x} in.{x} upper.{x})" for x in AXES},
            "on-the-way": f"(or {in_first} {in_second})",
            "first-half": implication(conjunction((first, in_first)), claim),
            "second-half": implication(conjunction((second, in_second)), claim),
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


def _search(pieces: tuple[str, ...], code: Code) -> Obligation:
    """An induction over the stretches that are searched: `safe` is what is said of a part of one."""
    sweep = code.module(SWEEP)

    def run(ask: Ask) -> str:
        ball = SimpleNamespace(link="link")
        box = SimpleNamespace(id="box", in_base=ask("in-base"))
        pairs: Any = [(ball, [box])]

        def safe(path: Any, low: Any, high: Any, left: Any, _: Any) -> Any:
            if [(ball, [*boxes]) for ball, boxes in left] != pairs:
                raise ValueError(left)
            return None if ask(f"(safe {'-'.join(path)} {term_of(low)} {term_of(high)})") else "breach"

        def clear(_: Any, start: Any, edges: Any, way: Any, room: Any) -> bool:
            return edges == "edges" and ask(f"(clear {' '.join(map(term_of, (*start, *way, room)))})")

        found = (symbols(ask, "p"), "edges", Real("radius", ask))
        vars(sweep).update(
            clear=clear,
            enclosures=lambda _, path, __, balls: [found] if (tuple(path), balls) == (pieces, [ball]) else [],
            halves=lambda piece: (f"{piece}.0", f"{piece}.1"),
        )
        moving = SimpleNamespace(
            body=None,
            slack=(),
            base=symbols(ask, "base"),
            way=symbols(ask, "way"),
            in_step=ask("in-step"),
        )
        searched = sweep._Sweep(moving, Real("clearance", ask))
        searched.search = safe
        low, high = (_Share(name, ask) for name in ("low", "high"))
        breach: Any = sweep._Sweep.search(searched, list(pieces), low, high, pairs, _Depth(ask))
        return "true" if breach is None else "false"

    start = [f"(ite in-base p.{x} (+ p.{x} base.{x} (ite in-step (times low way.{x}) 0.0)))" for x in AXES]
    way = [f"(ite in-base 0.0 (ite in-step (times (- high low) way.{x}) way.{x}))" for x in AXES]
    first, second = ("-".join(part) for part in _NEXT[pieces])
    return Obligation(
        "`_Sweep.search` of a stretch finds nothing only where a ball is clear of a volume on all of the\n"
        "way that the base may be on meanwhile, or nothing is found on either half of the stretch.",
        (
            "(declare-datatypes ((Path 0)) (((piece.0) (piece.1) (one) (other))))",
            "(declare-fun safe (Path Real Real) Bool)",
            "(declare-fun times (Real Real) Real)",
            "(declare-fun clear (Real Real Real Real Real Real Real) Bool)",
            *declared_vectors("p", "base", "way"),
            *declared("low", "high", "radius", "clearance"),
            *(f"(declare-const {name} Bool)" for name in ("in-step", "in-base", "is-deepest")),
        ),
        f"(=> nothing (or (clear {' '.join((*start, *way))} (+ radius clearance))"
        f" (and (safe {first} low (/ (+ low high) 2.0)) (safe {second} (/ (+ low high) 2.0) high))))",
        tables=(Table("nothing", "Bool", explore(run)),),
    )


class _Share(Real):
    """A place on the path; what is multiplied by it stays a product."""

    __slots__ = ()

    def _with(self, operator: str, *parts: Any) -> Real:
        several = all(isinstance(one, Real) for one in parts)
        made = Real._with(self, "times" if operator == "*" and several else operator, *parts)
        return _Share(made.term, made.ask)


class _Depth:
    """How often a piece has been halved."""

    def __init__(self, ask: Ask) -> None:
        self._ask = ask

    def __eq__(self, _: object) -> bool:
        return self._ask("is-deepest")

    def __add__(self, _: int) -> _Depth:
        return self

    __hash__ = None  # type: ignore[assignment]


def _breach(code: Code) -> Obligation:
    """Of two balls, volumes and paths, which stand for any number."""
    sweep = code.module(SWEEP)
    balls, boxes, paths = ("here", "there"), ("first", "second"), ("one", "other")

    def run(ask: Ask) -> str:
        def searching(_: Any, clearance: Any) -> Any:
            def search(path: str, low: float, high: float, pairs: Any, depth: int) -> Any:
                if (low, high, depth) != (0.0, 1.0, 0) or clearance < 0.0:
                    raise ValueError(low, high, depth)
                several = [(ball.link, box.id) for ball, heeded in pairs for box in heeded]
                return None if all(ask(f"safe.{path}.{one}.{other}") for one, other in several) else "breach"

            return SimpleNamespace(search=search)

        vars(sweep).update(_Sweep=searching)
        moving = SimpleNamespace(
            body=SimpleNamespace(balls=[SimpleNamespace(link=one) for one in balls]), paths=paths
        )

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
        return "true" if sweep.breach_of(moving, given, 0.0) is None else "false"

    each = list(product(paths, balls, boxes))
    return Obligation(
        "`breach_of` finds nothing only where the search finds nothing on any path, of any ball and any\n"
        "volume that its link heeds.",
        (
            *(f"(declare-const safe.{path}.{ball}.{box} Bool)" for path, ball, box in each),
            *(f"(declare-const heeds.{box}.{ball} Bool)" for ball, box in product(balls, boxes)),
            *(f"(declare-const everyone-heeds.{box} Bool)" for box in boxes),
        ),
        implication(
            "nothing",
            conjunction(
                f"(=> (or everyone-heeds.{box} heeds.{box}.{ball}) safe.{path}.{ball}.{box})"
                for path, ball, box in each
            ),
        ),
        tables=(Table("nothing", "Bool", explore(run)),),
    )


_MADE: dict[str, Callable[[Code], Obligation]] = {
    **chains.link_obligations(),
    "sweep": _sweep,
    "stays": _stays,
    "weights": _weights,
    "chord-of-one": partial(_chord, 1),
    "chord-of-two": partial(_chord, 2),
    "mixture": _mixture,
    "between": _between,
    **{f"part-{which}": partial(_parts, which) for which in ("first", "second", "rest")},
    "enclosures": _enclosures,
    "search": partial(_search, ("piece",)),
    "search-of-two": partial(_search, ("one", "other")),
    "breach": _breach,
    **{f"clear-{which}": partial(_clear, which) for which in ("inside", "outside")},
}

THEOREM = Theorem(
    "what the sweep calls clear, no ball of a moving body comes near, wherever on the motion",
    _MADE,
    (
        Mutant(
            "turns-one-axis-the-other-way",
            "turns",
            chains.KINEMATICS,
            "(c * ux - s * xx, c * uy - s * xy, c * uz - s * xz)",
            "(c * ux + s * xx, c * uy + s * xy, c * uz + s * xz)",
        ),
        Mutant(
            "forgets-what-the-joints-beyond-do",
            "spread",
            chains.KINEMATICS,
            "reaches[k] = off + total",
            "reaches[k] = off",
        ),
        Mutant(
            "forgets-that-the-way-bends",
            "sweep",
            chains.KINEMATICS,
            "near += off * r + reach * pairs",
            "near += off * r",
        ),
        Mutant(
            "forgets-what-two-joints-do-together",
            "sweep",
            chains.KINEMATICS,
            "w * (before + w / 2.0)",
            "w * (w / 2.0)",
        ),
        Mutant(
            "looks-at-one-control-point",
            "chord-of-one",
            BEZIER,
            "max(map(abs, away))",
            "abs(away[1])",
        ),
        Mutant(
            "has-the-second-half-begin-late",
            "part-second",
            BEZIER,
            "(whole, bcd, cd, d)\n\n\ndef rest_of",
            "(bcd, bcd, cd, d)\n\n\ndef rest_of",
        ),
        Mutant(
            "forgets-the-slack-of-the-joints",
            "enclosures",
            SWEEP,
            "[w + s for w, s in zip(width, slack, strict=True)]",
            "[w for w, s in zip(width, slack, strict=True)]",
        ),
        Mutant(
            "looks-at-the-start-of-the-way-alone",
            "clear-inside",
            SWEEP,
            "(x - ex, x + wx + ex)",
            "(x - ex, x + ex)",
        ),
        Mutant(
            "looks-at-the-first-half-of-the-way-alone",
            "clear-outside",
            SWEEP,
            "        and clear(box, middle, edges, half, room)\n",
            "",
        ),
        Mutant(
            "searches-the-first-half-alone",
            "search",
            SWEEP,
            " or self.search(second, middle, high, left, depth)",
            "",
        ),
        Mutant(
            "has-the-base-stand-still-where-it-keeps-no-step",
            "search-of-two",
            SWEEP,
            "            return base, way\n",
            "            return base, _NOWHERE\n",
        ),
        Mutant(
            "looks-at-one-path",
            "breach",
            SWEEP,
            "    for path in moving.paths:\n",
            "    for path in moving.paths[:1]:\n",
        ),
    ),
)
