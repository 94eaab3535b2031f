"""The comparison of a motion's start and end with what is measured and what is asked for, explored."""

from __future__ import annotations

from fractions import Fraction
from types import SimpleNamespace
from typing import Any, Final

from aeros.skill import Action
from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.smtlib import smt_and, smt_implies, smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch
from aeros.spec.theorems.theorem import TheoremObligation
from proofs.motion_limits.motion_rates import (
    JOINTS,
    NUMBERS,
    OPERATIONS,
    Measure,
    declare_numbers,
    declare_truths,
    is_nothing,
    nothing_obligation,
    put_aside,
    trajectory_module,
)


def _measures(ask: DecideBranch, name: str) -> tuple[Measure, ...]:
    return tuple(Measure(f"{name}.{joint}", ask) for joint in JOINTS)


def _largest(values: Any) -> Measure:
    """Stands for `max` of doubles that are numbers."""
    first, *others = values
    for one in others:
        first = max(first, one)
    return Measure(first.name, first.ask)


def _off(name: str, other: str) -> str:
    return f"(size-of (minus {name} {other}))"


def start_obligation(code: ModuleSource) -> TheoremObligation:
    """Of an arm of three joints."""
    module = trajectory_module(code, max=_largest)

    def run(ask: DecideBranch) -> str:
        policy = SimpleNamespace(
            start_variable="joints", start_tolerance=Measure("tolerance", ask), is_mixed=False
        )
        measured = SimpleNamespace(value=_measures(ask, "measured"))
        readings = {"joints": measured} if ask("is-measured") else {"other": measured}
        return is_nothing(module._start_mismatch(policy, _measures(ask, "start"), readings, "it starts"))

    claims = [f"(at-most {_off(f'start.{n}', f'measured.{n}')} tolerance)" for n in JOINTS]
    finite = smt_and(
        (
            "((_ is finite) tolerance)",
            *(f"((_ is finite) {_off(f'start.{n}', f'measured.{n}')})" for n in JOINTS),
        )
    )
    return nothing_obligation(
        "`_start_mismatch` is empty exactly where the joints are measured, and each is within the site's\n"
        "tolerance of where the motion has it.",
        (
            *NUMBERS,
            *OPERATIONS,
            *declare_numbers("tolerance", *(f"{of}.{n}" for of in ("start", "measured") for n in JOINTS)),
            *declare_truths("is-measured"),
        ),
        smt_and(("is-measured", *claims)),
        run,
        **{"numbers-of-a-formed-motion-are-finite": finite},
    )


def base_obligation(code: ModuleSource) -> TheoremObligation:
    """With distances put aside."""
    module = trajectory_module(code)

    def run(ask: DecideBranch) -> str:
        put_aside(module, dist=lambda *given: Measure("off", ask) if given == ("base", "measured") else None)
        tracking = SimpleNamespace(bound=Measure("bound", ask)) if ask("is-bounded") else None
        policy = SimpleNamespace(base_variable="base at" if ask("is-named") else None, tracking=tracking)
        readings = {"base at": SimpleNamespace(value="measured")} if ask("is-measured") else {}
        return is_nothing(module._base_mismatch(policy, "base", readings))

    return nothing_obligation(
        "`_base_mismatch` is empty exactly where the base is measured within the bound on tracking of\n"
        "where the motion has it, if the site measures the base and bounds the distance.",
        (
            *NUMBERS,
            *declare_numbers("off", "bound"),
            *declare_truths("is-bounded", "is-named", "is-measured"),
        ),
        "(=> (and is-bounded is-named) (and is-measured (at-most off bound)))",
        run,
        **{"a-distance-is-a-number": "(and ((_ is finite) off) ((_ is finite) bound))"},
    )


_ROUNDING: Final = f"(finite {smt_literal(Fraction(1e-6))})"
"""Distance of a joint from its target that rounding explains: 1 µrad."""

_TARGETS: Final = ("tool", "joints", "base")


def end_obligation(code: ModuleSource) -> TheoremObligation:
    """With distances put aside; any of them may be not a number."""
    module = trajectory_module(code)

    def run(ask: DecideBranch) -> str:
        def dist(*given: object) -> Measure:
            known: dict[object, Measure] = {
                ("tool at end", "tool target"): Measure("tool-off", ask),
                (("x at end", "y at end"), ("x target", "y target")): Measure("base-off", ask),
            }
            return known[given]

        put_aside(module, dist=dist, max=lambda values: Measure("largest", ask))
        kind = SimpleNamespace(
            tool_target="t" if ask("tool.has-target") else None,
            joint_target=tuple(f"q{n}" for n in JOINTS) if ask("joints.has-target") else None,
            base_target=("x", "y") if ask("base.has-target") else None,
        )
        targets = {f"q{n}": Measure(f"target.{n}", ask) for n in JOINTS}
        parameters = {"t": "tool target", "x": "x target", "y": "y target", **targets}
        columns = ("no", "no", "no", _measures(ask, "end"))
        path = (("no",) * 4, columns)
        merged = SimpleNamespace(
            tool_at_end=lambda: "tool at end",
            base_at_end=lambda: ("x at end", "y at end", "z at end"),
            joints=SimpleNamespace(motion=SimpleNamespace(joint_paths=(path, "no"))),
        )
        policy = SimpleNamespace(
            kinds={"move": kind, "grip": None}, end_tolerance=Measure("tolerance", ask), is_mixed=True
        )
        return is_nothing(module._end_mismatch(policy, Action("move", parameters), merged, "it ends"))

    joints = smt_and(f"(at-most {_off(f'end.{n}', f'target.{n}')} {_ROUNDING})" for n in JOINTS)
    return nothing_obligation(
        "`_end_mismatch` is empty exactly where tool, joints and base end within the tolerance of the\n"
        "targets that the action's kind names, when all motions are over; never where a distance is not a\n"
        "number.",
        (
            *NUMBERS,
            *OPERATIONS,
            *declare_numbers("tolerance", "tool-off", "base-off", "largest"),
            *declare_numbers(*(f"{of}.{n}" for of in ("end", "target") for n in JOINTS)),
            *declare_truths(*(f"{part}.has-target" for part in _TARGETS)),
        ),
        smt_and(
            (
                smt_implies("tool.has-target", "(at-most tool-off tolerance)"),
                smt_implies("joints.has-target", joints),
                smt_implies("base.has-target", "(at-most base-off tolerance)"),
            )
        ),
        run,
    )
