"""The short way to ALLOW: one generated function per skill and action kind, silent where in doubt.

What it allows, the full way of the gate allows, with the same action; it never denies, it only has no
answer, and then the full way decides and finds the reasons.  It reads each value once, checks its
form, and evaluates the envelope and what the proof left over in the same function, on local variables.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from aeros.runtime.decision import Caller, Decision, Verdict
from aeros.runtime.form import Form, doubles_in_range
from aeros.runtime.ports import Reading
from aeros.skill import Action
from aeros.spec.backends.closure import inline_condition
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BoolType, EnumType, FamilyType, IntegerType, RealType, VectorType
from aeros.spec.model import Declared, Quota, ranges_of

_EXACT_INTEGERS = 2**53

Allowing = Callable[[Any, Any, Any, Any, Any], dict[str, Any] | None]
"""From inputs, readings, parameters, now and usage to the parameters to execute, or None."""


def decide_straight(
    functions: Mapping[tuple[str, str, str], Allowing],
    caller: Any,
    readings: Any,
    action: Any,
    now: Any,
    usage: Any,
) -> Decision | None:
    """ALLOW, or None where the full way has to decide; never raises.

    functions: by module, skill and action kind.
    """
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
    allowed = None if function is None else function(inputs, readings, parameters, now, usage)
    if allowed is None:
        return None
    new = tuple.__new__  # a named tuple's own constructor takes twice as long
    return new(Decision, (Verdict.ALLOW, new(Action, (kind, allowed)), ()))


def compile_straight(
    condition: t.Term,
    *,
    inputs: Mapping[str, Form],
    state: Mapping[str, Form],
    required: frozenset[str],
    parameters: Mapping[str, Form],
    quotas: Sequence[Quota],
    kind: str,
) -> Allowing:
    """The short way of one skill's actions of one kind.

    condition: the envelope and whatever else has to be evaluated.
    required: the state variables that must be there, and fresh.
    quotas: those of the site, on this kind and on others.
    """
    writer = _Writer()
    writer.usage(quotas, kind)
    writer.time()
    writer.given("inputs", {name.removeprefix("inputs."): form for name, form in inputs.items()})
    executed = writer.given("parameters", parameters)
    writer.readings(state, required)
    declared = [form.declared for form in (*inputs.values(), *state.values(), *parameters.values())]
    writer.condition(condition, declared)
    return writer.function(executed)


def _whole(value: Any) -> float:
    """A whole number as the double that it is; of anything else NaN, which is in no range."""
    if type(value) is int and -_EXACT_INTEGERS <= value <= _EXACT_INTEGERS:
        return float(value)
    return float("nan")


class _Writer:
    """Writes the body line by line; each check that fails leaves without an answer."""

    def __init__(self) -> None:
        self._lines: list[str] = []
        self._local: dict[str, str] = {}
        self._names: dict[str, Any] = {
            "__builtins__": {},
            "AttributeError": AttributeError,
            "KeyError": KeyError,
            "Reading": Reading,
            "dict": dict,
            "float": float,
            "int": int,
            "len": len,
            "list": list,
            "str": str,
            "tuple": tuple,
            "type": type,
            "whole": _whole,
        }

    def usage(self, quotas: Sequence[Quota], kind: str) -> None:
        """Counts for quotas of the site, with those on the kind among them and not used up."""
        known = tuple(quota.id for quota in quotas)
        self._mapping("usage", None if known else 0)
        self._line("for name, used in usage.items():")
        self._line(f"  if name not in {known!r} or type(used) is not int or used < 0: return None")
        for quota in quotas:
            if kind in quota.kinds:
                self._require(f"usage[{quota.id!r}] < {quota.at_most}")

    def time(self) -> None:
        """Now; `measured` is the time of the reading that was looked at last."""
        self._line("exactly = now if type(now) is float else whole(now)")
        self._require(f"{-_EXACT_INTEGERS} <= exactly <= {_EXACT_INTEGERS}")
        self._line("measured, age = now, 0.0")

    def given(self, mapping: str, forms: Mapping[str, Form]) -> str:
        """Exactly these inputs or parameters; code for the mapping of what is then executed."""
        self._mapping(mapping, len(forms))
        executed = [f"{name!r}: {self._take(form, f'{mapping}[{name!r}]')}" for name, form in forms.items()]
        return "{" + ", ".join(executed) + "}"

    def readings(self, forms: Mapping[str, Form], required: frozenset[str]) -> None:
        """The required readings and any of the others, all well-formed, and nothing else."""
        self._mapping("readings", None)
        self._line(f"others = len(readings) - {len(required)}")
        for name in sorted(required):
            self._line(f"reading = readings[{name!r}]")
            self._reading(forms[name])
            if forms[name].declared.max_age is not None:
                self._require(f"age < {forms[name].surely_fresh!r}")
        for name in sorted(forms.keys() - required):
            self._line(f"if {name!r} in readings:")
            start = len(self._lines)
            self._line("others -= 1")
            self._line(f"reading = readings[{name!r}]")
            self._reading(forms[name])
            self._indent(start)
        self._require("not others")

    def condition(self, term: t.Term, declared: Iterable[Declared]) -> None:
        """The condition, on the local variables."""
        used = t.variables_of(term)
        ranges = ranges_of(one for one in declared if one.name in used)
        code, names = inline_condition(term, ranges, self._local)
        self._names |= names
        self._require(code)

    def function(self, result: str) -> Allowing:
        """The function that has been written, and gives `result`."""
        self._line(f"return {result}")
        self._indent(0)
        source = [
            "def allowing(inputs, readings, parameters, now, usage):",
            "  try:",
            *self._lines,
            "  except (AttributeError, KeyError):",
            "    return None",
        ]
        # Written from declarations alone: names are quoted, numbers are repr of numbers.
        exec("\n".join(source), self._names)  # noqa: S102
        function: Allowing = self._names["allowing"]
        return function

    def _line(self, code: str) -> None:
        self._lines.append(f"  {code}")

    def _indent(self, start: int) -> None:
        self._lines[start:] = [f"  {line}" for line in self._lines[start:]]

    def _require(self, code: str) -> None:
        self._line(f"if not ({code}): return None")

    def _mapping(self, name: str, size: int | None) -> None:
        counted = "" if size is None else f" and len({name}) == {size}"
        self._require(f"type({name}) is dict{counted}")
        if size != 0:
            self._line(f"for key in {name}:")
            self._line("  if type(key) is not str: return None")

    def _reading(self, form: Form) -> None:
        """Form and time of `reading`; most readings share one time, which is then checked once."""
        self._require("type(reading) is Reading")
        self._line("if reading.time is not measured:")
        start = len(self._lines)
        self._line("measured = reading.time")
        self._line("time = measured if type(measured) is float else whole(measured)")
        self._require(f"{-_EXACT_INTEGERS} <= time <= exactly")
        self._line("age = exactly - time")
        self._indent(start)
        self._take(form, "reading.value")

    def _take(self, form: Form, code: str) -> str:
        """The value of `code` as local variables, one for each scalar; code for it as it is executed."""
        scalars = []
        for name in form.names:
            scalars.append(f"x{len(self._local)}")
            self._local[name] = scalars[-1]
        if not isinstance(form.declared.variable.type, VectorType | FamilyType):
            self._line(f"{scalars[0]} = {code}")
            self._scalar(form.declared, scalars[0])
            return scalars[0]
        listed = ", ".join(scalars) + ","
        self._line(f"several = {code}")
        self._require("type(several) is tuple or type(several) is list")
        self._require(f"len(several) == {len(scalars)}")
        self._line(f"{listed} = several")
        for scalar in scalars:
            self._scalar(form.declared, scalar)
        return f"({listed})"

    def _scalar(self, declared: Declared, local: str) -> None:
        type_ = declared.variable.type
        match type_.element if isinstance(type_, FamilyType) else type_:
            case BoolType():
                self._require(f"{local} is True or {local} is False")
            case EnumType(members=members):
                self._require(f"type({local}) is str and {local} in {members!r}")
            case RealType() | VectorType() as real:
                least, most = doubles_in_range(declared)
                whole = f" and {local}.is_integer()" if isinstance(real, IntegerType) else ""
                self._line(f"if type({local}) is not float: {local} = whole({local})")
                self._require(f"{least!r} <= {local} <= {most!r}{whole}")
