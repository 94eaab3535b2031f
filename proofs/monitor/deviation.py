"""Comparison of the robot with the motions that were decided, explored: `tracking` of the monitor."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from types import ModuleType, SimpleNamespace
from typing import Any, Final, cast

from aeros.runtime.ports import Reading
from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.smtlib import smt_and, smt_apply, smt_literal
from aeros.spec.theorems.symbolic_execution import (
    DecideBranch,
    DecisionDiagram,
    execute_symbolically,
    term_of,
)
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation
from proofs.lib.symbolic_reals import (
    LARGER_DEFINITION,
    POLYNOMIALS,
    SIZE,
    SymbolicReal,
    declare_reals,
    max_of_many_stub,
    max_stub,
    min_stub,
    sum_terms,
)
from proofs.monitor.tick_answers import MONITOR, declare_bools

TRACKING: Final = "aeros.runtime.monitor.tracking"


_RAISES: Final = "raises"
"""A number of which nothing is known: what code that raises an exception returns."""


class _Plan(SimpleNamespace):
    """Stands for a trajectory."""


def _tracking_module(code: ModuleSource, **stubs: Any) -> ModuleType:
    """The module, with its look at types for a plan of the kind that it knows."""
    return code.module(TRACKING, Trajectory=_Plan, **stubs)


# Which motion each part of the robot is compared with.

_NUMBERS: Final = (1, 2)


def _follower(ask: DecideBranch, part: str) -> Any:
    number = 1 if ask(f"{part}.follows.1") else 2
    made = SimpleNamespace(number=number, rests=False, halts=False, reference="earlier")
    made.rest = lambda: setattr(made, "rests", True)
    made.halt = lambda: setattr(made, "halts", True)
    return made


def _tracker(tracking: ModuleType, ask: DecideBranch, under_way: set[int]) -> Any:
    made = object.__new__(tracking.MotionTracker)
    made._tracking = "tracking" if ask("is-bounded") else None
    made._joint_variable = "joints" if ask("joints-are-named") else ""
    made._numbers = set(under_way)
    made._rates = {number: f"rates {number}" for number in _NUMBERS if number in under_way}
    made.is_idle = not under_way
    made._arm = _follower(ask, "arm") if under_way and made._tracking else None
    made._base = _follower(ask, "base") if under_way and made._tracking else None
    made._body = "earlier" if under_way else None
    return made


def _part(follower: Any, part: str) -> str:
    if follower is None:
        return "none"
    if follower.number == 3:
        return "this" if follower.reference == f"{part} of this plan" else "wrong"
    rests, halts = smt_literal(follower.rests), smt_literal(follower.halts)
    return smt_apply("part", str(follower.number), rests, halts)


_PARTS: Final = (
    "(declare-datatypes ((Part 0)) (((none) (this) (wrong) (part (motion Int) (rests Bool) (halts Bool)))))",
    "(declare-datatypes ((Tracker 0)) (((raises) (tracker (arm Part) (base Part) (idle Bool) (count Int)"
    " (rates Int) (this-rates Bool) (right-body Bool)))))",
    *declare_bools("is-bounded", "joints-are-named", "arm.follows.1", "base.follows.1"),
    *declare_bools("is-under-way.1", "is-under-way.2", "is-trajectory", "is-servo", "moves-joints"),
    *declare_bools("moves-base", "is-first", "does-halt"),
)


def _tracker_term(made: Any, body: str) -> str:
    return smt_apply(
        "tracker",
        _part(made._arm, "joints"),
        _part(made._base, "base"),
        smt_literal(made.is_idle),
        str(len(made._numbers)),
        str(len(made._rates)),
        smt_literal(made._rates.get(3) == ("rates", "joints")),
        smt_literal(made._body == body),
    )


def tracked_obligation(code: ModuleSource) -> TheoremObligation:
    """Of `add`, with what moves in a plan put aside."""

    def run(ask: DecideBranch) -> str:
        def follow(number: int, reference: str) -> Any:
            return SimpleNamespace(number=number, reference=reference, rests=False, halts=False)

        tracking = _tracking_module(
            code,
            moves_joints=lambda _: ask("moves-joints"),
            moves_base=lambda _: ask("moves-base"),
            _Follower=follow,
            _joint_reference=lambda plan: f"joints of {plan.text}",
            _base_reference=lambda plan: f"base of {plan.text}",
            FeedbackRates=lambda plan, variable: ("rates", variable),
        )
        under_way = {number for number in _NUMBERS if ask(f"is-under-way.{number}")}
        made = _tracker(tracking, ask, under_way)
        is_trajectory = ask("is-trajectory")
        servo = "servo" if is_trajectory and ask("is-servo") else None
        make = _Plan if is_trajectory else SimpleNamespace
        earlier = made._body
        made.add(3, make(servo=servo, body="body", text="this plan"))
        is_this = is_trajectory and made._tracking and (not under_way or ask("moves-joints"))
        return _tracker_term(made, "body" if is_this else earlier)

    def part(name: str, moves: str) -> str:
        old = f"(part (ite {name}.follows.1 1 2) false false)"
        return (
            f"(= ({name} after) (ite (and active is-bounded (not (and is-trajectory {moves}))) {old} {{}}))"
        )

    this = "(ite (and is-bounded is-trajectory) this none)"
    return TheoremObligation(
        "After `MotionTracker.add` of a trajectory, the joints are compared with it if it moves them or\n"
        "if they were compared with none, and so is the base; under feedback its rates are compared, too,\n"
        "if the site names the joints. Nothing else changes, and a plan of another type changes nothing.",
        (
            *_PARTS,
            "(define-fun active () Bool (or is-under-way.1 is-under-way.2))",
            "(define-fun number () Int (+ (ite is-under-way.1 1 0) (ite is-under-way.2 1 0)))",
            "(define-fun adds-rates () Bool (and is-trajectory is-servo joints-are-named))",
        ),
        smt_and(
            (
                "(not (= after raises))",
                part("arm", "moves-joints").format(this),
                part("base", "moves-base").format(this),
                "(= (idle after) (not (or active is-trajectory)))",
                "(= (count after) (+ number (ite is-trajectory 1 0)))",
                "(= (rates after) (+ number (ite adds-rates 1 0)))",
                "(= (this-rates after) adds-rates)",
                "(right-body after)",
            )
        ),
        tables=(SymbolicFunction("after", "Tracker", execute_symbolically(run, raising="raises")),),
    )


def untracked_obligation(code: ModuleSource) -> TheoremObligation:
    """Of `remove` and `halt`."""
    tracking = _tracking_module(code)

    def run(ask: DecideBranch) -> str:
        under_way = {1} | ({2} if ask("is-under-way.2") else set())
        made = _tracker(tracking, ask, under_way)
        if ask("does-halt"):
            made.halt(1)
        else:
            made.remove(1)
        return _tracker_term(made, made._body)

    def part(name: str) -> str:
        follows = f"(or {name}.follows.1 (not is-under-way.2))"
        earlier = f"(part (ite {follows} 1 2) (and {follows} (not does-halt)) (and {follows} does-halt))"
        return f"(= ({name} after) (ite (and is-bounded (or does-halt is-under-way.2)) {earlier} none))"

    return TheoremObligation(
        "After `MotionTracker.remove` of a motion, the parts that it moved stay where it ended, as long\n"
        "as another motion is under way; its rates are no longer compared. After `halt`, exactly these\n"
        "parts come to rest, and all that is under way stays so.",
        _PARTS,
        smt_and(
            (
                "(not (= after raises))",
                part("arm"),
                part("base"),
                "(= (idle after) (not (or does-halt is-under-way.2)))",
                "(= (count after) (+ (ite does-halt 1 0) (ite is-under-way.2 1 0)))",
                "(= (rates after) (count after))",
            )
        ),
        tables=(SymbolicFunction("after", "Tracker", execute_symbolically(run, raising="raises")),),
        assumptions={
            f"a-part-follows-what-is-under-way.{part}": f"(=> (not is-under-way.2) {part}.follows.1)"
            for part in ("arm", "base")
        },
    )


def bound_obligation(code: ModuleSource) -> TheoremObligation:
    """Of the constructor, and of the monitor's."""
    tracking = _tracking_module(code, float=lambda value: value)
    monitor = code.module(
        MONITOR, using=(tracking,), StopRecords=lambda _: None, stop_quantities=lambda _: None
    )

    def run(ask: DecideBranch) -> str:
        bound = SimpleNamespace(bound="bound", levers=("lever 1", "lever 2")) if ask("has-bound") else None
        motion = SimpleNamespace(
            tracking=bound, start_variable="joints", base_variable="base" if ask("base-is-named") else None
        )
        rules = SimpleNamespace(site=SimpleNamespace(motion=motion if ask("has-motion") else None))
        made = monitor.RuntimeMonitor(rules, None)
        tracker = made.tracker
        fresh = (tracker.is_idle, tracker._arm, tracker._base, tracker._numbers, tracker._rates)
        if fresh != (True, None, None, set(), {}) or made._watches or made._active_actions or made._measured:
            return "wrong"
        found = (tracker._tracking, tracker._bound, tracker._levers, tracker._joint_variable)
        if found == (bound, "bound", ("lever 1", "lever 2"), "joints") and bound is not None:
            return "all" if tracker._base_variable == "base" else "joints-alone"
        if tracker._tracking is None:
            return "rates-alone" if tracker._joint_variable == "joints" else "free"
        return "wrong"

    return TheoremObligation(
        "A new monitor watches nothing, and compares joints and base under the names, with the bound and\n"
        "with the levers of the site's motion policy.",
        (
            "(declare-datatypes ((Found 0)) (((all) (joints-alone) (rates-alone) (free) (wrong))))",
            *declare_bools("has-bound", "has-motion", "base-is-named"),
        ),
        "(= found (ite has-motion (ite has-bound (ite base-is-named all joints-alone) rates-alone) free))",
        tables=(SymbolicFunction("found", "Found", execute_symbolically(run, raising="wrong")),),
    )


# What is compared at a tick.

_RATES: Final = ("first", "second", "third")


def deviation_obligation(code: ModuleSource) -> TheoremObligation:
    """With the distance, and the rates of each motion under feedback, put aside."""
    tracking = _tracking_module(code)

    def run(ask: DecideBranch) -> str:
        at, measured, wrong = object(), object(), list[object]()

        def check(now: object, values: object) -> None:
            wrong.extend(one for one in (now, values) if one is not at and one is not measured)

        def distance_fault(now: object, values: object) -> str | None:
            check(now, values)
            made.deviation = "distance"
            return None if ask("is-on-path") else "decided-path"

        def rates(name: str) -> Any:
            def unmet_bounds(now: object, values: object) -> tuple[str, ...]:
                check(now, values)
                return () if ask(f"{name}.is-slow") else (name,)

            return SimpleNamespace(unmet_bounds=unmet_bounds)

        made = object.__new__(tracking.MotionTracker)
        made._tracking = "tracking" if ask("is-bounded") else None
        made._distance_fault = distance_fault
        made._rates = {n: rates(name) for n, name in enumerate(_RATES) if ask(f"{name}.is-under-way")}
        found = made.violation(at, measured)
        if wrong:
            return "wrong"
        if found == "declared-rates":
            named = made.deviation.unmet_bounds
            return "fast" if made.deviation.rule == found and len(named) == 1 else "wrong"
        return {None: "follows", "decided-path": "off"}.get(found, "wrong")

    slow = smt_and(f"(=> {name}.is-under-way {name}.is-slow)" for name in _RATES)
    return TheoremObligation(
        "`MotionTracker.violation` is None exactly where the robot is on its decided path, if the site\n"
        "bounds the distance, and each motion under feedback is as slow as declared.",
        (
            "(declare-datatypes ((Found 0)) (((follows) (off) (fast) (wrong))))",
            *declare_bools("is-bounded", "is-on-path"),
            *declare_bools(*(f"{name}.{what}" for name in _RATES for what in ("is-slow", "is-under-way"))),
        ),
        f"(= found (ite (and is-bounded (not is-on-path)) off (ite {slow} follows fast)))",
        tables=(SymbolicFunction("found", "Found", execute_symbolically(run, raising="wrong")),),
    )


_JOINTS: Final = ("1", "2", "3")


def _reals(ask: DecideBranch, name: str) -> list[SymbolicReal]:
    return [SymbolicReal(f"{name}.{joint}", ask) for joint in _JOINTS]


def distance_obligation(code: ModuleSource) -> TheoremObligation:
    """With a follower's comparison, and the displacement of the links' corners, put aside."""

    def run(ask: DecideBranch) -> str:
        decided, joints, levers = (_reals(ask, name) for name in ("decided", "joints", "lever"))
        at, measured = object(), {"joints": object(), "base": object()}

        def compare(part: str, found: Any) -> Callable[[object, object], Any]:
            def compared(now: object, value: object) -> Any:
                if now is not at or value is not measured[part]:
                    raise KeyError(part)
                if ask(f"{part}.is-malformed"):
                    raise ValueError if ask(f"{part}.is-wrong-value") else TypeError
                return found

            return compared

        def displacement(body: str, first: Any, second: Any, each: Any) -> SymbolicReal:
            if (body, first, second, each) != ("body", decided, joints, levers):
                raise KeyError(body)
            return SymbolicReal("displacement", ask)

        tracking = _tracking_module(
            code,
            dist=lambda *given: (
                SymbolicReal("base-off", ask) if given == ("decided base", "base now") else None
            ),
            sum=lambda summands: SymbolicReal(sum_terms(map(term_of, summands)), ask),
            isfinite=lambda value: ask("is-finite"),
            greatest_displacement=displacement,
            UnmetBound=lambda *given: given,
            MotionDeviation=lambda *given: given,
        )
        made = object.__new__(tracking.MotionTracker)
        made._base_variable = "base" if ask("base-is-named") else None
        made._joint_variable = "joints"
        active = ask("active")
        made._base = (
            SimpleNamespace(compare=compare("base", ("decided base", "base now"))) if active else None
        )
        made._arm = SimpleNamespace(compare=compare("joints", (decided, joints))) if active else None
        made._levers, made._bound = levers, SymbolicReal("bound", ask)
        made._body = "body" if ask("has-body") else None
        found = made._distance_fault(at, measured)
        return {None: "follows", "decided-path": "off"}.get(found, str(found).replace("input:", "input."))

    sums = sum_terms(f"(* lever.{n} (size (- decided.{n} joints.{n})))" for n in _JOINTS)
    base = "(ite base-is-named base-off 0.0)"
    is_near = f"(<= (+ {base} {sums}) bound)"
    is_close = f"(and has-body is-finite (<= (+ {base} displacement) bound))"
    wrong_base = "(and base-is-named base.is-malformed)"
    return TheoremObligation(
        "`MotionTracker._distance_fault` is None exactly where nothing moves, or the robot is within the\n"
        "site's bound of where it has to be: its base, and its links, by the sum over all joints or by\n"
        "their corners. A position that is malformed or not finite is a fault under its own name.",
        (
            "(declare-datatypes ((Found 0)) (((follows) (off) (input.joints) (input.base) (wrong))))",
            *declare_reals(*(f"{name}.{n}" for name in ("decided", "joints", "lever") for n in _JOINTS)),
            *declare_reals("base-off", "displacement", "bound"),
            *declare_bools("active", "base-is-named", "has-body", "is-finite"),
            *declare_bools(
                *(
                    f"{part}.{what}"
                    for part in ("joints", "base")
                    for what in ("is-malformed", "is-wrong-value")
                )
            ),
            SIZE,
        ),
        f"(= found (ite (not active) follows (ite {wrong_base} input.base"
        " (ite joints.is-malformed input.joints"
        f" (ite {is_near} follows (ite (not (and has-body is-finite)) input.joints"
        f" (ite {is_close} follows off)))))))",
        tables=(SymbolicFunction("found", "Found", execute_symbolically(run, raising="wrong")),),
    )


def follower_obligation(code: ModuleSource) -> TheoremObligation:
    """Of a follower in every state, at a tick and at the next one."""
    tracking = _tracking_module(code, max=max_stub)

    def run(ask: DecideBranch) -> str:
        asked: list[SymbolicReal] = []

        def reference(elapsed: SymbolicReal, value: object) -> str:
            asked.append(elapsed)
            return "decided" if value == "first" else "wrong"

        made = tracking._Follower(1, reference)
        if ask("was-compared"):
            made._began = SymbolicReal("began", ask)
        if ask("halts"):
            made.halt()
        if ask("is-over"):
            made.rest()
        now, value = SymbolicReal("now", ask), ("first",)
        position: Any = value if ask("halts") else "first"
        given = Reading(position, cast("Any", SymbolicReal("time", ask))) if ask("is-reading") else position
        decided, measured = made.compare(now, given)
        began = made._began.term
        if not ask("halts"):
            is_right = (decided, measured, len(asked)) == ("decided", "first", 1)
            return smt_apply("path", asked[0].term, began) if is_right else "wrong"
        if (decided, measured) != (value, value) or asked:
            return "wrong"
        later = made.compare(now, ("later",))
        rests = later == (value, ("later",))
        return "rests" if rests else "free" if later == (("later",), ("later",)) else "wrong"

    return TheoremObligation(
        "`_Follower.compare` compares the measured position with the decided one at the time that has\n"
        "passed since the first comparison, when it was measured. A part that is halted is compared with\n"
        "nothing until its motion is over, and then with where it was at the next tick.",
        (
            "(declare-datatypes ((Found 0)) (((path (elapsed Real) (since Real)) (rests) (free) (wrong))))",
            *declare_reals("began", "now", "time"),
            *declare_bools("was-compared", "halts", "is-over", "is-reading"),
            "(define-fun start () Real (ite was-compared began now))",
            "(define-fun at () Real (- (ite is-reading time now) start))",
        ),
        "(= found (ite halts (ite is-over rests free) (path (ite (<= 0.0 at) at 0.0) start)))",
        tables=(SymbolicFunction("found", "Found", execute_symbolically(run, raising="wrong")),),
    )


# Where the decided motion is at a time.


def powers_obligation(code: ModuleSource) -> TheoremObligation:
    """Of any piece, at any of its parameters."""
    tracking = _tracking_module(code)

    def run(ask: DecideBranch) -> str:
        corners = [(SymbolicReal(f"{name}.1", ask), SymbolicReal(f"{name}.2", ask)) for name in "abcd"]
        rows = tracking._powers(corners)
        x = SymbolicReal("x", ask)
        first, second = ((((d * x + c) * x + b) * x + a) for a, b, c, d in rows)
        return term_of(first if ask("is-first") else second)

    def bezier(joint: str) -> str:
        y = "(- 1.0 x)"
        return sum_terms(
            (
                f"(* {y} {y} {y} a.{joint})",
                f"(* 3.0 {y} {y} x b.{joint})",
                f"(* 3.0 {y} x x c.{joint})",
                f"(* x x x d.{joint})",
            )
        )

    return TheoremObligation(
        "`_powers` are the coefficients of the powers of a Bézier curve's parameter, for each joint.",
        (
            *declare_reals(_RAISES, "x", *(f"{name}.{joint}" for name in "abcd" for joint in "12")),
            *declare_bools("is-first"),
        ),
        f"(= found (ite is-first {bezier('1')} {bezier('2')}))",
        tables=(SymbolicFunction("found", "Real", execute_symbolically(run, raising=_RAISES)),),
        logic=POLYNOMIALS,
    )


_PIECES: Final = 3


def _profile(elapsed: str) -> tuple[str, ...]:
    """Definitions of the completed fraction of the path, by minimum jerk."""
    return (
        f"(define-fun u () Real (ite (<= (/ {elapsed} duration) 1.0) (/ {elapsed} duration) 1.0))",
        "(define-fun s ((x Real)) Real (+ (* 10.0 x x x) (* (- 15.0) x x x x) (* 6.0 x x x x x)))",
    )


def _joint_position(code: ModuleSource, ask: DecideBranch) -> tuple[str, str]:
    """Position of a joint by a path of three pieces, and the place on the path by which it was found.

    The powers of a piece are put aside, and so is the whole part of a number.
    """
    places: list[str] = []

    def whole_part(value: SymbolicReal) -> int:
        places.append(value.term)
        name = "place" if "elapsed" in value.term else "earlier-place"
        return next((n for n in range(_PIECES, 0, -1) if ask(f"(<= {n}.0 {name})")), 0)

    def powers(piece: Sequence[str]) -> list[tuple[SymbolicReal, ...]]:
        return [tuple(SymbolicReal(f"(coefficient {piece[0]} {n})", ask) for n in range(4))]

    def least(*values: Any) -> Any:
        return min(*values) if all(type(one) is int for one in values) else min_stub(*values)

    tracking = _tracking_module(code, min=least, int=whole_part, _powers=powers)
    path = tuple((str(number),) for number in range(_PIECES))
    plan = SimpleNamespace(servo=None, joint_paths=(path,), duration=SymbolicReal("duration", ask))
    reference = tracking._joint_reference(plan)
    if ask("was-asked"):
        reference(SymbolicReal("earlier", ask), None)
    (found,) = reference(SymbolicReal("elapsed", ask), None)
    return str(found.term).replace(places[-1], "place"), places[-1]


def _explore(code: ModuleSource, part: int) -> DecisionDiagram:
    return execute_symbolically(lambda ask: _joint_position(code, ask)[part], raising=_RAISES)


def joint_position_obligation(code: ModuleSource) -> TheoremObligation:
    """With the place on the path put aside: see `joint_progress_obligation`."""
    piece = "0"
    for number in range(1, _PIECES):
        piece = f"(ite (<= {number}.0 place) {number} {piece})"
    x = "(- place (to_real piece))"
    row = [f"(coefficient piece {n})" for n in range(4)]
    powers = f"(+ {row[0]} (* {x} (+ {row[1]} (* {x} (+ {row[2]} (* {x} {row[3]}))))))"
    return TheoremObligation(
        "The decided position of a joint, at a place on its path, is that of the piece of the path there,\n"
        "at the piece's own parameter; whatever was asked before.",
        (
            "(declare-fun coefficient (Int Int) Real)",
            *declare_reals(_RAISES, "place", "earlier-place"),
            *declare_bools("was-asked"),
            f"(define-fun piece () Int {piece})",
            f"(define-fun position () Real {powers})",
        ),
        "(= found position)",
        tables=(SymbolicFunction("found", "Real", _explore(code, 0)),),
    )


def joint_progress_obligation(code: ModuleSource) -> TheoremObligation:
    """Of a path of three pieces."""
    return TheoremObligation(
        "The place on the path of joints at a time is the fraction that minimum jerk has completed then,\n"
        "in pieces of equal length; after the end it is the last.",
        (
            *declare_reals(_RAISES, "elapsed", "earlier", "duration", "place", "earlier-place"),
            *declare_bools("was-asked"),
            *_profile("elapsed"),
        ),
        f"(= found (* {smt_literal(Fraction(_PIECES))} (s u)))",
        tables=(SymbolicFunction("found", "Real", _explore(code, 1)),),
        assumptions={"it-takes-time": "(< 0.0 duration)"},
        logic=POLYNOMIALS,
    )


def base_position_obligation(code: ModuleSource) -> TheoremObligation:
    """Of each coordinate."""

    def run(ask: DecideBranch) -> str:
        tracking = _tracking_module(code, min=min_stub)
        plan = SimpleNamespace(
            base=[SymbolicReal(f"base.{axis}", ask) for axis in "xyz"],
            base_path=[SymbolicReal(f"way.{axis}", ask) for axis in "xyz"],
            duration=SymbolicReal("duration", ask),
        )
        x, y, z = tracking._base_reference(plan)(SymbolicReal("elapsed", ask), None)
        return term_of(x if ask("is-x") else y if ask("is-y") else z)

    return TheoremObligation(
        "The decided position of the base at a time is on its straight path, at the fraction that minimum\n"
        "jerk has completed then.",
        (
            *declare_reals(
                _RAISES,
                "elapsed",
                "duration",
                *(f"{what}.{axis}" for what in ("base", "way") for axis in "xyz"),
            ),
            *declare_bools("is-x", "is-y"),
            *_profile("elapsed"),
        ),
        "(= found (ite is-x (+ base.x (* (s u) way.x)) (ite is-y (+ base.y (* (s u) way.y))"
        " (+ base.z (* (s u) way.z)))))",
        tables=(SymbolicFunction("found", "Real", execute_symbolically(run, raising=_RAISES)),),
        assumptions={"it-takes-time": "(< 0.0 duration)"},
        logic=POLYNOMIALS,
    )


def feedback_position_obligation(code: ModuleSource) -> TheoremObligation:
    """Of two paths with one piece each and one joint, with halves and boxes of pieces put aside."""

    def run(ask: DecideBranch) -> str:
        def joint_box(pieces: Sequence[str]) -> tuple[list[SymbolicReal], list[SymbolicReal]]:
            (piece,) = pieces
            return [SymbolicReal(f"(middle {piece})", ask)], [SymbolicReal(f"(width {piece})", ask)]

        def nearest_of(values: Any, *others: Any, key: Any = None) -> Any:
            if key is None:
                return min_stub(values, *others)
            first, *rest = values
            for one in rest:
                first = one if key(one) < key(first) else first
            return first

        tracking = _tracking_module(
            code,
            split_in_half=lambda piece: (f"{piece}0", f"{piece}1"),
            joint_box=joint_box,
            min=nearest_of,
            max=max_stub,
            dist=lambda a, b: abs(a[0] - b[0]),
        )
        reference = tracking._nearest_in_boxes((("1",), ("2",)), (SymbolicReal("slack", ask),))
        (found,) = reference(None, (SymbolicReal("joint", ask),))
        return str(found.term)

    quarters = [f"{path}{half}{quarter}" for path in "12" for half in "01" for quarter in "01"]

    def is_in(place: str, quarter: str) -> str:
        low, high = (f"({sign} (middle {quarter}) (+ (width {quarter}) slack))" for sign in "-+")
        return f"(<= {low} {place} {high})"

    inside = " ".join(is_in("found", one) for one in quarters)
    reached = " ".join(is_in("joint", one) for one in quarters)
    return TheoremObligation(
        "Under feedback, a joint is compared with a place that a quarter of a piece of some path has in\n"
        "its box, enlarged by the declared tolerance; and with its own place if that is in one of these\n"
        "boxes.",
        (
            "(declare-fun middle (Int) Real)",
            "(declare-fun width (Int) Real)",
            *declare_reals(_RAISES, "slack", "joint"),
            SIZE,
        ),
        f"(and (or {inside}) (=> (or {reached}) (= found joint)))",
        tables=(SymbolicFunction("found", "Real", execute_symbolically(run, raising=_RAISES)),),
        assumptions={
            "tolerance": "(<= 0.0 slack)",
            **{f"width.{one}": f"(<= 0.0 (width {one}))" for one in quarters},
        },
    )


# How far links are from where they have to be.

_LINKS: Final = ("2", "3")
"""Joints that the corners of two links move with; the tool moves with the last."""


def displacement_obligation(code: ModuleSource) -> TheoremObligation:
    """Of an arm of three joints, with the places of corners put aside."""

    def run(ask: DecideBranch) -> str:
        def frames_of(_: object, joints: Sequence[str]) -> list[Any]:
            place = "".join("d" if one.startswith("decided") else "m" for one in joints)

            def frame(number: int) -> Any:
                # A frame moves with the joints up to its own.
                return SimpleNamespace(to_base=lambda corner: f"{corner}@{number}:{place[:number]}")

            return [frame(number) for number in range(len(_JOINTS) + 1)]

        def dist(a: str, b: str) -> SymbolicReal:
            corner, _, moved = a.partition("@")
            other, _, decided = b.partition("@")
            if corner != other or set(decided.partition(":")[2]) != {"d"}:
                raise KeyError(a)
            return SymbolicReal(f"{corner}.{moved.replace(':', '.')}", ask)

        def larger_stub(greatest: Any, other: SymbolicReal) -> SymbolicReal:
            return max_of_many_stub([SymbolicReal(term_of(greatest), ask), other])

        def total(summands: Sequence[tuple[str, str]]) -> SymbolicReal:
            return SymbolicReal(sum_terms(map(term_of, summands)), ask)

        class Joint(str):
            """A position of a joint."""

            def __sub__(self, other: str) -> SymbolicReal:
                return SymbolicReal(f"(- {self} {other})", ask)

        tracking = _tracking_module(
            code, frames_of=frames_of, mounting_of=lambda row: row, dist=dist, sum=total, max=larger_stub
        )
        hulls = [SimpleNamespace(joint=int(link), corners=(f"a{link}", f"b{link}")) for link in _LINKS]
        body = SimpleNamespace(
            dh_rows=_JOINTS,
            hulls=hulls if ask("has-hulls") else [],
            balls=[SimpleNamespace(joint=int(link), centre=f"a{link}") for link in _LINKS],
            tool_offset="tool",
        )
        decided, measured = ([Joint(f"{name}.{n}") for n in _JOINTS] for name in ("decided", "joints"))
        levers = [SymbolicReal(f"lever.{n}", ask) for n in _JOINTS]
        found = tracking.greatest_displacement(body, decided, measured, levers)
        return term_of(found)

    corners = [(f"a{link}", int(link)) for link in _LINKS] + [("tool", len(_JOINTS))]
    hull_corners = [(f"b{link}", int(link)) for link in _LINKS]
    claims, names = [], []
    for inner in range(len(_JOINTS)):
        beyond = sum_terms(f"(* lever.{n} (size (- decided.{n} joints.{n})))" for n in _JOINTS[inner:])
        for corner, joint in (*corners, *hull_corners):
            if joint <= inner:
                continue
            name = f"{corner}.{joint}.{('d' * inner + 'm' * len(_JOINTS))[:joint]}"
            names.append(name)
            near = f"(or (<= {name} found) (<= {beyond} found))"
            claims.append(f"(=> has-hulls {near})" if (corner, joint) in hull_corners else near)
    return TheoremObligation(
        "`greatest_displacement` bounds the distance of every corner of every link, and of the tool, from\n"
        "its decided place, in the base's frame and seen from each link: by what it returns, or by the\n"
        "sum over the joints beyond that link, which then is no larger.",
        (
            *declare_reals(
                _RAISES, *(f"{name}.{n}" for name in ("decided", "joints", "lever") for n in _JOINTS), *names
            ),
            *declare_bools("has-hulls"),
            SIZE,
            LARGER_DEFINITION,
        ),
        smt_and(claims),
        tables=(SymbolicFunction("found", "Real", execute_symbolically(run, raising=_RAISES)),),
        assumptions={
            # The sums fall: each leaves out a summand of the sum before it.
            f"sums-fall.{n}": f"(<= 0.0 (* lever.{n} (size (- decided.{n} joints.{n}))))"
            for n in _JOINTS
        },
    )


# Rates under feedback.

_EARLIER: Final = ("first", "second")


def feedback_rates_obligation(code: ModuleSource) -> TheoremObligation:
    """With the form of numbers, and the place of the tool, put aside."""

    def run(ask: DecideBranch) -> str:
        class Joint(SymbolicReal):
            """A measured position."""

            __slots__ = ()

        def type_(value: object) -> type:
            if isinstance(value, Joint):
                return float if ask(f"{value.term}.is-double") else int
            return type(value)

        def dist(a: str, b: str) -> SymbolicReal:
            if a != "tool of now":
                raise KeyError(a)
            return SymbolicReal(f"way-since.{'this' if b == a else b}", ask)

        tracking = _tracking_module(
            code,
            type=type_,
            float=float,
            isfinite=lambda value: ask(f"{value.term}.is-finite"),
            frames_of=lambda *_: [SimpleNamespace(to_base=lambda offset: f"{offset} of now")],
            mounting_of=lambda row: row,
            dist=dist,
            UnmetBound=lambda *given: given,
        )
        body = SimpleNamespace(dh_rows=("row", "slide"), tool_offset="tool")  # of three and of five parts
        speed = tuple(SymbolicReal(f"speed.{n}", ask) for n in (1, 2))
        servo = SimpleNamespace(speed=speed, tool_speed=SymbolicReal("tool-speed", ask))
        rates = tracking.FeedbackRates(_Plan(servo=servo, body=body), "joints")
        count = 0 if ask("has-none") else 1 if ask("has-one") else 2
        for name in _EARLIER[2 - count :]:
            joints = tuple(SymbolicReal(f"{name}.{n}", ask) for n in (1, 2))
            rates._window.append((SymbolicReal(f"time.{name}", ask), joints, name))
        value = tuple(Joint(f"now.{n}", ask) for n in (1, 2))
        given = Reading(value, cast("Any", SymbolicReal("time", ask))) if ask("is-reading") else value
        found = rates.unmet_bounds(SymbolicReal("at", ask), {"joints": given})
        oldest = rates._window[0] if rates._window else None
        names = {**{one: one for one in _EARLIER}, "tool of now": "this"}
        latest = rates._window[-1][2] if oldest else ""
        return smt_apply(
            "rates",
            smt_literal(not found),
            "none" if oldest is None else names[oldest[2]],
            smt_literal(latest == "tool of now"),
        )

    def ways(name: str) -> str:
        lasted = f"(- moment time.{name})"
        tool = f"(<= way-since.{name} (+ (* tool-speed {lasted}) {smt_literal(Fraction(0.003))}))"
        joints = (
            f"(<= (size (- now.{n} {name}.{n})) (+ (* speed.{n} {lasted}) {smt_literal(tolerance)}))"
            for n, tolerance in ((1, Fraction(0.005)), (2, Fraction(0.003)))
        )
        return smt_and((tool, *joints))

    window = smt_literal(Fraction(0.05))
    compared = " ".join(
        f"(=> (= (oldest found) {name}) (= (is-slow found) {ways(name)}))" for name in _EARLIER
    )
    return TheoremObligation(
        "`FeedbackRates.unmet_bounds` is empty, for well-formed joints that were measured later than\n"
        "before, exactly where since the oldest tick of the last window neither the tool nor a joint has\n"
        "moved farther than the declared speeds and the tolerances allow. The window is 50 ms; the tick\n"
        "is kept.",
        (
            "(declare-datatypes ((Tick 0)) (((none) (first) (second) (this))))",
            "(declare-datatypes ((Rates 0)) (((raises) (rates (is-slow Bool) (oldest Tick) (keeps Bool)))))",
            *declare_reals("time", "at", "tool-speed", "speed.1", "speed.2", "now.1", "now.2"),
            *declare_reals(*(f"{name}.{n}" for name in _EARLIER for n in (1, 2))),
            *declare_reals(*(f"{what}.{name}" for name in _EARLIER for what in ("time", "way-since"))),
            *declare_reals("way-since.this"),
            *declare_bools("has-none", "has-one", "is-reading"),
            *declare_bools(*(f"now.{n}.{what}" for n in (1, 2) for what in ("is-double", "is-finite"))),
            SIZE,
            "(define-fun moment () Real (ite is-reading time at))",
            "(define-fun is-formed () Bool"
            " (and now.1.is-double now.2.is-double now.1.is-finite now.2.is-finite))",
            "(define-fun is-later () Bool (or has-none (< time.second moment)))",
            "(define-fun first-is-there () Bool (and (not has-none) (not has-one)))",
            f"(define-fun in-window ((t Real)) Bool (<= (- moment {window}) t))",
        ),
        "(ite (= found raises) false (ite (and is-formed is-later)"
        " (and (keeps found) (= (oldest found) (ite (and first-is-there (in-window time.first)) first"
        f" (ite (and (not has-none) (in-window time.second)) second this))) {compared})"
        " (and (is-slow found) (not (keeps found)))))",
        tables=(SymbolicFunction("found", "Rates", execute_symbolically(run, raising="raises")),),
        assumptions={
            "ticks-are-in-order": "(< time.first time.second)",
            "nothing-moves-in-no-time": "(= way-since.this 0.0)",
        },
    )
