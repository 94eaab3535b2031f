"""Any request that may arrive at the gate, and what is well-formed of it, said without the code.

The request is of any shape: what should be a mapping need not be one, names may lack or be strange, and
each value is any double, any whole number, or something else.  One variable of each type stands for any
number of them, and their ranges for any: the code treats each variable by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from fractions import Fraction
from functools import cache, partial
from types import ModuleType
from typing import Any, Final, cast

from aeros.runtime.ports import ColumnNames, Reading, Snapshot
from aeros.spec.expr import terms as t
from aeros.spec.expr.doubles import adjacent_doubles
from aeros.spec.expr.types import BOOL, EnumType, IntegerType, RealType, VectorType
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.variables import Declared
from aeros.spec.theorems.smtlib import smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, SymbolicValue

MAX_AGE: Final = Fraction(1, 10)
_TOOLS: Final = EnumType("tool", ("brush", "knife"))


def _declared(name: str, type_: Any, role: t.VariableRole, **more: Any) -> Declared:
    # Where it is written is nothing that a form looks at.
    return Declared(t.Variable(name, type_, role), cast("Any", None), **more)


UNIT_RANGE: Final = (Fraction(0), Fraction(1))
PARAMETERS: Final = {
    one.name: one
    for one in (
        _declared("speed", RealType(NUMBER), t.VariableRole.PARAMETER, range=UNIT_RANGE),
        _declared("times", IntegerType(NUMBER), t.VariableRole.PARAMETER, range=UNIT_RANGE),
        _declared("gently", BOOL, t.VariableRole.PARAMETER),
        _declared("tool", _TOOLS, t.VariableRole.PARAMETER),
        _declared("place", VectorType(NUMBER), t.VariableRole.PARAMETER, range=UNIT_RANGE),
    )
}
INPUT: Final = _declared(
    "inputs.size", RealType(NUMBER), t.VariableRole.INPUT, range=UNIT_RANGE, default_value=Fraction(1, 2)
)
STATE: Final = {
    one.name: one
    for one in (
        _declared("near", RealType(NUMBER), t.VariableRole.STATE, range=UNIT_RANGE, max_age=MAX_AGE),
        _declared("warm", RealType(NUMBER), t.VariableRole.STATE, range=UNIT_RANGE, max_age=MAX_AGE),
        _declared("lit", BOOL, t.VariableRole.STATE, max_age=MAX_AGE),
    )
}
REQUIRED: Final = frozenset(("near", "warm"))

_NUMBERS: Final = (
    "speed", "times", "place.x", "place.y", "place.z", "size", "now", "near", "near.time",
    "warm", "warm.time", "lit.time", "moment.time", "used",
)  # fmt: skip
_TRUTHS: Final = (
    *(f"{mapping}.{what}" for mapping in ("parameters", "inputs", "readings", "usage")
      for what in ("is-mapping", "strange-name", "strange-name-is-text")),
    *(f"has.{name}" for name in (*PARAMETERS, "size", *STATE, "rate")),
    "gently.is-flag", "gently.flag", "tool.is-member", "tool.is-text", "tool.which",
    "place.is-list", "place.is-tuple", "place.has-three",
    *(f"{name}.{what}" for name in STATE for what in ("is-reading", "is-empty", "is-long", "is-of-now")),
    "warm.is-of-near", "as-moment", "moment.is-made", "moment.is-taken",
    "module.is-text", "skill.is-text", "kind.is-text", "caller.is-one", "action.is-one",
    "lit.is-flag", "lit.flag", "allows", "envelope", "permission", "left", "rules", "attenuates",
)  # fmt: skip

DECLARATIONS: Final = (
    "(declare-datatypes ((Given 0)) (((a-double (double Real)) (a-whole (whole Int))"
    " (not-a-number) (infinite) (minus-infinite) (strange))))",
    *(f"(declare-const {name} Given)" for name in _NUMBERS),
    *(f"(declare-const {name} Bool)" for name in _TRUTHS),
    "(define-fun is-number ((x Given)) Bool (or ((_ is a-double) x) ((_ is a-whole) x)))",
    "(define-fun is-double ((x Given)) Bool (not (or ((_ is a-whole) x) ((_ is strange) x))))",
    "(define-fun number ((x Given)) Real (ite ((_ is a-whole) x) (to_real (whole x)) (double x)))",
    "(define-fun leq ((x Given) (y Given)) Bool (and (not (= x not-a-number)) (not (= y not-a-number))"
    " (or (= x minus-infinite) (= y infinite)"
    " (and (is-number x) (is-number y) (<= (number x) (number y))))))",
    "(declare-fun rounded (Real) Real)",
)
"""Any request, and doubles as IEEE 754 compares them; `rounded` is what a sum of doubles comes to."""

SPECIFICATION: Final = (
    "(define-fun exact ((x Given)) Bool"
    " (and (is-number x) (=> ((_ is a-whole) x) (<= (- 9007199254740992) (whole x) 9007199254740992))))",
    "(define-fun in-unit ((x Given)) Bool (and (exact x) (<= 0 (number x) 1)))",
    "(define-fun is-time ((x Given)) Bool"
    " (and (exact x) (<= (- 9007199254740992) (number x) 9007199254740992)))",
    "(define-fun formed.speed () Bool (in-unit speed))",
    "(define-fun formed.times () Bool (and (in-unit times) (is_int (number times))))",
    "(define-fun formed.gently () Bool gently.is-flag)",
    "(define-fun formed.tool () Bool tool.is-member)",
    "(define-fun formed.place () Bool"
    " (and place.is-list place.has-three (in-unit place.x) (in-unit place.y) (in-unit place.z)))",
    "(define-fun formed.size () Bool (in-unit size))",
    "(define-fun formed.near () Bool (in-unit near))",
    "(define-fun formed.lit () Bool lit.is-flag)",
    "(define-fun formed.warm () Bool (in-unit warm))",
    "(define-fun time-of-near () Given (ite as-moment moment.time (ite near.is-of-now now near.time)))",
    "(define-fun time-of-warm () Given"
    " (ite as-moment moment.time (ite warm.is-of-now now (ite warm.is-of-near time-of-near warm.time))))",
    "(define-fun time-of-lit () Given (ite as-moment moment.time (ite lit.is-of-now now lit.time)))",
    "(define-fun readings-are-some () Bool (ite as-moment moment.is-made readings.is-mapping))",
    *(
        f"(define-fun {name}-is-reading () Bool "
        f"(or as-moment (and {name}.is-reading (not {name}.is-empty) (not {name}.is-long))))"
        for name in STATE
    ),
    *(
        f"(define-fun {name}-serves () Bool (and has.{name} {name}-is-reading"
        f" (is-time time-of-{name}) (leq time-of-{name} now) formed.{name}"
        f" (<= (- (number now) (number time-of-{name})) {smt_literal(MAX_AGE)})))"
        for name in sorted(REQUIRED)
    ),
    "(define-fun lit-serves () Bool (=> has.lit (and lit-is-reading"
    " (is-time time-of-lit) (leq time-of-lit now) formed.lit)))",
)
"""Definition of well-formed, independent of the code: exact type, finite, in range, measured, fresh.

Readings are given one by one or as a moment, that is with one time for all.
"""


class GivenValue:
    """A value that was given: what type it has is asked when somebody looks."""

    def __init__(self, name: str, ask: DecideBranch, *, double: bool = False) -> None:
        self.name, self._ask, self._double = name, ask, double

    def type(self) -> Any:
        """Type that `type(value)` returns for the symbolic value."""
        if self._double or self._ask(f"(is-double {self.name})"):
            return _float
        return int if self._ask(f"((_ is a-whole) {self.name})") else UndeclaredValue

    def is_finite(self) -> bool:
        """Stands for `math.isfinite`."""
        return self._double or self._ask(f"((_ is a-double) {self.name})")

    def is_integer(self) -> SymbolicValue:
        """As that of a float."""
        return SymbolicValue(f"(and (is-number {self.name}) (is_int (number {self.name})))", self._ask)

    def as_double(self) -> GivenValue:
        """A whole number as the double that it is."""
        return GivenValue(self.name, self._ask, double=True)

    def exact_value(self) -> SymbolicValue:
        """The number that it denotes."""
        return SymbolicValue(f"(number {self.name})", self._ask)

    def _leq(self, left: Any, right: Any) -> bool:
        return self._ask(f"(leq {_given_term(left)} {_given_term(right)})")

    def __le__(self, other: Any) -> bool:
        return self._leq(self, other)

    def __ge__(self, other: Any) -> bool:
        return self._leq(other, self)

    def __lt__(self, other: Any) -> bool:
        return self._leq(self, other) and not self._leq(other, self)

    def __gt__(self, other: Any) -> bool:
        return self._leq(other, self) and not self._leq(self, other)

    def __sub__(self, other: GivenValue) -> SymbolicValue:
        return SymbolicValue(f"(rounded (- (number {self.name}) (number {other.name})))", self._ask)


def _given_term(value: Any) -> str:
    return value.name if isinstance(value, GivenValue) else _constant(value)


@cache
def _constant(value: float) -> str:
    return "not-a-number" if value != value else f"(a-double {smt_literal(Fraction(value))})"


class UndeclaredValue:
    """Something of a type that nobody declared."""


def _float(value: Any) -> Any:
    """Stands for `float`, the type and the function."""
    if isinstance(value, GivenValue):
        return value.as_double()
    return 0.0 if isinstance(value, SymbolicValue) else float(value)  # what is said of an age, for people


def type_stub(value: Any) -> Any:
    """Stands for `type`."""
    if isinstance(value, GivenValue):
        return value.type()
    if isinstance(value, MeasuredReadings) and value.is_snapshot():
        return Snapshot
    if isinstance(value, NamedValues):
        return dict if value.is_mapping() else UndeclaredValue
    return _float if type(value) is float else type(value)


def fraction_stub(value: Any = 0) -> Any:
    """Stands for `Fraction`."""
    return value.exact_value() if isinstance(value, GivenValue) else Fraction(value)


STUBS: Final[Mapping[str, Any]] = {"type": type_stub, "float": _float}


class NamedValues:
    """Symbolic argument that should be a mapping from names to values; a look-up asks which names it has."""

    def __init__(self, name: str, ask: DecideBranch, values: Mapping[str, Callable[[], Any]]) -> None:
        self._name, self._ask, self._values = name, ask, values

    def restricted_to(self, keys: Iterable[str]) -> NamedValues:
        """The same, with no name that is known but these."""
        return NamedValues(self._name, self._ask, {key: self._values[key] for key in keys})

    def is_mapping(self) -> bool:
        """Ask whether the argument is a mapping."""
        return self._ask(f"{self._name}.is-mapping")

    def _has(self, key: str) -> bool:
        return key in self._values and self._ask(f"has.{key.removeprefix('inputs.')}")

    def __iter__(self) -> Iterator[Any]:
        yield from (key for key in self._values if self._has(key))
        if self._ask(f"{self._name}.strange-name"):
            yield "strange" if self._ask(f"{self._name}.strange-name-is-text") else 0

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __contains__(self, key: str) -> bool:
        return self._has(key)

    def __getitem__(self, key: str) -> Any:
        if not self._has(key):
            raise KeyError(key)
        return self._values[key]()

    def get(self, key: str, default: Any = None) -> Any:
        """As that of a dictionary; so are the others."""
        return self._values[key]() if self._has(key) else default

    def items(self) -> Iterator[tuple[Any, Any]]:
        """Of what is strange, something strange."""
        return ((key, self._values[key]() if key in self._values else UndeclaredValue()) for key in self)

    def keys(self) -> set[Any]:
        """The names, strange ones too."""
        return set(self)


class MeasuredReadings(NamedValues):
    """Readings one by one or as a moment, which is asked when somebody looks."""

    @property
    def time(self) -> GivenValue:
        """When the moment was."""
        return GivenValue("moment.time", self._ask)

    def restricted_to(self, keys: Iterable[str]) -> MeasuredReadings:
        """The same, with no name that is known but these."""
        return MeasuredReadings(self._name, self._ask, {key: self._values[key] for key in keys})

    def is_snapshot(self) -> bool:
        """Ask whether the readings are given as a snapshot."""
        return self._ask("as-moment")

    def scalars(self) -> Mapping[str, Any] | None:
        """Stands for `SnapshotCache.scalars`."""
        if not self._ask("moment.is-made"):
            raise AttributeError(self._name)  # nothing of it is set
        return _ScalarValues(self, self._ask) if self._ask("moment.is-taken") else None


class _ScalarValues(dict[str, Any]):
    """The doubles that a moment was taken apart into."""

    def __init__(self, readings: MeasuredReadings, ask: DecideBranch) -> None:
        self._readings, self._ask = readings, ask

    def __getitem__(self, name: str) -> GivenValue:
        if name not in self._readings:
            raise KeyError(name)
        return GivenValue(name, self._ask, double=True)


class SymbolicRequest:
    """A request of any shape."""

    def __init__(self, ask: DecideBranch) -> None:
        self._ask = ask
        self.now = GivenValue("now", ask)
        self._times: dict[str, GivenValue] = {}
        self._given = {
            "speed": lambda: GivenValue("speed", ask),
            "times": lambda: GivenValue("times", ask),
            "gently": lambda: self._flag("gently"),
            "tool": self._tool,
            "place": self._place,
        }
        self.parameters = NamedValues("parameters", ask, self._given)
        self.inputs = NamedValues("inputs", ask, {"size": lambda: GivenValue("size", ask)})
        self._measured: Mapping[str, Callable[[], Any]] = {
            "near": lambda: GivenValue("near", ask),
            "warm": lambda: GivenValue("warm", ask),
            "lit": lambda: self._flag("lit"),
        }
        self.readings = MeasuredReadings(
            "readings", ask, {one: partial(self._reading, one) for one in self._measured}
        )
        self.usage = NamedValues("usage", ask, {"rate": lambda: GivenValue("used", ask)})

    def value(self, name: str) -> Any:
        """A parameter, which is there."""
        return self._given[name]()

    def _flag(self, name: str) -> Any:
        return self._ask(f"{name}.flag") if self._ask(f"{name}.is-flag") else UndeclaredValue()

    def _tool(self) -> Any:
        if self._ask("tool.is-member"):
            return _TOOLS.members[self._ask("tool.which")]
        return "spoon" if self._ask("tool.is-text") else UndeclaredValue()

    def _place(self) -> Any:
        if not self._ask("place.is-list"):
            return UndeclaredValue()
        parts = [GivenValue(f"place.{axis}", self._ask) for axis in "xyz"]
        listed = parts if self._ask("place.has-three") else parts[:2]
        return tuple(listed) if self._ask("place.is-tuple") else listed

    def individual_readings(self, names: Iterable[str], gate: ModuleType) -> Any:
        """The readings of these names as the long way of that gate is given them."""
        readings = self.readings.restricted_to(names)
        if not readings.is_snapshot():
            return readings
        if not self._ask("moment.is-made"):
            return gate.individual_readings(object.__new__(Snapshot))
        column = {name: self._measured[name]() for name in names if name in readings}
        if self._ask("readings.strange-name"):
            column["strange"] = UndeclaredValue()
        order = ColumnNames(column)
        values = tuple(column[name] for name in order.names)
        return gate.individual_readings(Snapshot(order, values, cast("Any", readings.time)))

    def _reading(self, name: str) -> Any:
        if not self._ask(f"{name}.is-reading"):
            return UndeclaredValue()
        if self._ask(f"{name}.is-empty"):
            return tuple.__new__(Reading, ())
        if self._ask(f"{name}.is-long"):
            return tuple.__new__(Reading, (self._measured[name](), self._time(name), 0))
        return Reading(self._measured[name](), cast("float", self._time(name)))

    def _time(self, name: str) -> GivenValue:
        """When it was measured: the very same object as another time, or one of its own."""
        if self._ask(f"{name}.is-of-now"):
            return self.now
        if name == "warm" and self._ask("warm.is-of-near"):
            return self._time("near")
        return self._times.setdefault(name, GivenValue(f"{name}.time", self._ask))


def check_scalars(read: Mapping[str, Any]) -> None:
    """Raise where the value of a scalar variable is not that which was given; of numbers, which these are."""
    for name, value in read.items():
        if isinstance(value, GivenValue) and value.name != name.removeprefix("inputs."):
            raise ValueError(name)


def rounding_axioms() -> dict[str, str]:
    """Rounding to doubles keeps order, and a double is its own rounding."""
    fresh = smt_literal(Fraction(_LARGEST_FRESH_AGE))
    ages = {name: f"(- (number now) (number time-of-{name}))" for name in sorted(REQUIRED)}
    return {
        f"rounding-keeps-order.{name}": f"(=> (>= {age} {fresh}) (>= (rounded {age}) {fresh}))"
        for name, age in ages.items()
    }


_LARGEST_FRESH_AGE: Final = adjacent_doubles(MAX_AGE)[0]
