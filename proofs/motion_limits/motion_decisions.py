"""The decision of a motion, explored: its parts, which all have to find nothing, and the form of plans."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from math import inf, nan
from types import SimpleNamespace
from typing import Any, Final, cast

from aeros.kinematic_chain import PRISMATIC
from aeros.runtime.gate.decision import Decision, DecisionKind, Reason
from aeros.runtime.ports import (
    Ball,
    Hull,
    MotionCompletion,
    NoMotion,
    RobotBody,
    ServoBounds,
    Trajectory,
)
from aeros.skill import Action
from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.smtlib import smt_and, smt_implies, smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation
from proofs.motion_limits.motion_rates import (
    TRAJECTORY,
    declare_truths,
    nothing_obligation,
    trajectory_module,
)


def decision_obligation(code: ModuleSource) -> TheoremObligation:
    """With the objections put aside."""
    module = trajectory_module(code)

    def run(ask: DecideBranch) -> str:
        given = (object(), object(), object())
        plan = MotionCompletion(True) if ask("is-completed") else object()
        action = Action("move", {}) if ask("has-action") else None
        policy = SimpleNamespace(kinds={"move": None} if ask("is-covered") else {})
        made = object.__new__(module.MotionDecider)
        made._policy = policy if ask("has-policy") else None

        def objections(*arguments: object) -> tuple[Reason, ...]:
            expected = (policy, action, plan, *given)
            if any(one is not other for one, other in zip(arguments, expected, strict=True)):
                raise ValueError("arguments")
            return () if ask("obeys") else (Reason("AE762", "", ""),)

        made._objections = objections
        kind = DecisionKind.ATTENUATE if ask("attenuated") else DecisionKind.ALLOW
        decision = Decision(kind if action else DecisionKind.DENY, action, ())
        found = made.decide(decision, plan, *given)
        if found is decision:
            return "same"
        is_denial = (found.kind, found.action) == (DecisionKind.DENY, None) and found.reasons
        return "denied" if is_denial else "wrong"

    return TheoremObligation(
        "`MotionDecider.decide` returns the decision that it was given where nothing objects to the\n"
        "motion, or where there is no motion to decide: no action, a kind that the policy does not cover,\n"
        "or one that the plant has already ended. Else it denies, with no action.",
        (
            "(declare-datatypes ((Found 0)) (((same) (denied) (wrong))))",
            *declare_truths("is-completed", "has-action", "is-covered", "has-policy", "obeys", "attenuated"),
        ),
        "(= found (ite (and has-action has-policy is-covered (not is-completed) (not obeys)) denied same))",
        tables=(SymbolicFunction("found", "Found", execute_symbolically(run, raising="wrong")),),
    )


_OTHERS: Final = ("one", "two")
_CHECKS: Final = ("start", "base", "end", "joints", "tool", "base-speed", "barriers")


class _Plan:
    """Stands for a trajectory."""

    def __init__(self, name: str) -> None:
        self.name = name
        # Its first position; nothing else of it is read here.
        self.joint_paths = (((f"start of {name}",),),)
        self.body = f"body of {name}"


_FAILURES: Final = 2
"""Number of comparisons that find something at once."""


class _Objections:
    """Comparisons that stand for those of a motion: each checks that it is asked about the right things.

    An instance is made for one exploration, and is told of each run's answers.
    """

    def __init__(self, code: ModuleSource) -> None:
        self.ask: DecideBranch = bool
        self._failures = 0
        self.plan, self.policy, self.readings = _Plan("plan"), object(), object()
        self.action = Action("move", {})
        self.others: list[Any] = []
        self.obstacles: tuple[str, ...] = ()
        self.moving = SimpleNamespace(base="base now")
        self.merged: Any = None
        self._module = trajectory_module(
            code,
            Trajectory=_Plan,
            type=lambda _: (
                _Plan if self.ask("is-trajectory") else NoMotion if self.ask("is-no-motion") else object
            ),
            merge_motions=self._merge,
            held_object=self._held_object,
            moves_joints=lambda of: self.ask(f"{of.name}.moves-joints"),
            commanded_joint_position=lambda other: f"place of {other.plan.name}",
            _start_mismatch=self._start,
            _end_mismatch=self._end,
            _base_mismatch=lambda *given: self._check("base", given, self.policy, "base now", self.readings),
            _base_too_fast=lambda *given: self._check("base-speed", given, self.policy, self.merged),
            _link_contacts=lambda *given: self._check("links", given, self.policy, self.moving),
            _obstacle_contacts=lambda *given: self._check(
                "obstacles", given, self.policy, self.moving, self.obstacles
            ),
        )

    def found(self, ask: DecideBranch) -> tuple[Any, ...]:
        """Run the code for one motion."""
        self.ask, self._failures = ask, 0
        others = _OTHERS if ask("has-others") else ()
        self.others = [
            SimpleNamespace(action=Action(f"kind {name}", {}), plan=_Plan(name)) for name in others
        ]
        self.obstacles = ("box",) if ask("has-obstacles") else ()
        arm = _Plan("arm") if ask("is-merged-with-arm") else self.plan

        def swept_motion(held: object) -> Any:
            _same(held, ("held", arm.body))
            return self.moving

        self.merged = SimpleNamespace(
            joints=SimpleNamespace(motion=arm), is_single_motion=not others, swept_motion=swept_motion
        )
        made = object.__new__(self._module.MotionDecider)
        made._malformed = self._malformed
        made._joints_too_fast = lambda *given: self._check("joints", given, self.plan)
        made._tool_too_fast = lambda *given: self._check(
            "tool",
            given,
            self.policy,
            [(self.action, self.plan), *((one.action, one.plan) for one in self.others)],
            self.merged,
        )
        made._breaches = lambda *given: self._check(
            "barriers", given, self.policy, self.action, None if others else self.plan, self.moving
        )
        found: tuple[Any, ...] = made._objections(
            self.policy, self.action, self.plan, self.readings, self.others, self.obstacles
        )
        return found

    def _answer(self, name: str) -> list[Reason]:
        if self._failures == _FAILURES or self.ask(f"{name}.holds"):
            return []
        self._failures += 1
        return [Reason("AE761", name, "")]

    def _check(self, name: str, given: tuple[object, ...], *expected: object) -> list[Reason]:
        _same(given, expected)
        return self._answer(name)

    def _malformed(self, policy: object, plan: Any) -> str | None:
        _same(policy, self.policy)
        return None if self.ask(f"{plan.name}.is-formed") else "malformed"

    def _start(self, policy: object, posture: str, readings: object, _: str) -> list[Reason]:
        _same((policy, readings), (self.policy, self.readings))
        of, _, name = posture.partition(" of ")
        _same(of, "start" if name == "plan" else "place")
        return self._answer("start" if name == "plan" else f"start.{name}")

    def _end(self, policy: object, action: Action, merged: object, _: str) -> list[Reason]:
        _same((policy, merged), (self.policy, self.merged))
        return self._answer("end" if action is self.action else f"end.{action.kind.removeprefix('kind ')}")

    def _merge(self, plan: object, concurrent: object) -> Any:
        _same((plan, concurrent), (self.plan, self.others))
        return self.merged if self.ask("can-be-merged") else "it cannot"

    def _held_object(self, policy: object, body: object, readings: object) -> Any:
        _same((policy, readings), (self.policy, self.readings))
        return "held", body


def objections_obligation(code: ModuleSource) -> TheoremObligation:
    """With each comparison put aside."""
    motion = _Objections(code)

    def run(ask: DecideBranch) -> str:
        return smt_literal(motion.found(ask) == ())

    checks = [
        *_CHECKS,
        "links",
        "obstacles",
        *(f"{of}.{name}" for of in ("start", "end") for name in _OTHERS),
    ]
    failures = " ".join(f"(ite {one}.holds 0 1)" for one in checks)
    of_others = [
        smt_and(
            (
                f"{name}.is-formed",
                smt_implies(f"{name}.moves-joints", f"start.{name}.holds"),
                f"end.{name}.holds",
            )
        )
        for name in _OTHERS
    ]
    arm = "(ite is-merged-with-arm arm.moves-joints plan.moves-joints)"
    claim = smt_and(
        (
            "is-trajectory",
            "plan.is-formed",
            "can-be-merged",
            smt_implies("has-others", smt_and(of_others)),
            *(f"{check}.holds" for check in _CHECKS),
            smt_implies(arm, "links.holds"),
            smt_implies("has-obstacles", "obstacles.holds"),
        )
    )
    return nothing_obligation(
        "`MotionDecider._objections` is empty exactly where the plant says that nothing moves, or where\n"
        "it returned a trajectory of its form, those under way are of theirs, all can be merged,\n"
        "and each comparison of the merged motion finds nothing: start, base, end, joints, tool, speed of\n"
        "the base, barriers, links, obstacles; for each motion under way, that it is where it has to be,\n"
        "and its end.",
        declare_truths(
            *("is-trajectory", "is-no-motion", "has-others", "has-obstacles", "is-merged-with-arm"),
            "can-be-merged",
            *(f"{name}.{of}" for name in ("plan", *_OTHERS) for of in ("is-formed", "moves-joints")),
            "arm.moves-joints",
            *(f"{check}.holds" for check in checks),
        ),
        f"(or (and (not is-trajectory) is-no-motion) {claim})",
        run,
        **{
            "few-find-something": f"(<= (+ {failures}) {_FAILURES})",
        },
    )


def _same(given: object, expected: object) -> None:
    """Raise ValueError unless both are equal: a comparison was given something else."""
    if given != expected:
        raise ValueError(str(given))


# The form of a plan.

_BODY: Final = RobotBody(
    ((0.0, 0.1, 0.2), (0.0, 0.1, 0.2, 0.3, PRISMATIC)),
    (0.0, 0.0, 0.1),
    (Ball("arm", 1, (0.0, 0.0, 0.0), 0.1), Ball("hand", 2, (0.0, 0.0, 0.0), 0.1)),
    (Hull("arm", 1, ((0.0, 0.0, 0.0),), 0.1), Hull("hand", 2, ((0.0, 0.0, 0.0),), 0.1)),
    (("arm", "hand"),),
)
_TURNING: Final = (0.0, 0.1, 0.2, 0.3)
_PIECE: Final = ((0.0, 0.0), (0.1, 0.1), (0.2, 0.2), (0.3, 0.3))
_NEXT: Final = ((0.3, 0.3), (0.4, 0.4), (0.5, 0.5), (0.6, 0.6))
_SERVO: Final = ServoBounds((0.1, 0.1), (1.0, 1.0), (1.0, 1.0), (1.0, 1.0), 0.1, 0.1, 0.1)
_FOLLOWED: Final = Trajectory(_BODY, ((_PIECE, _NEXT),), (0.0, 0.0, 0.0), (0.1, 0.0, 0.0), 1.0)
_UNDER_FEEDBACK: Final = Trajectory(
    _BODY, ((_PIECE, _NEXT), (_PIECE,)), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0, _SERVO
)

_NO_NUMBERS: Final[Mapping[str, Any]] = {
    "nan": nan,
    "infinite": inf,
    "minus-infinite": -inf,
    "whole": 1,
    "truth": True,
    "text": "1.0",
    "none": None,
}


def _changed(part: Any, change: Callable[[Any], Iterator[tuple[str, Any]]]) -> Iterator[tuple[str, Any]]:
    """Every copy of a part of a plan that differs in one place, by a name of the place."""
    yield from change(part)
    if isinstance(part, tuple):
        fields = getattr(part, "_fields", None)
        for place, one in enumerate(part):
            for name, changed in _changed(one, change):
                several = [*part[:place], changed, *part[place + 1 :]]
                label = fields[place] if fields else str(place)
                yield f"{label}.{name}", tuple.__new__(type(part), several)
    elif isinstance(part, RobotBody | Trajectory | ServoBounds):
        for field in part.__dataclass_fields__:
            for name, changed in _changed(getattr(part, field), change):
                yield f"{field}.{name}", replace(part, **{field: changed})


def _wrong_places(part: Any) -> Iterator[tuple[str, Any]]:
    """Faults of one place, whatever it is."""
    if type(part) is float:
        yield from _NO_NUMBERS.items()
    elif type(part) is int:
        yield from {"half": 0.5, "truth": True, "above": 3, "below": -1, "none": None}.items()
    elif type(part) is str:
        yield from {"whole": 1, "none": None, "list": ["arm"]}.items()
    elif isinstance(part, tuple):
        yield "list", [*part]
        yield "iterator", iter(part)
        yield "none", None
        yield "shorter", tuple.__new__(type(part), part[:-1])
        yield "longer", tuple.__new__(type(part), (*part, *part[-1:]))
        if type(part) is not tuple:
            yield "plain", tuple(part)
    elif isinstance(part, RobotBody | ServoBounds):
        yield "stranger", SimpleNamespace(**{name: getattr(part, name) for name in part.__dataclass_fields__})
        yield "text", "body"


def _wrong_as_wholes(plan: Trajectory) -> Iterator[tuple[str, Any]]:
    """Faults of a plan that each part of it is too well-formed to have."""
    body = plan.body
    arm, hand = body.balls
    yield "no-path", replace(plan, joint_paths=())
    yield "empty-path", replace(plan, joint_paths=((),))
    yield "no-duration", replace(plan, duration=0.0)
    yield "negative-duration", replace(plan, duration=-1.0)
    # A jump of position, of slope, of bend; in the last path.
    for name, second in {
        "jump": ((0.4, 0.3), *_NEXT[1:]),
        "kink": (_NEXT[0], (0.4, 0.5), *_NEXT[2:]),
        "bend": (*_NEXT[:2], (0.5, 0.6), _NEXT[3]),
    }.items():
        yield name, replace(plan, joint_paths=(*plan.joint_paths[:-1], (_PIECE, second)))
    # The site's lever of joint 1 is too short for a prismatic one.
    yield "short-lever", replace(plan, body=replace(body, dh_rows=(body.dh_rows[1], body.dh_rows[1])))
    yield "no-prismatic", replace(plan, body=replace(body, dh_rows=(body.dh_rows[0], (*_TURNING, 0.0))))
    yield "negative-ball", replace(plan, body=replace(body, balls=(arm, hand._replace(radius=-0.1))))
    yield "no-balls", replace(plan, body=replace(body, balls=()))
    yield "no-hand", replace(plan, body=replace(body, balls=(arm, arm)))
    hulls = body.hulls
    # A leg in place of the hand; and parts that move with a joint that the arm does not have.
    for label, changes in {"leg": {"link": "leg"}, "beyond": {"joint": 3}, "before": {"joint": -1}}.items():
        other = replace(
            body,
            balls=(arm, hand._replace(**cast("Any", changes))),
            hulls=(hulls[0], hulls[1]._replace(**cast("Any", changes))),
            exempt_pairs=(),
        )
        yield label, replace(plan, body=other)
    yield "negative-hull", replace(plan, body=replace(body, hulls=(hulls[0], hulls[1]._replace(radius=-0.1))))
    yield "no-hull", replace(plan, body=replace(body, hulls=hulls[:1], exempt_pairs=()))
    yield "no-corner", replace(plan, body=replace(body, hulls=(hulls[0], hulls[1]._replace(corners=()))))
    yield "other-joint", replace(plan, body=replace(body, hulls=(hulls[0], hulls[1]._replace(joint=1))))
    yield "unknown-pair", replace(plan, body=replace(body, exempt_pairs=(("arm", "leg"),)))
    if plan.servo is None:
        yield "two-paths", replace(plan, joint_paths=plan.joint_paths * 2)
    else:
        yield "base-under-feedback", replace(plan, base_path=(0.0, 0.0, 0.1))


_STILL_FORMED: Final = (
    *("body.balls.longer", "body.hulls.longer", "body.exempt_pairs.longer", "body.exempt_pairs.shorter"),
    *("body.dh_rows.0.longer", "body.dh_rows.1.shorter"),
    *("body.hulls.0.corners.longer", "body.hulls.1.corners.longer", "joint_paths.0.shorter"),
)
"""Changes that leave a plan as well-formed: a ball, hull, pair or corner twice, a path of fewer pieces, a
row with or without a fourth number, one without the fifth that makes it prismatic."""

_FORMED_UNDER_FEEDBACK: Final = ("joint_paths.shorter", "joint_paths.longer")
"""Under feedback, a path more or less, too."""


def _faults(plan: Trajectory) -> list[Trajectory]:
    """Plans with one fault each."""
    found = {**dict(_changed(plan, _wrong_places)), **dict(_wrong_as_wholes(plan))}
    formed = _STILL_FORMED if plan.servo is None else (*_STILL_FORMED, *_FORMED_UNDER_FEEDBACK)
    return [changed for name, changed in found.items() if name not in formed]


def form_obligation(plan: Trajectory, code: ModuleSource) -> TheoremObligation:
    """Of a plan with at most one fault, by its number."""
    module = code.module(TRAJECTORY)
    policy = SimpleNamespace(
        lowest=(0, 0), link_clearance=0.1, is_mixed=True, tracking=SimpleNamespace(levers=(0.5, 1))
    )
    made = object.__new__(module.MotionDecider)
    made._boxes = [
        SimpleNamespace(links=links) for links in (frozenset(("hand", "held")), None, frozenset(("arm",)))
    ]
    plans = [plan, *_faults(plan)]  # new ones each time: an iterator can be read once

    def run(ask: DecideBranch) -> str:
        low, high = 0, len(plans)
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (low, middle) if ask(f"(< fault {middle})") else (middle, high)
        return "formed" if made._malformed(cast("Any", policy), plans[low]) is None else "malformed"

    return TheoremObligation(
        "`MotionDecider._malformed` finds no fault in a plan that has none, and raises no exception. It\n"
        "finds every single fault: a number that is no double or not finite, a part of another type or\n"
        "length, one that can change or be read once only, a path that does not join smoothly, a body\n"
        "without a link, ball or hull that a barrier or another link is compared with, or one that moves\n"
        "with no joint.",
        (
            "(declare-datatypes ((Form 0)) (((formed) (malformed) (raises))))",
            "(declare-const fault Int)",
        ),
        "(= found (ite (= fault 0) formed malformed))",
        tables=(SymbolicFunction("found", "Form", execute_symbolically(run, raising="raises")),),
        assumptions={"numbers-of-faults": f"(<= 0 fault {len(plans) - 1})"},
    )


def form_obligations() -> dict[str, Callable[[ModuleSource], TheoremObligation]]:
    """Make the obligations on the form of a plan that follows its path, and of one under feedback."""
    return {
        "form": partial(form_obligation, _FOLLOWED),
        "form-under-feedback": partial(form_obligation, _UNDER_FEEDBACK),
    }
