"""The motion that is decided for several motions under way is what each of them may still do."""

from __future__ import annotations

from fractions import Fraction
from types import SimpleNamespace
from typing import Any, Final

from aeros.spec.theorems.module_copies import ModuleSource, Mutant
from aeros.spec.theorems.smtlib import smt_and, smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, Theorem, TheoremObligation
from proofs.lib.loops import loops_of
from proofs.lib.symbolic_reals import AXES, POLYNOMIALS, SymbolicReal, max_stub

MERGED: Final = "aeros.runtime.motion.merged"
BEZIER: Final = "aeros.runtime.motion.bezier"
SWEPT: Final = "aeros.runtime.motion.swept_volume"

_OTHERS: Final = ("p", "q")
_ALL: Final = ("new", *_OTHERS)


def _plan(name: str, ask: DecideBranch) -> Any:
    return SimpleNamespace(
        name=name,
        servo="servo" if ask(f"{name}.feedback") else None,
        body="body" if name == "new" or ask(f"{name}.same-body") else "another body",
        base_path=(0.0, 1.0 if ask(f"{name}.travels") else 0.0, 0.0),
    )


def _selected(code: ModuleSource) -> TheoremObligation:
    merged = code.module(MERGED, Trajectory=SimpleNamespace, isinstance=lambda one, _: one.is_trajectory)

    def run(ask: DecideBranch) -> str:
        given = [
            (
                SimpleNamespace(action=f"action {name}", decided_at=SymbolicReal(f"{name}.decided", ask)),
                SimpleNamespace(name=name, is_trajectory=ask(f"{name}.moves")),
                ask(f"{name}.halts"),
            )
            for name in _OTHERS
        ]
        found = merged.concurrent_motions(given, SymbolicReal("now", ask))
        expected = [
            (f"action {plan.name}", plan.name, f"(- now {plan.name}.decided)", halts)
            for _, plan, halts in given
            if ask(f"{plan.name}.moves")
        ]
        shown = [(one.action, one.plan.name, one.elapsed_s.term, one.is_halting) for one in found]
        return smt_literal(shown == expected)

    return TheoremObligation(
        "`concurrent_motions` selects exactly the actions under way that have a motion, each with its\n"
        "motion, the time since its decision, and whether it is halting.",
        (
            *(f"(declare-const {name}.{word} Bool)" for name in _OTHERS for word in ("moves", "halts")),
            *(f"(declare-const {name}.decided Real)" for name in _OTHERS),
            "(declare-const now Real)",
        ),
        "exactly",
        tables=(SymbolicFunction("exactly", "Bool", execute_symbolically(run)),),
    )


def _merged(code: ModuleSource) -> TheoremObligation:
    merged = code.module(
        MERGED,
        moves_joints=lambda plan: plan.turns,
        _progress=lambda other: f"progress of {other.plan.name}",
        RemainingMotion=lambda plan, s="start": SimpleNamespace(motion=plan, s=s),
        MergedMotion=lambda joints, base: (joints, base),
    )

    def run(ask: DecideBranch) -> str:
        plans = {name: _plan(name, ask) for name in _ALL}
        for name, plan in plans.items():
            plan.turns = ask(f"{name}.turns")
        others = [
            merged.ConcurrentMotion(SimpleNamespace(kind="k"), plans[name], 0.0, ask(f"{name}.halts"))
            for name in _OTHERS
        ]
        found = merged.merge_motions(plans["new"], others)
        if isinstance(found, str):
            return "refused"
        for part in found:
            name = part.motion.name
            started = "start" if name == "new" else f"progress of {name}"
            if part.s != started or part.motion is not plans[name]:
                return "wrong"
        joints, base = (part.motion.name for part in found)
        return f"(both {joints} {base})"

    def at_most_one(word: str) -> str:
        pairs = [(one, other) for one in _ALL for other in _ALL if one < other]
        return smt_and(f"(not (and {one}.{word} {other}.{word}))" for one, other in pairs)

    def mover(word: str) -> str:
        return f"(ite p.{word} p (ite q.{word} q new))"

    feedback = "(or new.feedback p.feedback q.feedback)"
    fine = smt_and(
        [
            *(f"(not {name}.halts)" for name in _OTHERS),
            f"(not {feedback})",
            *(f"{name}.same-body" for name in _OTHERS),
            at_most_one("turns"),
            at_most_one("travels"),
        ]
    )
    words = ("feedback", "same-body", "travels", "turns", "halts")
    return TheoremObligation(
        "`merge_motions` merges exactly where none of the others halts, none is under feedback, all are of\n"
        "one body, and at most one turns joints and at most one moves the base. The joints then do what is\n"
        "left of the motion that turns them, the base what is left of the one that moves it.",
        (
            "(declare-datatypes ((Which 0)) (((new) (p) (q))))",
            "(declare-datatypes ((Found 0)) (((both (joints Which) (base Which)) (refused) (wrong))))",
            *(f"(declare-const {name}.{word} Bool)" for name in _ALL for word in words),
        ),
        f"(= found (ite {fine} (both {mover('turns')} {mover('travels')}) refused))",
        tables=(SymbolicFunction("found", "Found", execute_symbolically(run)),),
    )


def _travels(code: ModuleSource) -> TheoremObligation:
    merged = code.module(MERGED)

    def run(ask: DecideBranch) -> str:
        way = tuple(1.5 if ask(f"moves.{axis}") else 0.0 for axis in "xyz")
        return smt_literal(merged.moves_base(SimpleNamespace(base_path=way)))

    return TheoremObligation(
        "`moves_base` exactly if the base travels along any axis.",
        tuple(f"(declare-const moves.{axis} Bool)" for axis in "xyz"),
        "(= moves (or moves.x moves.y moves.z))",
        tables=(SymbolicFunction("moves", "Bool", execute_symbolically(run)),),
    )


class _Elapsed(SymbolicReal):
    """A time, whose share of the duration is u."""

    __slots__ = ()

    def __truediv__(self, other: Any) -> SymbolicReal:
        return SymbolicReal("u", self.ask)


def _progress(code: ModuleSource) -> TheoremObligation:
    merged = code.module(MERGED, max=max_stub)

    def run(ask: DecideBranch) -> str:
        motion = SimpleNamespace(
            elapsed_s=_Elapsed("elapsed", ask), plan=SimpleNamespace(duration="duration")
        )
        found = merged._progress(motion)
        return found.term if isinstance(found, SymbolicReal) else smt_literal(Fraction(found))

    return TheoremObligation(
        "`_progress` is no more of the path than has been completed, by the profile, when the share u of\n"
        "the duration has passed, and not less than none of it.",
        (
            "(declare-const u Real)",
            "(define-fun completed () Real (ite (<= u 0.0) 0.0 (ite (<= 1.0 u) 1.0"
            " (* u u u (+ (- 10.0 (* 15.0 u)) (* 6.0 u u))))))",
        ),
        "(<= 0.0 progress completed)",
        tables=(SymbolicFunction("progress", "Real", execute_symbolically(run)),),
        logic=POLYNOMIALS,
    )


def _swept(code: ModuleSource) -> TheoremObligation:
    captured: list[tuple[Any, ...]] = []
    swept = code.module(
        SWEPT, remaining_path=lambda path, s: (path, s), SweptMotion=lambda *parts: captured.append(parts)
    )

    def run(ask: DecideBranch) -> str:
        captured.clear()
        base = tuple(SymbolicReal(f"base.{axis}", ask) for axis in AXES)
        way = tuple(SymbolicReal(f"way.{axis}", ask) for axis in AXES)
        servo = SimpleNamespace(joint_tolerance=(0.1, 0.2)) if ask("feedback") else None
        body = SimpleNamespace(dh_rows=("one", "two"))
        arm = SimpleNamespace(joint_paths=("p", "q", "r"), servo=servo, body=body)
        carrier = arm if ask("single") else SimpleNamespace()
        carrier.base, carrier.base_path = base, way
        joints = swept.RemainingMotion(arm, "s of the arm")
        merged = swept.MergedMotion(joints, swept.RemainingMotion(carrier, SymbolicReal("s", ask)))
        merged.swept_motion("held")
        ((found_body, paths, slack, start, rest, is_single, held),) = captured
        is_whole = (
            found_body is body
            and paths == tuple((path, "s of the arm") for path in arm.joint_paths)
            and slack == ((0.1, 0.2) if ask("feedback") else (0.0, 0.0))
            and is_single is ask("single")
            and held == "held"
        )
        end = merged.base_at_end()
        numbers = " ".join(one.term for one in (*start, *rest, *end))
        return f"(motion {numbers})" if is_whole else "wrong"

    fields = [f"{word}.{axis}-of" for word in ("start", "rest", "end") for axis in AXES]
    expected = " ".join(
        [
            *(f"(+ base.{axis} (* s way.{axis}))" for axis in AXES),
            *(f"(* (- 1.0 s) way.{axis})" for axis in AXES),
            *(f"(+ base.{axis} way.{axis})" for axis in AXES),
        ]
    )
    return TheoremObligation(
        "`MergedMotion.swept_motion` has what is left of every joint path, the slack of feedback, and of\n"
        "the base's way the part from where it is; `base_at_end` is where that way ends.",
        (
            "(declare-datatypes ((Motion 0)) (((motion "
            + " ".join(f"({field} Real)" for field in fields)
            + ") (wrong))))",
            *(f"(declare-const {word}.{axis} Real)" for word in ("base", "way") for axis in AXES),
            *(f"(declare-const {flag} Bool)" for flag in ("feedback", "single")),
            "(declare-const s Real)",
        ),
        f"(= found (motion {expected}))",
        tables=(SymbolicFunction("found", "Motion", execute_symbolically(run)),),
    )


def _remaining(code: ModuleSource) -> TheoremObligation:
    bezier = code.module(BEZIER, _split_after=lambda piece, u: (piece, u))

    def run(ask: DecideBranch) -> str:
        place = next((number for number in range(8) if ask(f"(= eighth {number})")), 8)
        path = ["first", "second", "third", "fourth"]
        found = bezier.remaining_path(path, place / 8)
        index = min(place // 2, 3)
        expected = [(path[index], place / 2 - index), *path[index + 1 :]]
        return smt_literal(found == expected)

    return TheoremObligation(
        "`remaining_path` keeps what is left of the piece in which the path parameter lies, and all pieces\n"
        "after it.",
        ("(declare-const eighth Int)",),
        "exactly",
        tables=(SymbolicFunction("exactly", "Bool", execute_symbolically(run)),),
    )


THEOREM = Theorem(
    "what is decided for several motions of one robot is all that each of them may still do",
    {
        "selected": _selected,
        "merged": _merged,
        "travels": _travels,
        "progress": _progress,
        "swept": _swept,
        "remaining": _remaining,
        "loops": loops_of(MERGED, BEZIER, SWEPT),
    },
    (
        Mutant(
            "forgets-that-a-motion-is-halting",
            "selected",
            MERGED,
            "now - active.decided_at, is_halting)",
            "now - active.decided_at)",
        ),
        Mutant(
            "merges-with-a-motion-that-comes-to-rest",
            "merged",
            MERGED,
            "        if is_halting:\n",
            "        if False:\n",
        ),
        Mutant(
            "merges-two-that-turn-joints",
            "merged",
            MERGED,
            "if len(turning) > 1 or len(travelling) > 1:",
            "if len(travelling) > 1:",
        ),
        Mutant(
            "merges-motions-of-two-bodies",
            "merged",
            MERGED,
            "if plan.body != other.body:",
            "if plan.body == 0:",
        ),
        Mutant(
            "begins-those-under-way-again",
            "merged",
            MERGED,
            "RemainingMotion(other.plan, _progress(other))",
            "RemainingMotion(other.plan)",
        ),
        Mutant(
            "looks-at-one-axis",
            "travels",
            MERGED,
            "return any(motion.base_path)",
            "return bool(motion.base_path[0])",
        ),
        Mutant(
            "is-ahead-of-the-profile",
            "progress",
            MERGED,
            "u**3 * (10.0 - 15.0 * u + 6.0 * u * u) - _PROGRESS_MARGIN",
            "u * u * (10.0 - 15.0 * u + 6.0 * u * u) - _PROGRESS_MARGIN",
        ),
        Mutant(
            "forgets-the-way-that-is-behind",
            "swept",
            SWEPT,
            "x + part.s * wx, y + part.s * wy, z + part.s * wz",
            "x, y + part.s * wy, z + part.s * wz",
        ),
        Mutant(
            "forgets-the-slack-of-feedback",
            "swept",
            SWEPT,
            "arm.servo.joint_tolerance if arm.servo else",
            "arm.servo.joint_tolerance if False else",
        ),
        Mutant(
            "forgets-the-last-piece",
            "remaining",
            BEZIER,
            "*path[index + 1 :]]",
            "*path[index + 1 : -1]]",
        ),
        Mutant(
            "looks-at-two-motions-only",
            "loops",
            MERGED,
            "for action, other, _, is_halting in concurrent_motions:",
            "for action, other, _, is_halting in concurrent_motions[:2]:",
        ),
    ),
)
