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

from aeros.runtime.gate.compiled.codegen import EXACT_INTEGERS, Writer
from aeros.runtime.gate.compiled.snapshots import MomentTaker
from aeros.runtime.gate.decision import Caller, Decision, Verdict
from aeros.runtime.gate.value_check import Form, Scalars
from aeros.runtime.ports import Moment
from aeros.skill import Action
from aeros.spec.backends.compiled import Truths
from aeros.spec.expr import terms as t
from aeros.spec.model.model import Quota

_KEPT_DENIALS = 1024

Answering = Callable[[Any, Any, Any, Any, Any], Decision | Scalars | None]
"""From inputs, readings, parameters, now and usage to the decision; or the values, if rules object that may
leave a reduced action; None where it cannot tell."""

OneByOne = Callable[[Any, Any, float], tuple[Any, ...] | None]
"""From readings, now, and now as a double to the scalars of those that are required, in the order of
`_scalars_of`; None where it cannot tell, or raises as `Answering` may inside."""

Denying = Callable[[tuple[bool, ...]], Decision | None]
"""From whether each condition holds (the quotas on the kind, in their order, envelope, permission, the rules
of Φ) to the denial; None where the rules that object may leave a reduced action."""


@dataclass(frozen=True)
class Criteria:
    """What decides one skill's actions of one kind, apart from form.

    allows: whether anything is allowed at all.
    left: what else has to be evaluated for ALLOW, as the proof did not show that the envelope implies it.
    rules: what Φ says of the kind, all of it.
    """

    allows: bool
    envelope: t.Term
    permission: t.Term
    left: t.Term
    rules: Truths
    denying: Denying


def decide_straight(
    functions: Mapping[tuple[str, str, str], Answering],
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


def compile_one_by_one(state: Mapping[str, Form], required: frozenset[str]) -> OneByOne:
    """Takes readings that each have their own time; many skills and kinds require the same of them.

    required: the state variables that must be there, and fresh.
    """
    writer = _Writer()
    writer.one_by_one(state, required)
    return writer.taking_one_by_one(_scalars_of(state, required))


def _scalars_of(state: Mapping[str, Form], required: frozenset[str]) -> list[str]:
    return [scalar for name in sorted(required) for scalar in state[name].names]


def compile_straight(
    criteria: Criteria,
    *,
    inputs: Mapping[str, Form],
    state: Mapping[str, Form],
    moments: MomentTaker,
    one_by_one: OneByOne,
    required: frozenset[str],
    parameters: Mapping[str, Form],
    quotas: Sequence[Quota],
    kind: str,
) -> Answering:
    """The short way of one skill's actions of one kind.

    one_by_one: takes readings that are no moment, with the same state and the same required.
    required: the state variables that must be there, and fresh.
    quotas: those of the site, on this kind and on others.
    """
    writer = _Writer()
    unused = writer.usage(quotas, kind)
    writer.time()
    writer.given("inputs", {name.removeprefix("inputs."): form for name, form in inputs.items()})
    executed = writer.given("parameters", parameters)
    writer.readings(state, required, moments, one_by_one)
    read = [*inputs.values(), *parameters.values(), *(state[name] for name in sorted(required))]
    envelope, permission, left = writer.conditions(
        [criteria.envelope, criteria.permission, criteria.left],
        [form.declared for form in (*inputs.values(), *state.values(), *parameters.values())],
    )
    writer.line(f"inside = {envelope}")
    if criteria.allows:
        writer.allow(" and ".join((*unused, "inside", left)), kind, executed)
    writer.deny([*unused, "inside", permission], criteria, [name for form in read for name in form.names])
    return writer.answering()


class _Writer(Writer):
    """Writes the body line by line; each check that fails leaves without an answer."""

    def usage(self, quotas: Sequence[Quota], kind: str) -> list[str]:
        """Counts for quotas of the site, with those on the kind among them; code for whether each is left."""
        known = tuple(quota.id for quota in quotas)
        self._mapping("usage", None if known else 0)
        if known:
            self.line("for name, used in usage.items():")
            self.line(f"  if name not in {known!r} or type(used) is not int or used < 0: return None")
        left: list[str] = []
        for quota in quotas:
            if kind in quota.kinds:
                left.append(f"left{len(left)}")
                self.line(f"{left[-1]} = usage[{quota.id!r}] < {quota.at_most}")
        return left

    def time(self) -> None:
        """Now, as a double."""
        self.line("exactly = now if type(now) is float else whole(now)")
        self.require(f"{-EXACT_INTEGERS} <= exactly <= {EXACT_INTEGERS}")

    def given(self, mapping: str, forms: Mapping[str, Form]) -> str:
        """Exactly these inputs or parameters; code for the mapping of what is then executed."""
        self._mapping(mapping, len(forms))
        executed = [f"{name!r}: {self.take(form, f'{mapping}[{name!r}]')}" for name, form in forms.items()]
        return "{" + ", ".join(executed) + "}"

    def readings(
        self,
        forms: Mapping[str, Form],
        required: frozenset[str],
        moments: MomentTaker,
        one_by_one: OneByOne,
    ) -> None:
        """The required readings and any of the others, all well-formed, and nothing else."""
        scalars = _scalars_of(forms, required)
        self.local |= {scalar: f"x{len(self.local) + place}" for place, scalar in enumerate(scalars)}
        self.names |= {"Moment": Moment, "scalars": moments.scalars, "one_by_one": one_by_one}
        self.line("if type(readings) is Moment:")
        start = len(self.lines)
        self._moment(forms, required)
        self.indent(start)
        self.line("else:")
        start = len(self.lines)
        self.line("several = one_by_one(readings, now, exactly)")
        self.require("several is not None")
        if scalars:
            self.line(f"{self._listed(scalars)} = several")
        self.indent(start)

    def _moment(self, forms: Mapping[str, Form], required: frozenset[str]) -> None:
        """The same of readings that share one time."""
        self.line("taken = scalars(readings)")
        self.require("taken is not None")
        self.line("time = readings.time if type(readings.time) is float else whole(readings.time)")
        self.require(f"{-EXACT_INTEGERS} <= time <= exactly")
        limits = [forms[name].surely_fresh for name in required if forms[name].declared.max_age is not None]
        if limits:
            self.require(f"exactly - time < {min(limits)!r}")
        for name in sorted(required):
            for scalar in forms[name].names:
                self.line(f"{self.local[scalar]} = taken[{scalar!r}]")

    def one_by_one(self, forms: Mapping[str, Form], required: frozenset[str]) -> None:
        """The same of readings that have a time each; `measured` is that of the one looked at last."""
        self.line("measured, age = now, 0.0")
        self._mapping("readings", None)
        self.line(f"others = len(readings) - {len(required)}")
        for name in sorted(required):
            self.line(f"reading = readings[{name!r}]")
            self.reading(forms[name])
            if forms[name].declared.max_age is not None:
                self.require(f"age < {forms[name].surely_fresh!r}")
        for name in sorted(forms.keys() - required):
            self.line(f"if {name!r} in readings:")
            start = len(self.lines)
            self.line("others -= 1")
            self.line(f"reading = readings[{name!r}]")
            self.reading(forms[name])
            self.indent(start)
        self.require("not others")

    def allow(self, condition: str, kind: str, executed: str) -> None:
        """ALLOW, with what is `executed`, where the condition holds."""
        # A named tuple's own constructor takes twice as long.
        self.names |= {"Action": Action, "ALLOW": Verdict.ALLOW, "Decision": Decision, "new": tuple.__new__}
        action = f"new(Action, ({kind!r}, {executed}))"
        self.line(f"if {condition}: return new(Decision, (ALLOW, {action}, ()))")

    def deny(self, conditions: Sequence[str], criteria: Criteria, read: Sequence[str]) -> None:
        """The denial for what of these conditions and of the rules does not hold, or the values `read`."""
        self.names |= {"rules": criteria.rules.at, "denying": lru_cache(_KEPT_DENIALS)(criteria.denying)}
        of_rules = ", ".join(self.local[name] for name in criteria.rules.read)
        self.line(f"denied = denying(({', '.join(conditions)}, *rules({of_rules})))")
        values = ", ".join(f"{name!r}: {self.local[name]}" for name in read)
        self.line(f"return {{{values}}} if denied is None else denied")

    def answering(self) -> Answering:
        """The function that has been written."""
        self.indent(0)
        head = ["def answering(inputs, readings, parameters, now, usage):", "  try:"]
        tail = ["  except (AttributeError, IndexError, KeyError):", "    return None"]
        return self.function("answering", [*head, *self.lines, *tail])

    def taking_one_by_one(self, scalars: Sequence[str]) -> OneByOne:
        """The function that has been written, which gives these."""
        self.line(f"return ({self._listed(scalars) if scalars else ''})")
        return self.function("taking", ["def taking(readings, now, exactly):", *self.lines])

    def _listed(self, scalars: Sequence[str]) -> str:
        return ", ".join(self.local[scalar] for scalar in scalars) + ","

    def _mapping(self, name: str, size: int | None) -> None:
        if size == 0:
            self.require(f"type({name}) is dict and not {name}")
            return
        counted = "" if size is None else f" and len({name}) == {size}"
        self.require(f"type({name}) is dict{counted}")
        self.line(f"for key in {name}:")
        self.line("  if type(key) is not str: return None")
