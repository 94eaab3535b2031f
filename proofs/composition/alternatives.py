"""Alternatives and tries of a part run one after the other, each after declared failures alone."""

from __future__ import annotations

from collections.abc import Generator
from functools import partial
from types import SimpleNamespace
from typing import Any, Final

from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.smtlib import smt_and, smt_literal, smt_or
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation

ALTERNATIVES: Final = "aeros.agent.execution.alternatives"
PROGRESS: Final = "aeros.agent.execution.progress"

_COUNT: Final = 3
_AT: Final = (7,)


def alternatives_in_order(code: ModuleSource) -> TheoremObligation:
    """Of three alternatives, each with any end, of which any may have failed before a crash.

    Args:
        code: the shipped modules, or copies with a fault.

    Returns:
        The obligation.
    """
    progress = code.module(PROGRESS)
    alternatives = code.module(ALTERNATIVES, using=(progress,))

    def facts(ask: DecideBranch) -> dict[str, bool]:
        kept = progress.PlanProgress()
        for number in range(_COUNT):
            if ask(f"failed-before-{number}"):
                kept.mark_failed(_AT, number)
        found = {f"started-{number}": False for number in range(_COUNT)} | {"unmarked": False}
        cancelled = [False]

        def alternative(number: int) -> Generator[None, Any, Any]:
            found["unmarked"] |= not all(kept.has_failed(_AT, one) for one in range(number))
            found["unmarked"] |= found[f"started-{number}"]
            found[f"started-{number}"] = True
            cancelled[0] = cancelled[0] or ask(f"cancelled-in-{number}")
            yield
            return (
                None if ask(f"succeeds-{number}") else SimpleNamespace(is_declared=ask(f"declared-{number}"))
            )

        starts = [partial(alternative, number) for number in range(_COUNT)]
        running = alternatives.run_alternatives(starts, _AT, kept, lambda: cancelled[0])
        while True:
            try:
                next(running)
            except StopIteration as done:
                return {**found, "succeeds": done.value is None}

    def table(name: str) -> SymbolicFunction:
        return SymbolicFunction(
            name,
            "Bool",
            execute_symbolically(lambda ask: smt_literal(facts(ask)[name.removeprefix("part-")])),
        )

    def goes_on(number: int) -> str:
        ended = smt_and(
            [
                f"started-{number}",
                f"(not succeeds-{number})",
                f"declared-{number}",
                f"(not cancelled-in-{number})",
            ]
        )
        return smt_or([f"failed-before-{number}", ended])

    is_last = _COUNT - 1
    claims = []
    for number in range(_COUNT):
        due = smt_and([goes_on(one) for one in range(number)])
        unless = "true" if number == is_last else f"(not failed-before-{number})"
        claims.append(f"(= started-{number} (and {due} {unless}))")
    succeeded = smt_or([f"(and started-{number} succeeds-{number})" for number in range(_COUNT)])
    return TheoremObligation(
        "`run_alternatives` starts an alternative exactly if each one before it has failed as it declares,\n"
        "now or before a crash, and nothing was cancelled; each once, and after the failures before it are\n"
        "kept.  It succeeds exactly if one that it started has.",
        tuple(
            f"(declare-const {name}-{number} Bool)"
            for number in range(_COUNT)
            for name in ("failed-before", "cancelled-in", "succeeds", "declared")
        ),
        smt_and([*claims, "(not unmarked)", f"(= part-succeeds {succeeded})"]),
        tables=tuple(
            table(name)
            for name in (*(f"started-{number}" for number in range(_COUNT)), "unmarked", "part-succeeds")
        ),
    )
