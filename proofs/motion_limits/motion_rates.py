"""The comparison of a motion's rates and positions with the site's limits, explored."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from types import ModuleType, SimpleNamespace
from typing import Any, Final

from aeros.skill import Action
from aeros.spec.theorems.module_copies import ModuleSource, install_stubs
from aeros.spec.theorems.smtlib import smt_and, smt_implies, smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation

TRAJECTORY: Final = "aeros.runtime.motion.trajectory"

NUMBERS: Final = (
    "(declare-datatypes ((Number 0)) (((not-a-number) (finite (value Real)))))",
    "(define-fun at-most ((x Number) (y Number)) Bool (and ((_ is finite) x) ((_ is finite) y)"
    " (<= (value x) (value y))))",
    "(declare-fun scaled (Number) Number)",
)
"""Doubles that may be NaN, with which every comparison fails."""


class Measure:
    """A double that may be NaN: a comparison is asked, and what is computed from it has a name."""

    def __init__(self, name: str, ask: DecideBranch) -> None:
        self.name, self.ask = name, ask

    def __le__(self, other: Any) -> bool:
        return self.ask(f"(at-most {self.name} {_number_term(other)})")

    def __ge__(self, other: Any) -> bool:
        return self.ask(f"(at-most {_number_term(other)} {self.name})")

    def __lt__(self, other: Any) -> bool:
        return self <= other and not self >= other

    def __gt__(self, other: Any) -> bool:
        return self >= other and not self <= other

    def _named(self, what: str, other: Any = None) -> Measure:
        return Measure(
            f"({what} {self.name})" if other is None else f"({what} {self.name} {_number_term(other)})",
            self.ask,
        )

    def __sub__(self, other: Any) -> Measure:
        return self._named("minus", other)

    def __add__(self, other: Any) -> Measure:
        return self._named("plus", other)

    def __abs__(self) -> Measure:
        return self._named("size-of")

    def __format__(self, _: str) -> str:
        return self.name  # in messages

    def __rmul__(self, _: float) -> Measure:
        return self._named("scaled")


def _number_term(value: Any) -> str:
    return value.name if isinstance(value, Measure) else f"(finite {smt_literal(Fraction(value))})"


OPERATIONS: Final = (
    "(declare-fun minus (Number Number) Number)",
    "(declare-fun plus (Number Number) Number)",
    "(declare-fun size-of (Number) Number)",
)
"""Operations on doubles of which nothing is assumed."""


def declare_numbers(*names: str) -> tuple[str, ...]:
    """Declarations of doubles."""
    return tuple(f"(declare-const {name} Number)" for name in names)


def declare_truths(*names: str) -> tuple[str, ...]:
    """Declarations of truth values."""
    return tuple(f"(declare-const {name} Bool)" for name in names)


def trajectory_module(code: ModuleSource, **stubs: Any) -> ModuleType:
    """The module, with doubles that are already some."""
    return code.module(TRAJECTORY, float=lambda value: value, **stubs)


def put_aside(module: ModuleType, **stubs: Any) -> None:
    """Replace names of a module before one of its runs; each run replaces the same ones."""
    install_stubs(module, stubs)


RATES: Final = ("speed", "acceleration", "jerk")
JOINTS: Final = ("1", "2", "3")


def is_nothing(found: Iterable[object]) -> str:
    """Say as a literal that there is no reason."""
    return smt_literal(not list(found))


def nothing_obligation(
    statement: str, declarations: Sequence[str], claim: str, run: Any, **assumptions: str
) -> TheoremObligation:
    """Make the obligation that the code finds nothing exactly where `claim` holds, and raises nothing."""
    return TheoremObligation(
        statement,
        ("(declare-const raises Bool)", *declarations),
        f"(= nothing {claim})",
        tables=(SymbolicFunction("nothing", "Bool", execute_symbolically(run, raising=f"(not {claim})")),),
        assumptions=assumptions,
    )


def limits_obligation(code: ModuleSource) -> TheoremObligation:
    """Of any rates."""
    module = trajectory_module(code)

    def run(ask: DecideBranch) -> str:
        rates, limits = (
            module.MotionRates(*(Measure(f"{of}.{name}", ask) for name in RATES)) for of in ("found", "limit")
        )
        return is_nothing(module._limit_violations("joint-1", "joint 1", rates, limits, ("a", "b", "c")))

    return nothing_obligation(
        "`_limit_violations` is empty exactly where speed, acceleration and jerk are each at most their\n"
        "limit; never where one is not a number.",
        (
            *(*NUMBERS, *OPERATIONS),
            *declare_numbers(*(f"{of}.{name}" for of in ("found", "limit") for name in RATES)),
        ),
        smt_and(f"(at-most found.{name} limit.{name})" for name in RATES),
        run,
    )


def _limit_stub(ask: DecideBranch, expected: dict[str, tuple[object, object]]) -> Any:
    """Stands for `_limit_violations`: asks if the rates of a part are in their limits."""

    def limit_violations(rule: str, _: str, rates: object, limit: object, units: Sequence[str]) -> list[str]:
        wanted_rates, wanted_limit = expected[rule]
        if rates != wanted_rates or limit != wanted_limit or len(units) != len(RATES):
            raise ValueError(rule)
        return [] if ask(f"{rule}.in-limits") else [rule]

    return limit_violations


def joints_obligation(paths: Sequence[str], joints: Sequence[str], code: ModuleSource) -> TheoremObligation:
    """With the boxes of paths, and the rates of joints, put aside."""
    module = trajectory_module(code)

    def run(ask: DecideBranch) -> str:
        def measures(name: str) -> tuple[Measure, ...]:
            return tuple(Measure(f"{name}.{joint}", ask) for joint in joints)

        def joint_box(pieces: list[str]) -> tuple[Any, Any]:
            (piece,) = pieces
            return measures(f"middle.{piece}"), measures(f"width.{piece}")

        servo = SimpleNamespace(joint_tolerance=measures("slack")) if ask("is-servo") else None
        plan = SimpleNamespace(joint_paths=tuple((path,) for path in paths), servo=servo)
        rates, limits = ([f"{of} {joint}" for joint in joints] for of in ("rates", "limits"))
        put_aside(
            module,
            joint_box=joint_box,
            _joint_rates=lambda of: rates if of is plan else None,
            _limit_violations=_limit_stub(
                ask, {f"joint-{n + 1}": (rates[n], limits[n]) for n in range(len(joints))}
            ),
        )
        made = object.__new__(module.MotionDecider)
        made._lowest, made._highest, made._joint_rates = measures("lowest"), measures("highest"), limits
        made._unit = "rad"
        return is_nothing(made._joints_too_fast(plan))

    ranges, finite = [], []
    for path in paths:
        for n in joints:
            slack = f"(ite is-servo slack.{n} (finite 0.0))"
            low = f"(minus (minus middle.{path}.{n} width.{path}.{n}) {slack})"
            high = f"(plus (plus middle.{path}.{n} width.{path}.{n}) {slack})"
            ranges += [f"(at-most lowest.{n} {low})", f"(at-most {high} highest.{n})"]
            finite += [f"((_ is finite) {one})" for one in (low, high, f"lowest.{n}", f"highest.{n}")]
    names = ["slack", "lowest", "highest", *(f"{of}.{path}" for of in ("middle", "width") for path in paths)]
    return nothing_obligation(
        "`_joints_too_fast` is empty exactly where, on every path, each joint stays within its range with\n"
        "the tolerance of feedback, and the rates of each joint are in its limits.",
        (
            *NUMBERS,
            *OPERATIONS,
            *declare_numbers(*(f"{name}.{n}" for name in names for n in joints)),
            *declare_truths("is-servo", *(f"joint-{n}.in-limits" for n in joints)),
        ),
        smt_and((*ranges, *(f"joint-{n}.in-limits" for n in joints))),
        run,
        **{"numbers-of-a-formed-motion-are-finite": smt_and(finite)},
    )


def sources_obligation(code: ModuleSource) -> TheoremObligation:
    """Of `_joint_rates` and `_tool_rates`, with the bounds of a path put aside."""
    module = trajectory_module(code)

    def run(ask: DecideBranch) -> str:
        put_aside(
            module,
            joint_rates=lambda path, duration: ("bounds", path, duration),
            tool_rates=lambda *given: ("tool bounds", *given),
            moves_joints=lambda of: ask("moves-joints") if of.body == "body" else None,
        )
        servo = SimpleNamespace(
            speed=("s1", "s2"),
            acceleration=("a1", "a2"),
            jerk=("j1", "j2"),
            tool_speed="ts",
            tool_acceleration="ta",
            tool_jerk="tj",
        )
        plan = SimpleNamespace(
            servo=servo if ask("is-servo") else None, joint_paths=("path",), duration="duration", body="body"
        )
        joints, tool = module._joint_rates(plan), module._tool_rates(plan, "limit")
        rest = module.MotionRates(0.0, 0.0, 0.0)
        if joints == [("s1", "a1", "j1"), ("s2", "a2", "j2")] and tool == (("ts", "ta", "tj"), None):
            return "declared"
        if joints != ("bounds", "path", "duration"):
            return "wrong"
        if tool == ("tool bounds", "body", "path", "duration", "limit"):
            return "computed"
        return "computed-at-rest" if tool == (rest, rest) else "wrong"

    return TheoremObligation(
        "The rates that are compared are the bounds of the motion's own path, tool and duration; under\n"
        "feedback those that the plant declares. A tool is at rest only where no joint moves.",
        (
            "(declare-datatypes ((Rates 0)) (((declared) (computed) (computed-at-rest) (wrong))))",
            *declare_truths("is-servo", "moves-joints"),
        ),
        "(= found (ite is-servo declared (ite moves-joints computed computed-at-rest)))",
        tables=(SymbolicFunction("found", "Rates", execute_symbolically(run, raising="wrong")),),
    )


_MOTIONS: Final = ("new", "old", "older")


def tool_obligation(code: ModuleSource) -> TheoremObligation:
    """With the bounds of tool and base put aside."""
    module = trajectory_module(code)

    def run(ask: DecideBranch) -> str:
        plans = {
            name: SimpleNamespace(name=name, base_path=f"way {name}", duration=f"time {name}")
            for name in _MOTIONS
        }
        arm = plans["new" if ask("arm-is-new") else "old"]
        base = plans["new" if ask("base-is-new") else "old"]

        class Speed(Measure):
            """A speed, of which the search for bounds is given a limit."""

            def __sub__(self, _: Any) -> Any:
                return "limit"

        carried = SimpleNamespace(speed=Speed("carried", ask))
        moving = SimpleNamespace(speed=Speed("moving", ask))
        turning = "turning" if ask("turns") else None
        expected: dict[str, tuple[object, object]] = {"tool-turning": ("turning", "turning limits")}

        def rates_of(of: object, limit: object) -> Any:
            if of is not arm or limit != "limit":
                raise ValueError("tool")
            return "relative", turning

        put_aside(
            module,
            base_rates=lambda *given: carried if given == (base.base_path, base.duration) else None,
            _tool_rates=rates_of,
            add_rates=lambda *given: moving if given == ("relative", carried) else None,
            _limit_violations=_limit_stub(ask, expected),
            min=lambda values: values[0],
            Reason=lambda *given: given,
        )
        made = object.__new__(module.MotionDecider)
        limits = SimpleNamespace(speed=Speed("limit", ask))
        made._moving, made._turning = limits, "turning limits"
        expected["tool"] = (moving, limits)
        kinds = {
            f"kind {name}": SimpleNamespace(peak_speed="peak" if ask(f"{name}.names-speed") else None)
            for name in _MOTIONS
        }
        number = 1 if ask("is-alone") else len(_MOTIONS)
        # Motions under way may stand in any order.
        order = _MOTIONS if ask("in-order") else _MOTIONS[::-1]
        motions = [
            (Action(f"kind {name}", {"peak": Speed(f"{name}.speed", ask), "other": None}), plans[name])
            for name in (order if number > 1 else _MOTIONS[:1])
        ]
        merged = SimpleNamespace(joints=SimpleNamespace(motion=arm), base=SimpleNamespace(motion=base))
        policy = SimpleNamespace(kinds=kinds)
        return is_nothing(made._tool_too_fast(policy, motions, merged))

    claims = ["tool.in-limits", "(=> turns tool-turning.in-limits)"]
    for name in _MOTIONS:
        arm = {"new": "arm-is-new", "old": "(not arm-is-new)"}.get(name, "false")
        base = {"new": "base-is-new", "old": "(not base-is-new)"}.get(name, "false")
        asked = f"{name}.names-speed" if name == "new" else f"(and (not is-alone) {name}.names-speed)"
        reached = f"(ite {arm} moving (ite {base} carried (finite 0.0)))"
        claims.append(smt_implies(asked, f"(at-most {reached} {name}.speed)"))
    return nothing_obligation(
        "`_tool_too_fast` is empty exactly where the tool, carried by the base, and its turning are in\n"
        "the site's limits; and where each action that names a speed is not exceeded, by the tool if its\n"
        "motion moves the joints, else by the base if it moves the base.",
        (
            *NUMBERS,
            *declare_numbers("carried", "moving", "limit", *(f"{name}.speed" for name in _MOTIONS)),
            *declare_truths("arm-is-new", "base-is-new", "turns", "is-alone", "in-order"),
            *declare_truths("tool.in-limits", "tool-turning.in-limits"),
            *declare_truths(*(f"{name}.names-speed" for name in _MOTIONS)),
        ),
        smt_and(claims),
        run,
        **{
            "bounds-are-numbers": "(and ((_ is finite) carried) ((_ is finite) moving))",
            **{f"{name}-speed-is-a-number": f"((_ is finite) {name}.speed)" for name in _MOTIONS},
        },
    )


def base_speed_obligation(code: ModuleSource) -> TheoremObligation:
    """With the bounds of the base put aside."""
    module = trajectory_module(code)

    def run(ask: DecideBranch) -> str:
        rates = object()
        limits = module.MotionRates("speed", "acceleration", float("inf"))
        motion = SimpleNamespace(base_path="way", duration="time")

        def base_rates(*given: object) -> object:
            return rates if given == ("way", "time") else None

        vars(module)["base_rates"] = base_rates
        vars(module)["_limit_violations"] = _limit_stub(ask, {"base": (rates, limits)})
        policy = SimpleNamespace(base_limits=("speed", "acceleration") if ask("has-limits") else None)
        merged = SimpleNamespace(base=SimpleNamespace(motion=motion), joints=None)
        return is_nothing(module._base_too_fast(policy, merged))

    return nothing_obligation(
        "`_base_too_fast` is empty exactly where the rates of the base are in the site's limits, if it\n"
        "has some.",
        declare_truths("has-limits", "base.in-limits"),
        "(=> has-limits base.in-limits)",
        run,
    )
