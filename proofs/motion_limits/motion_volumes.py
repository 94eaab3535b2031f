"""Questions that a motion's decision puts to the sweep, explored: barriers, links, obstacles, held ones."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from types import SimpleNamespace
from typing import Any, Final, NamedTuple

from aeros.runtime.motion.trajectory import HELD
from aeros.skill import Action
from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.smtlib import smt_and, smt_implies
from aeros.spec.theorems.symbolic_execution import (
    DecideBranch,
    SymbolicValue,
    execute_symbolically,
    term_of,
)
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation
from proofs.motion_limits.motion_rates import (
    declare_truths,
    is_nothing,
    nothing_obligation,
    put_aside,
    trajectory_module,
)

_BOXES: Final = ("a", "b", "c")


class _Sweep(NamedTuple):
    """A motion in the form that the sweep checks."""

    name: str
    held: object


class _FoundBreach(NamedTuple):
    """A breach that a search found."""

    barrier: str
    link: str
    path_parameter: float = 0.0


def barriers_obligation(code: ModuleSource) -> TheoremObligation:
    """With the searches put aside: `swept_volume` is about these."""
    module = trajectory_module(code)

    def run(ask: DecideBranch) -> str:
        moving = _Sweep("motion", "object" if ask("holds") else None)
        plan = object() if ask("is-single") else None
        boxes = [SimpleNamespace(id=name, is_in_base_frame=False, links=_links(ask, name)) for name in _BOXES]
        barriers = {
            name: SimpleNamespace(volume=f"volume {name if ask(f'{name}.is-surface') else ''}")
            for name in _BOXES
        }

        def check(of: _Sweep, clearance: object) -> str:
            if of.name != "motion" or clearance != "clearance":
                raise ValueError("clearance")
            return "whole" if of.held == moving.held and of.held else "links"

        def find_breach(of: _Sweep, among: Sequence[Any], clearance: object) -> _FoundBreach | None:
            part = check(of, clearance)
            for box in among:
                if ask(f"{box.id}.breaks-links"):
                    return _FoundBreach(box.id, "arm")
                if part == "whole" and ask(f"{box.id}.breaks-held"):
                    return _FoundBreach(box.id, HELD)
            return None

        def find_closely(of: _Sweep, among: Sequence[Any], clearance: object) -> _FoundBreach | None:
            check(of, clearance)
            return next(
                (_FoundBreach(one.id, HELD) for one in among if ask(f"{one.id}.breaks-closely")), None
            )

        def find_surface_breach(
            of: object, swept: _Sweep, among: Sequence[Any], clearance: object, limits: object
        ) -> object:
            check(swept, clearance)
            if of is not plan or limits != ("distance", "speed") or len(among) != 1:
                raise ValueError("limits")
            return "place" if ask(f"{among[0].id}.breaks-surface") else None

        put_aside(
            module,
            find_breach=find_breach,
            _find_breach_closely=find_closely,
            find_surface_breach=find_surface_breach,
            SurfaceLimits=lambda *given: given,
            _barrier_reason=lambda *_: "reason",
            _surface_reason=lambda *_: "reason",
        )
        made = object.__new__(module.MotionDecider)
        made._boxes, made._barriers = boxes, barriers
        surface = SimpleNamespace(
            volumes=frozenset(f"volume {name}" for name in _BOXES), distance="distance", speed="speed"
        )
        kind = SimpleNamespace(surface=surface if ask("names-surface") else None)
        policy = SimpleNamespace(clearance="clearance", kinds={"move": kind, "grip": None})
        return is_nothing(made._breaches(policy, Action("move", {}), plan, moving))

    claims = []
    for x in _BOXES:
        held = f"(and holds {x}.breaks-held)"
        claims.append(f"(ite {x}.is-touched (not {x}.breaks-links) (=> {x}.breaks-links doubtful))")
        claims.append(smt_implies(f"(and {x}.is-touched {x}.concerns-held)", f"(not {x}.breaks-surface)"))
        claims.append(smt_implies(f"(and (not {x}.is-touched) {held})", "doubtful"))
        claims.append(smt_implies(f"(and doubtful (not {x}.is-touched))", f"(not {x}.breaks-closely)"))
    # The held object alone is in doubt if it is the first that is found, before any link.
    doubtful = "false"
    for x in reversed(_BOXES):
        doubtful = (
            f"(ite {x}.is-touched {doubtful} (ite {x}.breaks-links false"
            f" (ite (and holds {x}.breaks-held) true {doubtful})))"
        )
    return nothing_obligation(
        "`_breaches` is empty exactly where, with the site's clearance and for every barrier, neither\n"
        "links nor what is held meet it. Where what is held may, a closer search has to find nothing.\n"
        "Into a surface that the action names, what is held alone may come, and only as near and as\n"
        "slowly as the site says.",
        (
            *declare_truths("holds", "is-single", "names-surface"),
            *declare_truths(
                *(
                    f"{x}.{of}"
                    for x in _BOXES
                    for of in (
                        "is-surface",
                        "breaks-links",
                        "breaks-held",
                        "breaks-closely",
                        "breaks-surface",
                    )
                ),
                *(f"{x}.{of}" for x in _BOXES for of in ("is-of-all", "is-of-held")),
            ),
            *(
                f"(define-fun {x}.is-touched () Bool (and names-surface is-single holds {x}.is-surface))"
                for x in _BOXES
            ),
            *(f"(define-fun {x}.concerns-held () Bool (or {x}.is-of-all {x}.is-of-held))" for x in _BOXES),
            f"(define-fun doubtful () Bool {doubtful})",
        ),
        smt_and(claims),
        run,
        **{f"a-closer-search-finds-links.{x}": f"(=> {x}.breaks-links {x}.breaks-closely)" for x in _BOXES},
    )


def _links(ask: DecideBranch, name: str) -> frozenset[str] | None:
    if ask(f"{name}.is-of-all"):
        return None
    return frozenset((HELD, "arm") if ask(f"{name}.is-of-held") else ("arm",))


def closely_obligation(code: ModuleSource) -> TheoremObligation:
    """With the searches put aside."""
    module = trajectory_module(code)

    def run(ask: DecideBranch) -> str:
        moving = _Sweep("motion", "object")

        def search(of: _Sweep, among: Sequence[Any], clearance: object) -> _FoundBreach | None:
            if of.name != "motion" or clearance != "clearance":
                raise ValueError("clearance")
            for box in among:
                if ask(f"{box.id}.breaks-links") or (of.held and ask(f"{box.id}.breaks-held")):
                    return _FoundBreach(box.id, "arm")
            return None

        def find_held_contact(of: _Sweep, among: Sequence[Any], clearance: object) -> _FoundBreach | None:
            if of != moving or clearance != "clearance":
                raise ValueError("clearance")
            return next(
                (_FoundBreach(one.id, HELD) for one in among if ask(f"{one.id}.breaks-closely")), None
            )

        put_aside(module, find_breach=search, find_held_contact=find_held_contact)
        boxes = [
            SimpleNamespace(
                id=name,
                is_in_base_frame=ask(f"{name}.moves-along"),
                keep_inside=ask(f"{name}.keeps-inside"),
                links=_links(ask, name),
            )
            for name in _BOXES
        ]
        return is_nothing(filter(None, [module._find_breach_closely(moving, boxes, "clearance")]))

    claims = [
        f"(and (not {x}.breaks-links) (ite (and {x}.moves-along (not {x}.keeps-inside))"
        f" (=> (or {x}.is-of-all {x}.is-of-held) (not {x}.breaks-closely)) (not {x}.breaks-held)))"
        for x in _BOXES
    ]
    return nothing_obligation(
        "`_find_breach_closely` finds nothing exactly where no link meets any volume, and what is held\n"
        "none of those of W or to stay inside; with a volume that moves along, it is compared closely, if\n"
        "it concerns it.",
        declare_truths(
            *(
                f"{x}.{of}"
                for x in _BOXES
                for of in ("breaks-links", "breaks-held", "breaks-closely", "moves-along", "keeps-inside")
            ),
            *(f"{x}.{of}" for x in _BOXES for of in ("is-of-all", "is-of-held")),
        ),
        smt_and(claims),
        run,
    )


def contacts_obligation(code: ModuleSource) -> TheoremObligation:
    """Of links with each other, and of obstacles with them and with a base, with the searches put aside."""
    module = trajectory_module(code)

    def run(ask: DecideBranch) -> str:
        def find(name: str, clearance: str) -> Any:
            def found(*given: object) -> Any:
                if given == (at_end, obstacles, clearance):
                    return "there" if ask("ends-there") else None
                searched = travel if name == "base" else moving
                if given != ((searched, clearance) if name == "links" else (searched, obstacles, clearance)):
                    raise ValueError(name)
                contact = SimpleNamespace(
                    outer="hand", inner="arm", distance=0.0, path_parameter=0.0, link="hand", barrier="box"
                )
                return contact if ask(f"{name}.meet") else None

            return found

        def drive(*given: object) -> Any:
            if given != (("corners of", "own"), "start", path):
                raise ValueError("travel")
            return travel

        obstacles = [SimpleNamespace(name="box", camera="eye")]
        path = (1.0,) if ask("base-drives") else (0.0,)
        moving = SimpleNamespace(base="start", base_path=path)
        at_end = "at the end"
        travel = SimpleNamespace(at_end=lambda: at_end)
        put_aside(
            module,
            find_link_contact=find("links", "link clearance"),
            find_obstacle_contact=find("obstacles", "clearance"),
            ends_at_obstacle=lambda *_: ask("ends-there"),
            BaseTravel=drive,
            box_corners=lambda box: ("corners of", box),
            find_base_contact=find("base", "clearance"),
            Reason=lambda *given: given,
        )
        policy = SimpleNamespace(
            link_clearance=_Clearance("link clearance") if ask("keeps-links-apart") else None,
            clearance=_Clearance("clearance"),
            obstacles=SimpleNamespace(base="own" if ask("compares-base") else None)
            if ask("looks-for-obstacles")
            else None,
        )
        links = module._link_contacts(policy, moving)
        return is_nothing([*links, *module._obstacle_contacts(policy, moving, obstacles)])

    return nothing_obligation(
        "`_link_contacts` and `_obstacle_contacts` are empty exactly where the sweep finds no two links\n"
        "within the site's clearance between links, if it has one, and no obstacle within its clearance of\n"
        "a link, or of a base that drives and that the site compares with obstacles.",
        declare_truths(
            *("links.meet", "obstacles.meet", "base.meet", "ends-there", "keeps-links-apart"),
            *("base-drives", "compares-base", "looks-for-obstacles"),
        ),
        "(and (=> keeps-links-apart (not links.meet)) (not obstacles.meet)\n"
        "     (=> (and base-drives compares-base looks-for-obstacles) (not base.meet)))",
        run,
    )


class _Clearance(str):
    """A distance, which a message names in millimetres."""

    def __rmul__(self, _: object) -> float:  # type: ignore[override]
        return 0.0


_AXES: Final = "xyz"


def held_obligation(code: ModuleSource) -> TheoremObligation:
    """Of any box and any tool."""
    module = trajectory_module(code)

    def run(ask: DecideBranch) -> str:

        def vector(name: str) -> tuple[SymbolicValue, ...]:
            return tuple(SymbolicValue(f"{name}.{axis}", ask) for axis in _AXES)

        box = SimpleNamespace(lower=vector("lower"), upper=vector("upper"))
        held = SimpleNamespace(variable="holding", box=box) if ask("site-has-one") else None
        measured = True if ask("holds") else False if ask("holds-not") else "unknown"
        readings = {"holding": SimpleNamespace(value=measured)} if ask("is-measured") else {}
        body = SimpleNamespace(tool_offset=vector("tool"), dh_rows=("1", "2"))
        found = module.held_object(SimpleNamespace(held=held), body, readings)
        if found is None:
            return "none"
        if found.link != HELD or found.joint != 2 or found.radius != 0.0 or len(found.corners) != 8:
            return "wrong"
        corners = {tuple(map(term_of, corner)) for corner in found.corners}
        sides = [[f"(+ tool.{axis} {side}.{axis})" for side in ("lower", "upper")] for axis in _AXES]
        return "box" if corners == set(product(*sides)) else "wrong"

    return TheoremObligation(
        "`held_object` returns none only where the site has none, or where it is measured that nothing is\n"
        "held; else the box of the site around the tool, with each of its eight corners.",
        (
            "(declare-datatypes ((Held 0)) (((none) (box) (wrong))))",
            *declare_truths("site-has-one", "holds", "holds-not", "is-measured"),
        ),
        "(= found (ite (and site-has-one (not (and is-measured (not holds) holds-not))) box none))",
        tables=(SymbolicFunction("found", "Held", execute_symbolically(run, raising="wrong")),),
    )


def policy_obligation(code: ModuleSource) -> TheoremObligation:
    """Of the constructor: the numbers of the policy reach the comparisons, each in its place."""
    module = trajectory_module(code)

    def run(ask: DecideBranch) -> str:
        columns = [tuple(f"{rate} {n}" for n in (1, 2, 3)) for rate in ("speed", "acceleration", "jerk")]
        tool = SimpleNamespace(translation=("ts", "ta", "tj"), rotation=("rs", "ra", "rj"))
        barriers = tuple(
            SimpleNamespace(
                id=name,
                box=SimpleNamespace(
                    lower=tuple(f"l{name}{n}" for n in _AXES), upper=tuple(f"u{name}{n}" for n in _AXES)
                ),
                keep_inside=ask(f"{name}.keeps-inside"),
                is_in_base_frame=ask(f"{name}.moves-along"),
                links=f"links of {name}",
            )
            for name in _BOXES
        )
        policy = SimpleNamespace(
            is_mixed=False,
            lowest=("l1", "l2", "l3"),
            highest=("h1", "h2", "h3"),
            joint_limits=tuple(columns),
            tool_limits=tool,
            barriers=barriers,
            kinds={"move": None},
        )
        made = module.MotionDecider(policy if ask("has-policy") else None)
        if made._policy is None:
            return "covers-none" if not made.covers_kind("move") else "wrong"
        boxes = [
            (one.id, one.box.lower, one.box.upper, one.keep_inside, one.is_in_base_frame, one.links)
            for one in barriers
        ]
        right = (
            (made._lowest, made._highest) == (policy.lowest, policy.highest)
            and [tuple(one) for one in made._joint_rates] == [*zip(*columns, strict=True)]
            and (made._moving, made._turning) == (tool.translation, tool.rotation)
            and [tuple(one) for one in made._boxes] == boxes
            and made._barriers == {one.id: one for one in barriers}
            and (made.covers_kind("move"), made.covers_kind("grip")) == (True, False)
        )
        return "right" if right else "wrong"

    return TheoremObligation(
        "`MotionDecider` compares each joint with its own range and limits, the tool with those of the\n"
        "tool, and every barrier of the site; and covers exactly the site's kinds of motions.",
        (
            "(declare-datatypes ((Policy 0)) (((covers-none) (right) (wrong))))",
            *declare_truths("has-policy"),
            *declare_truths(*(f"{x}.{of}" for x in _BOXES for of in ("keeps-inside", "moves-along"))),
        ),
        "(= found (ite has-policy right covers-none))",
        tables=(SymbolicFunction("found", "Policy", execute_symbolically(run, raising="wrong")),),
    )
