"""What arrives at the gate, explored: forms as they ship, on the full way and on the short one.

The request is of any shape: what should be a mapping need not be one, names may lack or be strange, and
each value is any double, any whole number, or something else.  One variable of each type stands for any
number of them, and their ranges for any: the code treats each variable by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache, partial
from types import ModuleType, SimpleNamespace
from typing import Any, Final, cast

from aeros.runtime.decision import Caller, Decision, Reason, Verdict
from aeros.runtime.form import forms_of
from aeros.runtime.ports import Moment, Names, Reading
from aeros.skill import Action
from aeros.spec.backends.closure import Truths
from aeros.spec.doubles import neighbours
from aeros.spec.errors import InternalError
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, EnumType, IntegerType, RealType, VectorType
from aeros.spec.model import Declared, Quota
from aeros.spec.theorems.exploring import Ask, Diagram, Symbol, explore
from aeros.spec.theorems.formulas import literal
from aeros.spec.theorems.shipped import Code
from aeros.spec.theorems.theorem import Obligation, Table
from aeros.spec.units import NUMBER

FORM: Final = "aeros.runtime.form"
INTAKE: Final = "aeros.runtime.intake"
GATE: Final = "aeros.runtime.gate"
STRAIGHT: Final = "aeros.runtime.straight"
WRITING: Final = "aeros.runtime.writing"

_LIMIT: Final = Fraction(1, 10)
_TOOLS: Final = EnumType("tool", ("brush", "knife"))


def _declared(name: str, type_: Any, role: t.Role, **more: Any) -> Declared:
    # Where it is written is nothing that a form looks at.
    return Declared(t.Variable(name, type_, role), cast("Any", None), **more)


_UNIT: Final = (Fraction(0), Fraction(1))
_PARAMETERS: Final = {
    one.name: one
    for one in (
        _declared("speed", RealType(NUMBER), t.Role.PARAMETER, range=_UNIT),
        _declared("times", IntegerType(NUMBER), t.Role.PARAMETER, range=_UNIT),
        _declared("gently", BOOL, t.Role.PARAMETER),
        _declared("tool", _TOOLS, t.Role.PARAMETER),
        _declared("place", VectorType(NUMBER), t.Role.PARAMETER, range=_UNIT),
    )
}
_INPUT: Final = _declared("inputs.size", RealType(NUMBER), t.Role.INPUT, range=_UNIT, default=Fraction(1, 2))
_STATE: Final = {
    one.name: one
    for one in (
        _declared("near", RealType(NUMBER), t.Role.STATE, range=_UNIT, max_age=_LIMIT),
        _declared("warm", RealType(NUMBER), t.Role.STATE, range=_UNIT, max_age=_LIMIT),
        _declared("lit", BOOL, t.Role.STATE, max_age=_LIMIT),
    )
}
_REQUIRED: Final = frozenset(("near", "warm"))

_NUMBERS: Final = (
    "speed", "times", "place.x", "place.y", "place.z", "size", "now", "near", "near.time",
    "warm", "warm.time", "lit.time", "moment.time", "used",
)  # fmt: skip
_TRUTHS: Final = (
    *(f"{mapping}.{what}" for mapping in ("parameters", "inputs", "readings", "usage")
      for what in ("is-mapping", "strange-name", "strange-name-is-text")),
    *(f"has.{name}" for name in (*_PARAMETERS, "size", *_STATE, "rate")),
    "gently.is-flag", "gently.flag", "tool.is-member", "tool.is-text", "tool.which",
    "place.is-list", "place.is-tuple", "place.has-three",
    *(f"{name}.{what}" for name in _STATE for what in ("is-reading", "is-empty", "is-of-now")),
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
        for name in _STATE
    ),
    *(
        f"(define-fun {name}-serves () Bool (and has.{name} {name}-is-reading"
        f" (is-time time-of-{name}) (leq time-of-{name} now) formed.{name}"
        f" (<= (- (number now) (number time-of-{name})) {literal(_LIMIT)})))"
        for name in sorted(_REQUIRED)
    ),
    "(define-fun lit-serves () Bool (=> has.lit (and lit-is-reading"
    " (is-time time-of-lit) (leq time-of-lit now) formed.lit)))",
)
"""What is well-formed, said without the code: the exact type, finite, in range, measured and fresh.

Readings are given one by one or as a moment, that is with one time for all.
"""


class _Given:
    """A value that was given: what type it has is asked when somebody looks."""

    def __init__(self, name: str, ask: Ask, *, double: bool = False) -> None:
        self.name, self._ask, self._double = name, ask, double

    def type(self) -> Any:
        """What `type(value)` is of it."""
        if self._double or self._ask(f"(is-double {self.name})"):
            return _float
        return int if self._ask(f"((_ is a-whole) {self.name})") else _Strange

    def is_finite(self) -> bool:
        return self._double or self._ask(f"((_ is a-double) {self.name})")

    def is_integer(self) -> Symbol:
        return Symbol(f"(and (is-number {self.name}) (is_int (number {self.name})))", self._ask)

    def as_double(self) -> _Given:
        """A whole number as the double that it is."""
        return _Given(self.name, self._ask, double=True)

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

    def __sub__(self, other: _Given) -> Symbol:
        return Symbol(f"(rounded (- (number {self.name}) (number {other.name})))", self._ask)


def _given_term(value: Any) -> str:
    return value.name if isinstance(value, _Given) else _constant(value)


@cache
def _constant(value: float) -> str:
    return "not-a-number" if value != value else f"(a-double {literal(Fraction(value))})"


class _Strange:
    """Something of a type that nobody declared."""


def _float(value: Any) -> Any:
    """Stands for `float`, the type and the function."""
    if isinstance(value, _Given):
        return value.as_double()
    return 0.0 if isinstance(value, Symbol) else float(value)  # what is said of an age, for people


def _type(value: Any) -> Any:
    """Stands for `type`."""
    if isinstance(value, _Given):
        return value.type()
    if isinstance(value, _Readings) and value.is_moment():
        return Moment
    if isinstance(value, _Mapping):
        return dict if value.is_mapping() else _Strange
    return _float if type(value) is float else type(value)


def _whole(value: Any) -> Any:
    """Stands for `writing._whole`: a whole number as the double that it is, else NaN."""
    if _type(value) is not int or not -(2**53) <= value <= 2**53:
        return float("nan")
    return _float(value)


def _fraction(value: Any = 0) -> Any:
    """Stands for `Fraction`."""
    return value.exactly() if isinstance(value, _Given) else Fraction(value)


_STANDS_FOR: Final[Mapping[str, Any]] = {"type": _type, "float": _float}


class _Mapping:
    """What should be a mapping from names to values; which it has is asked when somebody looks."""

    def __init__(self, name: str, ask: Ask, values: Mapping[str, Callable[[], Any]]) -> None:
        self._name, self._ask, self._values = name, ask, values

    def only(self, keys: Iterable[str]) -> _Mapping:
        """The same, with no name that is known but these."""
        return _Mapping(self._name, self._ask, {key: self._values[key] for key in keys})

    def is_mapping(self) -> bool:
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
        return self._values[key]() if self._has(key) else default

    def items(self) -> Iterator[tuple[Any, Any]]:
        return ((key, self._values[key]() if key in self._values else _Strange()) for key in self)

    def keys(self) -> set[Any]:
        return set(self)


class _Readings(_Mapping):
    """Readings one by one or as a moment, which is asked when somebody looks."""

    @property
    def time(self) -> _Given:
        """When the moment was."""
        return _Given("moment.time", self._ask)

    def only(self, keys: Iterable[str]) -> _Readings:
        return _Readings(self._name, self._ask, {key: self._values[key] for key in keys})

    def is_moment(self) -> bool:
        return self._ask("as-moment")

    def scalars(self) -> Mapping[str, Any] | None:
        """Stands for `MomentTaker.scalars`."""
        if not self._ask("moment.is-made"):
            raise AttributeError(self._name)  # nothing of it is set
        return _Scalars(self, self._ask) if self._ask("moment.is-taken") else None


class _Scalars(dict[str, Any]):
    """The doubles that a moment was taken apart into."""

    def __init__(self, readings: _Readings, ask: Ask) -> None:
        self._readings, self._ask = readings, ask

    def __getitem__(self, name: str) -> _Given:
        if name not in self._readings:
            raise KeyError(name)
        return _Given(name, self._ask, double=True)


class _Request:
    """A request of any shape."""

    def __init__(self, ask: Ask) -> None:
        self._ask = ask
        self.now = _Given("now", ask)
        self._times: dict[str, _Given] = {}
        self._given = {
            "speed": lambda: _Given("speed", ask),
            "times": lambda: _Given("times", ask),
            "gently": lambda: self._flag("gently"),
            "tool": self._tool,
            "place": self._place,
        }
        self.parameters = _Mapping("parameters", ask, self._given)
        self.inputs = _Mapping("inputs", ask, {"size": lambda: _Given("size", ask)})
        self._measured: Mapping[str, Callable[[], Any]] = {
            "near": lambda: _Given("near", ask),
            "warm": lambda: _Given("warm", ask),
            "lit": lambda: self._flag("lit"),
        }
        self.readings = _Readings(
            "readings", ask, {one: partial(self._reading, one) for one in self._measured}
        )
        self.usage = _Mapping("usage", ask, {"rate": lambda: _Given("used", ask)})

    def value(self, name: str) -> Any:
        """A parameter, which is there."""
        return self._given[name]()

    def _flag(self, name: str) -> Any:
        return self._ask(f"{name}.flag") if self._ask(f"{name}.is-flag") else _Strange()

    def _tool(self) -> Any:
        if self._ask("tool.is-member"):
            return _TOOLS.members[self._ask("tool.which")]
        return "spoon" if self._ask("tool.is-text") else _Strange()

    def _place(self) -> Any:
        if not self._ask("place.is-list"):
            return _Strange()
        parts = [_Given(f"place.{axis}", self._ask) for axis in "xyz"]
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
            column["strange"] = _Strange()
        order = Names(column)
        values = tuple(column[name] for name in order.names)
        return gate._one_by_one(Moment(order, values, cast("Any", readings.time)))

    def _reading(self, name: str) -> Any:
        if not self._ask(f"{name}.is-reading"):
            return _Strange()
        if self._ask(f"{name}.is-empty"):
            return tuple.__new__(Reading, ())
        return Reading(self._measured[name](), cast("float", self._time(name)))

    def _time(self, name: str) -> _Given:
        """When it was measured: the very same object as another time, or one of its own."""
        if self._ask(f"{name}.is-of-now"):
            return self.now
        if name == "warm" and self._ask("warm.is-of-near"):
            return self._time("near")
        return self._times.setdefault(name, _Given(f"{name}.time", self._ask))


# The full way.


def form_obligations() -> dict[str, Callable[[Code], Obligation]]:
    """Everything is of its form exactly where the full way has no objection to it."""
    return {
        "request": _request,
        "time": _time,
        **{f"form-of-{name}": partial(_value, name) for name in _PARAMETERS},
        "given": _given,
        "measured": _readings,
    }


def _forms(code: Code) -> tuple[ModuleType, ModuleType]:
    finite = SimpleNamespace(inf=float("inf"), isfinite=lambda value: value.is_finite())
    form = code.module(FORM, math=finite, Fraction=_fraction, **_STANDS_FOR)
    return form, code.module(INTAKE, using=(form,), type=_type)


def _obligation(says: str, objects: Callable[[Ask], Any], formed: str, **assumptions: str) -> Obligation:
    """That there is no objection exactly where `formed`."""
    return Obligation(
        says,
        (*DECLARATIONS, *SPECIFICATION),
        f"(= nothing {formed})",
        tables=(Table("nothing", "Bool", explore(lambda ask: str(not objects(ask)).lower())),),
        assumptions=assumptions,
    )


def _request(code: Code) -> Obligation:
    _, intake = _forms(code)
    gate = code.module(GATE)

    def run(ask: Ask) -> Any:
        def text(name: str) -> Any:
            return name if ask(f"{name}.is-text") else _Strange()

        request = _Request(ask)
        caller, action = (
            Caller(text("module"), text("skill"), cast("Any", request.inputs)),
            Action(text("kind"), cast("Any", request.parameters)),
        )
        return intake.request_fault(
            caller if ask("caller.is-one") else _Strange(),
            request.one_by_one(("near", "lit"), gate),
            action if ask("action.is-one") else _Strange(),
            request.usage,
        )

    mappings = ("inputs", "parameters", "usage")
    named = [f"{one}.is-mapping (=> {one}.strange-name {one}.strange-name-is-text)" for one in mappings]
    named += ["readings-are-some (or as-moment (=> readings.strange-name readings.strange-name-is-text))"]
    return _obligation(
        "`request_fault` has no objection exactly where somebody asks for an action, and what should be a\n"
        "mapping by name is one; a moment is, unless it was never made.",
        run,
        f"(and caller.is-one action.is-one module.is-text skill.is-text kind.is-text {' '.join(named)})",
    )


def _time(code: Code) -> Obligation:
    form, _ = _forms(code)
    return _obligation(
        "`check_now` has no objection exactly where it is now a number of seconds on a clock.",
        lambda ask: form.check_now(_Request(ask).now),
        "(is-time now)",
    )


def _value(name: str, code: Code) -> Obligation:
    form = _forms(code)[0].Form(_PARAMETERS[name])
    return _obligation(
        f"`Form.take` has no objection to a value of `{name}` exactly where it has the declared type and is\n"
        "in range.",
        lambda ask: form.take(_Request(ask).value(name), {}),
        f"formed.{name}",
    )


def taking_obligations() -> dict[str, Callable[[Code], Obligation]]:
    """A value of a moment is taken apart exactly where it is of its form."""
    return {f"taking-{name}": partial(_taking, name) for name in _PARAMETERS}


def _taking(name: str, code: Code) -> Obligation:
    form = forms_of(_PARAMETERS)[name]
    writer = code.module(WRITING).Writer()
    writer.names |= {**_STANDS_FOR, "whole": _whole}
    taking = writer.taking(form)

    def run(ask: Ask) -> str:
        value = _Request(ask).value(name)
        found = taking(value)
        if found is None:
            return "not-taken"
        _look_at(found)
        is_whole = found.keys() == set(form.names)
        return "taken" if is_whole and _is_number_or(value, found.values()) else "wrong"

    return Obligation(
        f"The function that `Writer.taking` writes takes a value of `{name}` exactly where it has the\n"
        "declared type and is in range, and gives these very scalars.",
        (*DECLARATIONS, *SPECIFICATION, "(declare-datatypes ((Taken 0)) (((taken) (not-taken) (wrong))))"),
        f"(= found (ite formed.{name} taken not-taken))",
        tables=(Table("found", "Taken", explore(run, raising="wrong")),),
    )


def _is_number_or(value: Any, scalars: Iterable[Any]) -> bool:
    return all(isinstance(one, _Given) or one is value for one in scalars)


def _given(code: Code) -> Obligation:
    """With what a form says of a value put aside."""
    _, intake = _forms(code)

    def run(ask: Ask) -> Any:
        def form(name: str, default: Any) -> Any:
            def take(value: Any, _: Any) -> Reason | None:
                # A default that is declared is of its form: AE111 and its like refuse any other.
                return None if value == 0.5 or ask(f"formed.{value.name}") else Reason("AE704", name, "")

            return SimpleNamespace(take=take, declared=SimpleNamespace(default=default, range=_UNIT))

        given = {name: lambda name=name: _Given(name, ask) for name in ("speed", "size")}
        forms = {"speed": form("speed", None), "size": form("size", Fraction(1, 2))}
        return list(intake.take_given(forms, _Mapping("parameters", ask, given), "", {}))

    return _obligation(
        "`take_given` has no objection exactly where all is there that has no default, nothing strange is,\n"
        "and each value is of its form.",
        run,
        "(and (not parameters.strange-name) has.speed formed.speed (=> has.size formed.size))",
    )


def _readings(code: Code) -> Obligation:
    """With what a form says of a value put aside."""
    form, intake = _forms(code)
    gate = code.module(GATE)

    def run(ask: Ask) -> Any:
        def stub(name: str) -> Any:
            def take(_: Any, __: Any) -> Reason | None:
                return None if ask(f"formed.{name}") else Reason("AE704", name, "")

            real = form.Form(_STATE[name])
            return SimpleNamespace(take=take, declared=real.declared, surely_fresh=real.surely_fresh)

        request = _Request(ask)
        readings = request.one_by_one(("near", "lit"), gate)
        forms = {name: stub(name) for name in ("near", "lit")}
        if readings is None:
            return ["no readings"]
        return list(intake.take_readings(forms, readings, request.now, frozenset(("near",)), {}))

    return _obligation(
        "`take_readings` has no objection exactly where what is required is measured, no longer ago than\n"
        "its maximum age, nothing is of the future, and each value is of its form; of a moment, each in it,\n"
        "of the one time.",
        run,
        "(and (not readings.strange-name) near-serves lit-serves)",
        **{
            "now-is-a-time": "(is-time now)",
            "a-moment-is-made": "(=> as-moment moment.is-made)",
            **rounding(),
        },
    )


def rounding() -> dict[str, str]:
    """Rounding to doubles keeps order, and a double is its own rounding."""
    fresh = literal(Fraction(_SURELY_FRESH))
    ages = {name: f"(- (number now) (number time-of-{name}))" for name in sorted(_REQUIRED)}
    return {
        f"rounding-keeps-order.{name}": f"(=> (>= {age} {fresh}) (>= (rounded {age}) {fresh}))"
        for name, age in ages.items()
    }


_SURELY_FRESH: Final = neighbours(_LIMIT)[0]


# The short way.

_QUOTA: Final = Quota("rate", frozenset(("a",)), 3, Fraction(60), cast("Any", None))

_SHORT: Final = (
    "(declare-datatypes ((ShortWay 0))"
    " (((short-allows) (short-denies) (short-leaves) (short-silent) (wrong))))"
)


@dataclass(frozen=True, eq=False)
class _Shape:
    """What a skill and a kind declare: a part of all types, as every value doubles the ways through.

    formed: what must be so of a request that is answered.
    """

    name: str
    parameters: Mapping[str, Declared]
    inputs: Mapping[str, Declared]
    state: Mapping[str, Declared]
    formed: Sequence[str]


def _shape(name: str, parameters: Sequence[str], inputs: Sequence[str], state: Sequence[str]) -> _Shape:
    mappings = ["parameters", "inputs", "usage"]
    formed = ["(is-time now)", "has.rate", "((_ is a-whole) used)", "(<= 0 (whole used))"]
    formed += [f"{one}.is-mapping (not {one}.strange-name)" for one in mappings]
    formed += ["readings-are-some (not readings.strange-name)"]
    formed += [f"has.{one} formed.{one}" for one in (*parameters, *inputs)]
    formed += [f"{one}-serves" for one in state]
    return _Shape(
        name,
        {one: _PARAMETERS[one] for one in parameters},
        dict.fromkeys(inputs, _INPUT),
        {one: _STATE[one] for one in state},
        formed,
    )


_SHAPES: Final = (
    _shape("parameters", ("speed", "gently", "tool"), (), ()),
    _shape("inputs", ("times",), ("size",), ("lit",)),
    _shape("vectors", ("place",), (), ()),
    _shape("readings", (), (), ("near", "warm")),
)


def short_way_obligations(
    claim: Callable[[_Shape], Obligation],
) -> dict[str, Callable[[Code], Obligation]]:
    """What `claim` says of the short way of each shape; `found` is what that says."""

    def made(shape: _Shape, code: Code) -> Obligation:
        return replace(claim(shape), tables=(Table("found", "ShortWay", _explore_short_way(code, shape)),))

    return {f"short-way-{shape.name}": partial(made, shape) for shape in _SHAPES}


_HOLDS: Final = f"(and allows (< (number used) {_QUOTA.at_most}) envelope left)"
"""What the short way has to decide by."""


def allows_only_what_holds(shape: _Shape) -> Obligation:
    """Where it speaks, all is well-formed; where it allows, all that it evaluates holds."""
    return Obligation(
        "The function that `compile_straight` writes answers only where everything is well-formed, readings\n"
        "one by one or of one moment, and allows only what is asked for, where quotas are left and envelope\n"
        "and residue hold of these very values.",
        (*DECLARATIONS, *SPECIFICATION, _SHORT),
        "(and (not (= found wrong))"
        f" (or (= found short-silent) (and {' '.join(shape.formed)}))"
        f" (=> (= found short-allows) {_HOLDS}))",
        assumptions={**rounding(), "moment-is-taken": MOMENT_IS_TAKEN},
    )


MOMENT_IS_TAKEN: Final = "(=> moment.is-taken (and (not readings.strange-name){}))".format(
    "".join(f" (=> has.{name} formed.{name})" for name in _STATE)
)
"""What `MomentTaker.scalars` takes apart, is of its form: see `gate_moments.py`."""


def allows_what_holds(_: _Shape) -> Obligation:
    """Where it speaks, it allows what it finds to hold."""
    return Obligation(
        "The function that `compile_straight` writes is silent, or allows, where quotas are left and\n"
        "envelope and residue hold.",
        (*DECLARATIONS, *SPECIFICATION, _SHORT),
        f"(=> {_HOLDS} (or (= found short-allows) (= found short-silent)))",
    )


@cache
def _explore_short_way(code: Code, shape: _Shape) -> Diagram:
    """What the function that `compile_straight` writes says of any request: a term of sort ShortWay."""
    answers: list[Ask] = []
    written = {
        allows: _short_way(code, shape, allows, lambda question: answers[-1](question))
        for allows in (True, False)
    }

    def run(ask: Ask) -> str:
        answers.append(ask)
        request = _Request(ask)
        parameters = request.parameters.only(shape.parameters)
        found = written[ask("allows")](
            request.inputs.only(shape.inputs),
            request.readings.only(shape.state),
            parameters,
            request.now,
            request.usage,
        )
        match found:
            case None:
                return "short-silent"
            case Decision(Verdict.ALLOW, Action("a", executed), ()):
                return "short-allows" if _is_what_was_asked(executed, shape.parameters) else "wrong"
            case Decision(Verdict.DENY, None, _):
                return "short-denies"
            case dict():
                _look_at(found)
                return "short-leaves"
            case _:
                return "wrong"

    return explore(run, raising="wrong")


def _short_way(code: Code, shape: _Shape, allows: bool, ask: Ask) -> Any:
    """The function as it is written, with conditions, the denial and what looks at types put aside."""
    straight = code.module(STRAIGHT, using=(code.module(WRITING),))
    known = (*shape.parameters, *shape.inputs, *(_REQUIRED & shape.state.keys()))

    def conditions(writer: Any, terms: Sequence[str], _: Any) -> list[str]:
        read = ", ".join(f"{name!r}: {local}" for name, local in writer.local.items() if _root(name) in known)
        return [f"holds({term!r}, {{{read}}})" for term in terms]

    def holds(term: str, read: Mapping[str, Any]) -> bool:
        _look_at(read)
        return ask(term)

    straight._Writer.conditions = conditions

    def denying(_: Any) -> Decision | None:
        return None if ask("attenuates") else Decision(Verdict.DENY, None, (Reason("AE750", "", ""),))

    rules = Truths((), lambda: (ask("rules"),))
    criteria = straight.Criteria(allows, "envelope", "permission", "left", rules, denying)
    function = straight.compile_straight(
        criteria,
        inputs=forms_of(shape.inputs),
        state=forms_of(shape.state),
        moments=SimpleNamespace(scalars=_Readings.scalars),
        required=_REQUIRED & shape.state.keys(),
        parameters=forms_of(shape.parameters),
        quotas=(_QUOTA,),
        kind="a",
    )
    # Its globals are what the writer gave it; denials are kept by hash, which questions have none of.
    stubs = {**_STANDS_FOR, "whole": _whole, "denying": denying}
    unknown = stubs.keys() - function.__globals__.keys()
    if unknown:
        raise InternalError(f"the short way does not use {sorted(unknown)} any more")
    function.__globals__.update(stubs, holds=holds)
    return function


def _look_at(read: Mapping[str, Any]) -> None:
    """Raise where the value of a scalar variable is not that which was given; of numbers, which these are."""
    for name, value in read.items():
        if isinstance(value, _Given) and value.name != name.removeprefix("inputs."):
            raise ValueError(name)


def _root(scalar: str) -> str:
    """The variable that it is a scalar of, as it is declared."""
    return scalar.removesuffix(".x").removesuffix(".y").removesuffix(".z")


def _is_what_was_asked(executed: Mapping[str, Any], parameters: Iterable[str]) -> bool:
    """Whether the plant would be given each parameter as it was asked for; of numbers, which these are."""

    def named(value: Any) -> Any:
        return tuple(map(named, value)) if isinstance(value, tuple) else getattr(value, "name", None)

    numbers = {"speed": "speed", "times": "times", "place": ("place.x", "place.y", "place.z")}
    return executed.keys() == set(parameters) and all(
        named(value) == numbers.get(name) for name, value in executed.items()
    )
