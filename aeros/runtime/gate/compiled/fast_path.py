"""The gate's fast path: one generated function per skill and action kind, which has no answer when in doubt.

Where it answers, it decides as the slow path does, with the same action and reasons. It reads each value
once, checks its form, and evaluates the envelope and the residual conditions in the same function, on local
variables. If these or a quota fail, it evaluates every condition, also the proved ones, and finds the denial
for the combination of failed conditions in a cache. If anything else is in doubt it returns no answer.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import compress, count
from operator import is_not
from typing import Any, NamedTuple

from aeros.runtime.gate.compiled.codegen import EXACT_INTEGERS, FunctionWriter, double_of
from aeros.runtime.gate.decision import Caller, Decision, DecisionKind
from aeros.runtime.gate.request_check import snapshot_columns
from aeros.runtime.gate.value_check import Scalars, ValueChecker
from aeros.runtime.ports import ColumnNames, Snapshot
from aeros.skill import Action
from aeros.spec.backends.compiled import CompiledConditions
from aeros.spec.expr import terms as t
from aeros.spec.model.policy import Quota

_MAX_CACHED_DENIALS = 1024

FastDecide = Callable[[Any, Any, Any, Any, Any], Decision | Scalars | None]
"""Function from inputs, readings, parameters, now and usage to the decision.

It returns the scalars instead if the failed rules may leave a reduced action, and None if it cannot tell.
"""

ReadEach = Callable[[Any, Any, float], tuple[Any, ...] | None]
"""Function from readings, now, and now as a double to the scalars of the required readings.

The scalars are in the order of `_scalars_of`. It returns None if it cannot tell; exceptions that `FastDecide`
catches may leave it.
"""

DenialFor = Callable[[tuple[bool, ...]], Decision | None]
"""Function from the truth of each condition to the denial.

The conditions are the quotas on the kind in their order, the envelope, the permission and the rules of Φ. It
returns None if the failed rules may leave a reduced action.
"""


@dataclass(frozen=True)
class DecisionCriteria:
    """The conditions that decide one skill's actions of one kind, apart from the form of values.

    Attributes:
        can_allow: False if the finite layers deny every such action.
        envelope: the skill's envelope of the kind.
        permission: the module's permission of the kind.
        residual: the conditions, besides the envelope, that must be evaluated for ALLOW because the proof
            did not show that the envelope implies them.
        rule_conditions: all rules of Φ on the kind.
        denial_for: makes the denial for the conditions that failed.
    """

    can_allow: bool
    envelope: t.Term
    permission: t.Term
    residual: t.Term
    rule_conditions: CompiledConditions
    denial_for: DenialFor


class FastPaths(dict[tuple[str, str, str], FastDecide]):
    """Generated functions by module, skill and action kind, each compiled when it is first called.

    A run asks a quarter of the functions of its site, and each takes some 4 ms to compile.
    """

    def __init__(self) -> None:
        super().__init__()
        self._compilers: dict[tuple[str, str, str], Callable[[], FastDecide]] = {}

    def add(self, at: tuple[str, str, str], compiler: Callable[[], FastDecide]) -> None:
        """Add a function that its first call compiles.

        Args:
            at: module, skill and action kind.
            compiler: compiles the function.
        """

        def compile_first(inputs: Any, readings: Any, parameters: Any, now: Any, usage: Any) -> Any:
            return self.compile(at)(inputs, readings, parameters, now, usage)

        self._compilers[at] = compiler
        self[at] = compile_first

    def compile(self, at: tuple[str, str, str]) -> FastDecide:
        """Compile a function that was added, and keep it.

        Args:
            at: module, skill and action kind.

        Returns:
            The function.
        """
        function = self[at] = self._compilers[at]()
        return function


def decide_fast(
    functions: Mapping[tuple[str, str, str], FastDecide],
    caller: Any,
    readings: Any,
    action: Any,
    now: Any,
    usage: Any,
) -> Decision | Scalars | None:
    """Decide a request with its generated function; never raises.

    Args:
        functions: the functions by module, skill and action kind.
        caller: should be a `Caller`.
        readings: should be readings by name.
        action: should be an `Action`.
        now: should be a time, s.
        usage: should be counts by quota id.

    Returns:
        The answer of the function for this module, skill and kind; None if there is no such function or the
        request is malformed.
    """
    if type(caller) is not Caller or type(action) is not Action or len(action) != 2:
        return None
    kind, parameters = action
    try:
        module, skill, inputs = caller.module, caller.skill, caller.inputs
    except AttributeError:
        return None
    # A subclass of `str` could have a comparison of its own.
    if type(module) is not str or type(skill) is not str or type(kind) is not str:
        return None
    function = functions.get((module, skill, kind))
    return None if function is None else function(inputs, readings, parameters, now, usage)


def compile_read_each(
    state: Mapping[str, ValueChecker],
    required: frozenset[str],
    module_variables: frozenset[str] = frozenset(),
) -> ReadEach:
    """Compile a reader of readings with a time each, shared by skills and kinds with equal needs.

    Args:
        state: the checkers of the site's state variables, by name.
        required: the state variables that must be present and fresh.
        module_variables: those that count only if they are required.

    Returns:
        The reader.
    """
    writer = _FastPathWriter()
    writer.write_read_each(state, required, module_variables)
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
    """Compile the fast path for one skill's actions of one kind.

    Args:
        criteria: the conditions.
        inputs: the checkers of the skill's inputs, by name in expressions.
        state: the checkers of the site's state variables, by name.
        snapshot_cache: unpacks readings that are a `Snapshot`.
        read_each: unpacks other readings, with the same `state` and `required`.
        required: the state variables that must be present and fresh.
        parameters: the checkers of the kind's parameters, by name.
        quotas: all quotas of the site, on this kind or on others.
        kind: the action kind.

    Returns:
        The function.
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
    """Writer of the function body; each check that fails returns without an answer."""

    def write_usage(self, quotas: Sequence[Quota], kind: str) -> list[str]:
        """Add checks of the counts in `usage`.

        Args:
            quotas: all quotas of the site.
            kind: the action kind.

        Returns:
            An expression for each quota on the kind, true if the quota is not used up.
        """
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
        """Add a check of `now`, and convert it to a double."""
        self.add_line(f"exactly = {double_of('now')}")
        self.write_guard(f"{-EXACT_INTEGERS} <= exactly <= {EXACT_INTEGERS}")

    def write_arguments(self, mapping: str, checkers: Mapping[str, ValueChecker]) -> str:
        """Add checks that a mapping holds exactly these inputs or parameters.

        Args:
            mapping: the local variable of the mapping.
            checkers: the declared inputs or parameters, by name.

        Returns:
            An expression for the checked mapping in the form that plants expect.
        """
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
        """Add checks that all required readings are present, and every reading is well-formed and known."""
        scalars = _scalars_of(checkers, required)
        self.local |= {scalar: f"x{len(self.local) + place}" for place, scalar in enumerate(scalars)}
        self.names |= {"Snapshot": Snapshot, "scalars": snapshot_cache.scalars, "one_by_one": read_each}
        self.add_line("if type(readings) is Snapshot:")
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
        """Add the checks of readings that share one time."""
        self.add_line("taken = scalars(readings)")
        self.write_guard("taken is not None")
        self.add_line(f"time = {double_of('readings.time')}")
        self.write_guard(f"{-EXACT_INTEGERS} <= time <= exactly")
        limits = [
            checkers[name].surely_fresh for name in required if checkers[name].declared.max_age is not None
        ]
        if limits:
            self.write_guard(f"exactly - time < {min(limits)!r}")
        for name in sorted(required):
            for scalar in checkers[name].names:
                self.add_line(f"{self.local[scalar]} = taken[{scalar!r}]")

    def write_read_each(
        self,
        checkers: Mapping[str, ValueChecker],
        required: frozenset[str],
        module_variables: frozenset[str],
    ) -> None:
        """Add the checks of readings with a time each; the local `measured` is the last checked time."""
        self.add_line("measured, age = now, 0.0")
        self._mapping("readings", None)
        self.add_line(f"others = len(readings) - {len(required)}")
        for name in sorted(required):
            self.add_line(f"reading = readings[{name!r}]")
            self.write_reading(checkers[name])
            if checkers[name].declared.max_age is not None:
                self.write_guard(f"age < {checkers[name].surely_fresh!r}")
        for name in sorted(module_variables - required):
            self.add_line(f"if {name!r} in readings: others -= 1")
        for name in sorted(checkers.keys() - required - module_variables):
            self.add_line(f"if {name!r} in readings:")
            start = len(self.lines)
            self.add_line("others -= 1")
            self.add_line(f"reading = readings[{name!r}]")
            self.write_reading(checkers[name])
            self.indent(start)
        self.write_guard("not others")

    def write_allow(self, condition: str, kind: str, executed: str) -> None:
        """Add a return of ALLOW with the action `executed`, if the condition holds."""
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
        """Add a return of the denial for the failed conditions and rules, or of the scalars `read`."""
        self.names |= {
            "rules": criteria.rule_conditions.evaluate,
            "denying": lru_cache(_MAX_CACHED_DENIALS)(criteria.denial_for),
        }
        of_rules = ", ".join(self.local[name] for name in criteria.rule_conditions.argument_names)
        self.add_line(f"denied = denying(({', '.join(conditions)}, *rules({of_rules})))")
        values = ", ".join(f"{name!r}: {self.local[name]}" for name in read)
        self.add_line(f"return {{{values}}} if denied is None else denied")

    def build_function(self) -> FastDecide:
        """Compile the written lines to the decision function."""
        self.indent(0)
        head = ["def answering(inputs, readings, parameters, now, usage):", "  try:"]
        tail = ["  except (AttributeError, IndexError, KeyError):", "    return None"]
        return self.compile_function("answering", [*head, *self.lines, *tail])

    def build_read_each(self, scalars: Sequence[str]) -> ReadEach:
        """Compile the written lines to a function that returns these scalars."""
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


class _CachedColumn(NamedTuple):
    """A column of well-formed, immutable values, with the scalars of all of them."""

    order: ColumnNames
    column: tuple[Any, ...]
    scalars: Scalars


class SnapshotCache:
    """Cache of the last unpacked snapshot of one site.

    The cached entry is replaced as a whole, so that several threads may use the cache.
    """

    def __init__(
        self, checkers: Mapping[str, ValueChecker], module_variables: frozenset[str] = frozenset()
    ) -> None:
        self._checkers, self._module_variables = checkers, module_variables
        self._unpackers = {name: FunctionWriter().build_unpacker(form) for name, form in checkers.items()}
        self._cached: _CachedColumn | None = None

    def scalars(self, snapshot: Snapshot) -> Scalars | None:
        """Unpack all values of a snapshot.

        Args:
            snapshot: values that were measured at one time.

        Returns:
            The scalars by scalar variable, not to be modified; None if a name is no state variable or a value
            of the site is malformed. A malformed value of a module's variable is left out.
        """
        columns = snapshot_columns(snapshot)
        if columns is None:
            return None
        cached, (order, column) = self._cached, columns
        if cached is None or cached.order is not order:
            places, scalars = iter(range(len(column))), {}
        elif cached.column is column:
            return cached.scalars
        else:
            places, scalars = compress(count(), map(is_not, column, cached.column)), dict(cached.scalars)
        for place in places:
            name = order.names[place]
            unpack = self._unpackers.get(name) if type(name) is str else None
            value = column[place]
            # A list could be modified before the next call, so it must not be cached.
            unpacked = None if unpack is None or type(value) is list else unpack(value)
            if unpacked is None:
                if type(name) is not str or name not in self._module_variables:
                    return None
                for scalar in self._checkers[name].names:
                    scalars.pop(scalar, None)
                continue
            scalars.update(unpacked)
        self._cached = _CachedColumn(order, column, scalars)
        return scalars
