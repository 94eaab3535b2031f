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

from aeros.runtime.ports import Moment, Names, Reading
from aeros.spec.expr import terms as t
from aeros.spec.expr.doubles import neighbours
from aeros.spec.expr.types import BOOL, EnumType, IntegerType, RealType, VectorType
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.model import Declared
from aeros.spec.theorems.smtlib import literal
from aeros.spec.theorems.symbolic_execution import Ask, Symbol

LIMIT: Final = Fraction(1, 10)
_TOOLS: Final = EnumType("tool", ("brush", "knife"))


def _declared(name: str, type_: Any, role: t.Role, **more: Any) -> Declared:
    # Where it is written is nothing that a form looks at.
    return Declared(t.Variable(name, type_, role), cast("Any", None), **more)


UNIT: Final = (Fraction(0), Fraction(1))
PARAMETERS: Final = {
    one.name: one
    for one in (
        _declared("speed", RealType(NUMBER), t.Role.PARAMETER, range=UNIT),
        _declared("times", IntegerType(NUMBER), t.Role.PARAMETER, range=UNIT),
        _declared("gently", BOOL, t.Role.PARAMETER),
        _declared("tool", _TOOLS, t.Role.PARAMETER),
        _declared("place", VectorType(NUMBER), t.Role.PARAMETER, range=UNIT),
    )
}
INPUT: Final = _declared("inputs.size", RealType(NUMBER), t.Role.INPUT, range=UNIT, default=Fraction(1, 2))
STATE: Final = {
    one.name: one
    for one in (
        _declared("near", RealType(NUMBER), t.Role.STATE, range=UNIT, max_age=LIMIT),
        _declared("warm", RealType(NUMBER), t.Role.STATE, range=UNIT, max_age=LIMIT),
        _declared("lit", BOOL, t.Role.STATE, max_age=LIMIT),
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
    *(f"{name}.{what}" for name in STATE for what in ("is-reading", "is-empty", "is-of-now")),
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
        f"(define-fun {name}-is-reading () Bool (or as-moment (and {name}.is-reading (not {name}.is-empty))))"
        for name in STATE
    ),
    *(
        f"(define-fun {name}-serves () Bool (and has.{name} {name}-is-reading"
        f" (is-time time-of-{name}) (leq time-of-{name} now) formed.{name}"
        f" (<= (- (number now) (number time-of-{name})) {literal(LIMIT)})))"
        for name in sorted(REQUIRED)
    ),
    "(define-fun lit-serves () Bool (=> has.lit (and lit-is-reading"
    " (is-time time-of-lit) (leq time-of-lit now) formed.lit)))",
)
"""What is well-formed, said without the code: the exact type, finite, in range, measured and fresh.

Readings are given one by one or as a moment, that is with one time for all.
"""


class Given:
    """A value that was given: what type it has is asked when somebody looks."""

    def __init__(self, name: str, ask: Ask, *, double: bool = False) -> None:
        self.name, self._ask, self._double = name, ask, double

    def type(self) -> Any:
        """What `type(value)` is of it."""
        if self._double or self._ask(f"(is-double {self.name})"):
            return _float
        return int if self._ask(f"((_ is a-whole) {self.name})") else Strange

    def is_finite(self) -> bool:
        """Stands for `math.isfinite`."""
        return self._double or self._ask(f"((_ is a-double) {self.name})")

    def is_integer(self) -> Symbol:
        """As that of a float."""
        return Symbol(f"(and (is-number {self.name}) (is_int (number {self.name})))", self._ask)

    def as_double(self) -> Given:
        """A whole number as the double that it is."""
        return Given(self.name, self._ask, double=True)

    def exactly(self) -> Symbol:
        """The number that it denotes."""
        return Symbol(f"(number {self.name})", self._ask)

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

    def __sub__(self, other: Given) -> Symbol:
        return Symbol(f"(rounded (- (number {self.name}) (number {other.name})))", self._ask)


def _given_term(value: Any) -> str:
    return value.name if isinstance(value, Given) else _constant(value)


@cache
def _constant(value: float) -> str:
    return "not-a-number" if value != value else f"(a-double {literal(Fraction(value))})"


class Strange:
    """Something of a type that nobody declared."""


def _float(value: Any) -> Any:
    """Stands for `float`, the type and the function."""
    if isinstance(value, Given):
        return value.as_double()
    return 0.0 if isinstance(value, Symbol) else float(value)  # what is said of an age, for people


def type_of(value: Any) -> Any:
    """Stands for `type`."""
    if isinstance(value, Given):
        return value.type()
    if isinstance(value, Measured) and value.is_moment():
        return Moment
    if isinstance(value, Named):
        return dict if value.is_mapping() else Strange
    return _float if type(value) is float else type(value)


def whole(value: Any) -> Any:
    """Stands for `writing._whole`: a whole number as the double that it is, else NaN."""
    if type_of(value) is not int or not -(2**53) <= value <= 2**53:
        return float("nan")
    return _float(value)


def fraction(value: Any = 0) -> Any:
    """Stands for `Fraction`."""
    return value.exactly() if isinstance(value, Given) else Fraction(value)


STANDS_FOR: Final[Mapping[str, Any]] = {"type": type_of, "float": _float}


class Named:
    """What should be a mapping from names to values; which it has is asked when somebody looks."""

    def __init__(self, name: str, ask: Ask, values: Mapping[str, Callable[[], Any]]) -> None:
        self._name, self._ask, self._values = name, ask, values

    def only(self, keys: Iterable[str]) -> Named:
        """The same, with no name that is known but these."""
        return Named(self._name, self._ask, {key: self._values[key] for key in keys})

    def is_mapping(self) -> bool:
        """Whether it is one at all."""
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
        return ((key, self._values[key]() if key in self._values else Strange()) for key in self)

    def keys(self) -> set[Any]:
        """The names, strange ones too."""
        return set(self)


class Measured(Named):
    """Readings one by one or as a moment, which is asked when somebody looks."""

    @property
    def time(self) -> Given:
        """When the moment was."""
        return Given("moment.time", self._ask)

    def only(self, keys: Iterable[str]) -> Measured:
        """The same, with no name that is known but these."""
        return Measured(self._name, self._ask, {key: self._values[key] for key in keys})

    def is_moment(self) -> bool:
        """Whether it is given as one."""
        return self._ask("as-moment")

    def scalars(self) -> Mapping[str, Any] | None:
        """Stands for `MomentTaker.scalars`."""
        if not self._ask("moment.is-made"):
            raise AttributeError(self._name)  # nothing of it is set
        return _Scalars(self, self._ask) if self._ask("moment.is-taken") else None


class _Scalars(dict[str, Any]):
    """The doubles that a moment was taken apart into."""

    def __init__(self, readings: Measured, ask: Ask) -> None:
        self._readings, self._ask = readings, ask

    def __getitem__(self, name: str) -> Given:
        if name not in self._readings:
            raise KeyError(name)
        return Given(name, self._ask, double=True)


class Request:
    """A request of any shape."""

    def __init__(self, ask: Ask) -> None:
        self._ask = ask
        self.now = Given("now", ask)
        self._times: dict[str, Given] = {}
        self._given = {
            "speed": lambda: Given("speed", ask),
            "times": lambda: Given("times", ask),
            "gently": lambda: self._flag("gently"),
            "tool": self._tool,
            "place": self._place,
        }
        self.parameters = Named("parameters", ask, self._given)
        self.inputs = Named("inputs", ask, {"size": lambda: Given("size", ask)})
        self._measured: Mapping[str, Callable[[], Any]] = {
            "near": lambda: Given("near", ask),
            "warm": lambda: Given("warm", ask),
            "lit": lambda: self._flag("lit"),
        }
        self.readings = Measured(
            "readings", ask, {one: partial(self._reading, one) for one in self._measured}
        )
        self.usage = Named("usage", ask, {"rate": lambda: Given("used", ask)})

    def value(self, name: str) -> Any:
        """A parameter, which is there."""
        return self._given[name]()

    def _flag(self, name: str) -> Any:
        return self._ask(f"{name}.flag") if self._ask(f"{name}.is-flag") else Strange()

    def _tool(self) -> Any:
        if self._ask("tool.is-member"):
            return _TOOLS.members[self._ask("tool.which")]
        return "spoon" if self._ask("tool.is-text") else Strange()

    def _place(self) -> Any:
        if not self._ask("place.is-list"):
            return Strange()
        parts = [Given(f"place.{axis}", self._ask) for axis in "xyz"]
        listed = parts if self._ask("place.has-three") else parts[:2]
        return tuple(listed) if self._ask("place.is-tuple") else listed

    def one_by_one(self, names: Iterable[str], gate: ModuleType) -> Any:
        """The readings of these names as the long way of that gate is given them."""
        readings = self.readings.only(names)
        if not readings.is_moment():
            return readings
        if not self._ask("moment.is-made"):
            return gate._one_by_one(object.__new__(Moment))
        column = {name: self._measured[name]() for name in names if name in readings}
        if self._ask("readings.strange-name"):
            column["strange"] = Strange()
        order = Names(column)
        values = tuple(column[name] for name in order.names)
        return gate._one_by_one(Moment(order, values, cast("Any", readings.time)))

    def _reading(self, name: str) -> Any:
        if not self._ask(f"{name}.is-reading"):
            return Strange()
        if self._ask(f"{name}.is-empty"):
            return tuple.__new__(Reading, ())
        return Reading(self._measured[name](), cast("float", self._time(name)))

    def _time(self, name: str) -> Given:
        """When it was measured: the very same object as another time, or one of its own."""
        if self._ask(f"{name}.is-of-now"):
            return self.now
        if name == "warm" and self._ask("warm.is-of-near"):
            return self._time("near")
        return self._times.setdefault(name, Given(f"{name}.time", self._ask))


def look_at(read: Mapping[str, Any]) -> None:
    """Raise where the value of a scalar variable is not that which was given; of numbers, which these are."""
    for name, value in read.items():
        if isinstance(value, Given) and value.name != name.removeprefix("inputs."):
            raise ValueError(name)


def rounding() -> dict[str, str]:
    """Rounding to doubles keeps order, and a double is its own rounding."""
    fresh = literal(Fraction(_SURELY_FRESH))
    ages = {name: f"(- (number now) (number time-of-{name}))" for name in sorted(REQUIRED)}
    return {
        f"rounding-keeps-order.{name}": f"(=> (>= {age} {fresh}) (>= (rounded {age}) {fresh}))"
        for name, age in ages.items()
    }


_SURELY_FRESH: Final = neighbours(LIMIT)[0]
