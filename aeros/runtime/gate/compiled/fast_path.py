"""The short way to a decision: one generated function per skill and action kind, silent where in doubt.

What it answers, the full way of the gate decides, with the same action and reasons.  It reads each value
once, checks its form, and evaluates the envelope and what the proof left over in the same function, on
local variables.  Where these or a quota object, it finds every condition that does not hold, those that
are proved too; the denial for each such finding is made once and kept.  Where anything else is in doubt
it has no answer.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from aeros.runtime.gate.compiled.codegen import EXACT_INTEGERS, FunctionWriter
from aeros.runtime.gate.compiled.snapshots import SnapshotCache
from aeros.runtime.gate.decision import Caller, Decision, DecisionKind
from aeros.runtime.gate.value_check import Scalars, ValueChecker
from aeros.runtime.ports import Snapshot
from aeros.skill import Action
from aeros.spec.backends.compiled import CompiledConditions
from aeros.spec.expr import terms as t
from aeros.spec.model.model import Quota

_MAX_CACHED_DENIALS = 1024

FastDecide = Callable[[Any, Any, Any, Any, Any], Decision | Scalars | None]
"""From inputs, readings, parameters, now and usage to the decision; or the values, if rules object that may
leave a reduced action; None where it cannot tell."""

ReadEach = Callable[[Any, Any, float], tuple[Any, ...] | None]
"""From readings, now, and now as a double to the scalars of those that are required, in the order of
`_scalars_of`; None where it cannot tell, or raises as `FastDecide` may inside."""

DenialFor = Callable[[tuple[bool, ...]], Decision | None]
"""From whether each condition holds (the quotas on the kind, in their order, envelope, permission, the rules
of Φ) to the denial; None where the rules that object may leave a reduced action."""


@dataclass(frozen=True)
class DecisionCriteria:
    """What decides one skill's actions of one kind, apart from form.

    allows: whether anything is allowed at all.
    left: what else has to be evaluated for ALLOW, as the proof did not show that the envelope implies it.
    rules: what Φ says of the kind, all of it.
    """

    can_allow: bool
    envelope: t.Term
    permission: t.Term
    residual: t.Term
    rule_conditions: CompiledConditions
    denial_for: DenialFor


def decide_fast(
    functions: Mapping[tuple[str, str, str], FastDecide],
    caller: Any,
    readings: Any,
    action: Any,
    now: Any,
    usage: Any,
) -> Decision | Scalars | None:
    """The answer of the function of this module, skill and action kind; None without one; never raises."""
    if type(caller) is not Caller or type(action) is not Action or len(action) != 2:
        return None
    kind, parameters = action
    try:
        module, skill, inputs = caller.module, caller.skill, caller.inputs
    except AttributeError:
        return None
    # A subclass of `str` could bring its own comparison.
    if type(module) is not str or type(skill) is not str or type(kind) is not str:
        return None
    function = functions.get((module, skill, kind))
    return None if function is None else function(inputs, readings, parameters, now, usage)


def compile_read_each(state: Mapping[str, ValueChecker], required: frozenset[str]) -> ReadEach:
    """Takes readings that each have their own time; many skills and kinds require the same of them.

    required: the state variables that must be there, and fresh.
    """
    writer = _FastPathWriter()
    writer.write_read_each(state, required)
    return writer.build_read_each(_scalars_of(state, required))


def _scalars_of(state: Mapping[str, ValueChecker], required: frozenset[str]) -> list[str]:
    return [scalar for name in sorted(required) for scalar in state[name].names]


def compile_fast_path(
    criteria: DecisionCriteria,
    *,
    inputs: Mapping[str, ValueChecker],
    state: Mapping[str, ValueChecker],
    snapshot_cache: SnapshotCache,
    read_each: ReadEach,
    required: frozenset[str],
    parameters: Mapping[str, ValueChecker],
    quotas: Sequence[Quota],
    kind: str,
) -> FastDecide:
    """The short way of one skill's actions of one kind.

    one_by_one: takes readings that are no moment, with the same state and the same required.
    required: the state variables that must be there, and fresh.
    quotas: those of the site, on this kind and on others.
    """
    writer = _FastPathWriter()
    unused = writer.write_usage(quotas, kind)
    writer.write_time()
    writer.write_arguments("inputs", {name.removeprefix("inputs."): form for name, form in inputs.items()})
    executed = writer.write_arguments("parameters", parameters)
    writer.write_readings(state, required, snapshot_cache, read_each)
    read = [*inputs.values(), *parameters.values(), *(state[name] for name in sorted(required))]
    envelope, permission, left = writer.condition_codes(
        [criteria.envelope, criteria.permission, criteria.residual],
        [form.declared for form in (*inputs.values(), *state.values(), *parameters.values())],
    )
    writer.add_line(f"inside = {envelope}")
    if criteria.can_allow:
        writer.write_allow(" and ".join((*unused, "inside", left)), kind, executed)
    writer.write_deny(
        [*unused, "inside", permission], criteria, [name for form in read for name in form.names]
    )
    return writer.build_function()


class _FastPathWriter(FunctionWriter):
    """Writes the body line by line; each check that fails leaves without an answer."""

    def write_usage(self, quotas: Sequence[Quota], kind: str) -> list[str]:
        """Counts for quotas of the site, with those on the kind among them; code for whether each is left."""
        known = tuple(quota.id for quota in quotas)
        self._mapping("usage", None if known else 0)
        if known:
            self.add_line("for name, used in usage.items():")
            self.add_line(f"  if name not in {known!r} or type(used) is not int or used < 0: return None")
        left: list[str] = []
        for quota in quotas:
            if kind in quota.kinds:
                left.append(f"left{len(left)}")
                self.add_line(f"{left[-1]} = usage[{quota.id!r}] < {quota.max_count}")
        return left

    def write_time(self) -> None:
        """Now, as a double."""
        self.add_line("exactly = now if type(now) is float else whole(now)")
        self.write_guard(f"{-EXACT_INTEGERS} <= exactly <= {EXACT_INTEGERS}")

    def write_arguments(self, mapping: str, checkers: Mapping[str, ValueChecker]) -> str:
        """Exactly these inputs or parameters; code for the mapping of what is then executed."""
        self._mapping(mapping, len(checkers))
        executed = [
            f"{name!r}: {self.write_unpack(form, f'{mapping}[{name!r}]')}" for name, form in checkers.items()
        ]
        return "{" + ", ".join(executed) + "}"

    def write_readings(
        self,
        checkers: Mapping[str, ValueChecker],
        required: frozenset[str],
        snapshot_cache: SnapshotCache,
        read_each: ReadEach,
    ) -> None:
        """The required readings and any of the others, all well-formed, and nothing else."""
        scalars = _scalars_of(checkers, required)
        self.local |= {scalar: f"x{len(self.local) + place}" for place, scalar in enumerate(scalars)}
        self.names |= {"Moment": Snapshot, "scalars": snapshot_cache.scalars, "one_by_one": read_each}
        self.add_line("if type(readings) is Moment:")
        start = len(self.lines)
        self._write_snapshot(checkers, required)
        self.indent(start)
        self.add_line("else:")
        start = len(self.lines)
        self.add_line("several = one_by_one(readings, now, exactly)")
        self.write_guard("several is not None")
        if scalars:
            self.add_line(f"{self._listed(scalars)} = several")
        self.indent(start)

    def _write_snapshot(self, checkers: Mapping[str, ValueChecker], required: frozenset[str]) -> None:
        """The same of readings that share one time."""
        self.add_line("taken = scalars(readings)")
        self.write_guard("taken is not None")
        self.add_line("time = readings.time if type(readings.time) is float else whole(readings.time)")
        self.write_guard(f"{-EXACT_INTEGERS} <= time <= exactly")
        limits = [
            checkers[name].surely_fresh for name in required if checkers[name].declared.max_age is not None
        ]
        if limits:
            self.write_guard(f"exactly - time < {min(limits)!r}")
        for name in sorted(required):
            for scalar in checkers[name].names:
                self.add_line(f"{self.local[scalar]} = taken[{scalar!r}]")

    def write_read_each(self, checkers: Mapping[str, ValueChecker], required: frozenset[str]) -> None:
        """The same of readings that have a time each; `measured` is that of the one looked at last."""
        self.add_line("measured, age = now, 0.0")
        self._mapping("readings", None)
        self.add_line(f"others = len(readings) - {len(required)}")
        for name in sorted(required):
            self.add_line(f"reading = readings[{name!r}]")
            self.write_reading(checkers[name])
            if checkers[name].declared.max_age is not None:
                self.write_guard(f"age < {checkers[name].surely_fresh!r}")
        for name in sorted(checkers.keys() - required):
            self.add_line(f"if {name!r} in readings:")
            start = len(self.lines)
            self.add_line("others -= 1")
            self.add_line(f"reading = readings[{name!r}]")
            self.write_reading(checkers[name])
            self.indent(start)
        self.write_guard("not others")

    def write_allow(self, condition: str, kind: str, executed: str) -> None:
        """ALLOW, with what is `executed`, where the condition holds."""
        # A named tuple's own constructor takes twice as long.
        self.names |= {
            "Action": Action,
            "ALLOW": DecisionKind.ALLOW,
            "Decision": Decision,
            "new": tuple.__new__,
        }
        action = f"new(Action, ({kind!r}, {executed}))"
        self.add_line(f"if {condition}: return new(Decision, (ALLOW, {action}, ()))")

    def write_deny(self, conditions: Sequence[str], criteria: DecisionCriteria, read: Sequence[str]) -> None:
        """The denial for what of these conditions and of the rules does not hold, or the values `read`."""
        self.names |= {
            "rules": criteria.rule_conditions.evaluate,
            "denying": lru_cache(_MAX_CACHED_DENIALS)(criteria.denial_for),
        }
        of_rules = ", ".join(self.local[name] for name in criteria.rule_conditions.argument_names)
        self.add_line(f"denied = denying(({', '.join(conditions)}, *rules({of_rules})))")
        values = ", ".join(f"{name!r}: {self.local[name]}" for name in read)
        self.add_line(f"return {{{values}}} if denied is None else denied")

    def build_function(self) -> FastDecide:
        """The function that has been written."""
        self.indent(0)
        head = ["def answering(inputs, readings, parameters, now, usage):", "  try:"]
        tail = ["  except (AttributeError, IndexError, KeyError):", "    return None"]
        return self.compile_function("answering", [*head, *self.lines, *tail])

    def build_read_each(self, scalars: Sequence[str]) -> ReadEach:
        """The function that has been written, which gives these."""
        self.add_line(f"return ({self._listed(scalars) if scalars else ''})")
        return self.compile_function("taking", ["def taking(readings, now, exactly):", *self.lines])

    def _listed(self, scalars: Sequence[str]) -> str:
        return ", ".join(self.local[scalar] for scalar in scalars) + ","

    def _mapping(self, name: str, size: int | None) -> None:
        if size == 0:
            self.write_guard(f"type({name}) is dict and not {name}")
            return
        counted = "" if size is None else f" and len({name}) == {size}"
        self.write_guard(f"type({name}) is dict{counted}")
        self.add_line(f"for key in {name}:")
        self.add_line("  if type(key) is not str: return None")
