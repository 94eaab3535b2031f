"""An allowed request, corrupted: never ALLOW, always a reason, never an exception.

`AEROS_FUZZ=1000000 pytest tests/property/test_gate_corruption.py` corrupts a million.
"""

from __future__ import annotations

import importlib.util
import math
import os
import random
import types
from collections import Counter, UserDict, UserList
from collections.abc import Callable, Iterator
from dataclasses import replace
from decimal import Decimal
from enum import Enum, StrEnum
from fractions import Fraction
from typing import Any

import pytest

from aeros.runtime.gate.decision import Caller, DecisionKind
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.ports import Reading
from aeros.skill import Action
from tests.differential.gate.gate_oracle import admits
from tests.hypothesis_profiles import PROFILE, PROFILES
from tests.unit.runtime.bench import ALLOWED, NOW, Request, configuration, gate, request

COUNT = round(int(os.environ.get("AEROS_FUZZ", "6000")) * PROFILES[PROFILE])
"""Corrupted requests of each test: 4,500 in each run of CI, 150,000 each night."""


class EvilFloat(float):
    """Says that it is within every bound."""

    def __le__(self, other: object) -> bool:
        return True

    __lt__ = __ge__ = __gt__ = __eq__ = __le__
    __hash__ = float.__hash__


class EvilInt(int):
    def __le__(self, other: object) -> bool:
        return True

    __lt__ = __ge__ = __gt__ = __eq__ = __le__
    __hash__ = int.__hash__


class EvilStr(str):
    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        return True

    __hash__ = str.__hash__


class EvilDict(dict[str, Any]):
    def __getitem__(self, key: str) -> Any:
        return 0.0

    def get(self, key: str, default: Any = None) -> Any:
        return 0.0


class EvilList(list[Any]):
    def __len__(self) -> int:
        return 3


class EvilTuple(tuple[Any, ...]):
    __slots__ = ()

    def __iter__(self) -> Iterator[Any]:
        return iter((0.0, 0.0, 0.0))


def _raise(*_: object) -> Any:
    raise RuntimeError("no operator of the asker's may run")


class Raising:
    """Raises whatever is done with it."""

    __eq__ = __ne__ = __lt__ = __le__ = __gt__ = __ge__ = __hash__ = __bool__ = _raise
    __float__ = __int__ = __index__ = __len__ = __iter__ = __contains__ = __getitem__ = __getattr__ = _raise
    __str__ = __repr__ = __format__ = __sub__ = __rsub__ = __neg__ = __abs__ = __call__ = _raise


class Member(Enum):
    BRUSH = "brush"


class MemberStr(StrEnum):
    BRUSH = "brush"


def _itself() -> list[Any]:
    one: list[Any] = []
    one.append(one)
    return one


def _nested(depth: int) -> list[Any]:
    one: list[Any] = []
    for _ in range(depth):
        one = [one]
    return one


def _numpy() -> tuple[Any, ...]:
    if importlib.util.find_spec("numpy") is None:
        return ()
    numpy = importlib.import_module("numpy")
    return (
        numpy.float64(0.0625),  # a subclass of float
        numpy.float32(0.0625),
        numpy.int64(0),
        numpy.bool_(True),
        numpy.str_("brush"),  # a subclass of str
        numpy.array([0.25, 0.125, 0.25]),
        numpy.array(0.0625),
        numpy.float64("nan"),
    )


ALIEN: tuple[Any, ...] = (
    None,
    math.nan,
    -math.nan,
    math.inf,
    -math.inf,
    10**400,
    -(10**400),
    10**5000,
    2**53 + 1,
    1e308,
    -1e308,
    "",
    "0.0625",
    "NaN",
    "BRUSH",
    "Brush",
    "brush ",
    "\ud800",
    b"brush",
    b"",
    bytearray(b"0"),
    EvilFloat(0.0625),
    EvilFloat("nan"),
    EvilInt(0),
    EvilStr("brush"),
    EvilStr("nothing"),
    EvilDict(),
    EvilList([0.25]),
    EvilTuple((9.0,)),
    Raising(),
    Raising,
    Member.BRUSH,
    MemberStr.BRUSH,
    Decimal("0.0625"),
    Fraction(1, 16),
    0.0625 + 0j,
    {},
    {"value": 0.0625},
    set(),
    frozenset({0.25}),
    range(3),
    object(),
    Ellipsis,
    NotImplemented,
    _raise,
    math,
    iter([0.25, 0.125, 0.25]),
    memoryview(b"abc"),
    UserDict({"x": 1}),
    UserList([0.25, 0.125, 0.25]),
    types.MappingProxyType({}),
    types.SimpleNamespace(value=0.0625, time=NOW),
    [[0.25, 0.125, 0.25]],
    [0.25],
    (0.25, 0.125, 0.25, 0.25),
    ((0.25,), 0.125, 0.25),
    [0.25, [0.125], 0.25],
    (None, None, None),
    (math.nan, 0.0, 0.0),
    (True, 0.0, 0.0),
    (Raising(), 0.0, 0.0),
    (EvilFloat(0.25), 0.125, 0.25),
    _itself(),
    _nested(5_000),
    Reading(0.0625, NOW),
    tuple.__new__(Reading),
    tuple.__new__(Reading, (0.0625, NOW, 0)),
    Caller("handling", "quickly", {}),
    Action("stop", {}),
    *_numpy(),
)
"""Never a value of any type in place of a scalar, of a compound, or of a part of one."""

NUMBERS: tuple[Any, ...] = (
    -0.0, 0.0, 0, 1, -1, 5e-324, -5e-324, 2.2250738585072014e-308, 0.1, 0.25, 1e-9, 1.2, 0.5, 4.999,
    2**53, -(2**53), True, False, "brush", "knife", (0.0, 0.0, 0.0), [0, 0, 0], (True, False), (0.0, 0.5),
)  # fmt: skip
"""May be a value: then the oracle says whether it is allowed."""

Corruption = Callable[[random.Random, Request], tuple[Request, bool]]
"""The corrupted request, and whether it may be allowed all the same, for which the oracle is asked."""


def _any(chance: random.Random) -> tuple[Any, bool]:
    may_be = chance.random() < 0.3
    return chance.choice(NUMBERS if may_be else ALIEN), may_be


def _part_of(chance: random.Random, whole: Any) -> tuple[Any, bool]:
    """A corrupted value, or one with a corrupted part."""
    value, may_be = _any(chance)
    if not isinstance(whole, tuple) or chance.random() < 0.4:
        return value, may_be
    parts = list(whole)
    parts[chance.randrange(len(parts))] = value
    return (parts if chance.random() < 0.5 else tuple(parts)), may_be


def _state_value(chance: random.Random, asked: Request) -> tuple[Request, bool]:
    name = chance.choice(list(asked.readings))
    value, may_be = _part_of(chance, asked.readings[name].value)
    return replace(asked, readings={**asked.readings, name: Reading(value, NOW)}), may_be


def _state_time(chance: random.Random, asked: Request) -> tuple[Request, bool]:
    name = chance.choice(list(asked.readings))
    value = asked.readings[name].value
    if chance.random() < 0.5:
        stale = chance.choice([99.9, 99.89999, 99.95, 99.94, 0.0, -1e15, NOW, 99, 98.0, 100])
        return replace(asked, readings={**asked.readings, name: Reading(value, stale)}), True
    time = chance.choice([*ALIEN, math.nextafter(NOW, math.inf), 101, 1e15, True])
    return replace(asked, readings={**asked.readings, name: Reading(value, time)}), False


def _state_reading(chance: random.Random, asked: Request) -> tuple[Request, bool]:
    name = chance.choice(list(asked.readings))
    aliens = [one for one in ALIEN if type(one) is not Reading or len(one) != 2]
    aliens += [tuple.__new__(Reading, (*asked.readings[name], extra)) for extra in (0, NOW, None)]
    return replace(asked, readings={**asked.readings, name: chance.choice(aliens)}), False


def _state_missing(chance: random.Random, asked: Request) -> tuple[Request, bool]:
    readings = dict(asked.readings)
    for name in chance.sample(list(readings), chance.randint(1, 4)):
        del readings[name]
    return replace(asked, readings=readings), True


def _state_name(chance: random.Random, asked: Request) -> tuple[Request, bool]:
    name = chance.choice(list(asked.readings))
    wrong = chance.choice(
        [name.upper(), f"{name} ", f"{name}[0]", "", "\ud800", EvilStr(name), 7, None, b"x"]
    )
    readings = dict(asked.readings)
    if chance.random() < 0.5 or type(wrong) is EvilStr:  # which a dict would take for the name itself
        del readings[name]
    return replace(asked, readings={**readings, wrong: Reading(0.5, NOW)}), False


def _parameter_value(chance: random.Random, asked: Request) -> tuple[Request, bool]:
    parameters = dict(asked.action.parameters)
    if not parameters:
        return _parameter_name(chance, asked)
    name = chance.choice(list(parameters))
    parameters[name], may_be = _part_of(chance, parameters[name])
    return replace(asked, action=Action(asked.action.kind, parameters)), may_be


def _parameter_name(chance: random.Random, asked: Request) -> tuple[Request, bool]:
    parameters = dict(asked.action.parameters)
    if parameters and chance.random() < 0.5:
        del parameters[chance.choice(list(parameters))]
    else:
        parameters[chance.choice(["force", "Speed", "speed ", "", "target.x", 3, None])] = 0.0
    return replace(asked, action=Action(asked.action.kind, parameters)), False


def _input(chance: random.Random, asked: Request) -> tuple[Request, bool]:
    name = chance.choice(["tool", "limit", "inputs.tool", "haste", 3])
    value, may_be = _any(chance)
    inputs = {**asked.caller.inputs, name: value}
    return replace(asked, caller=replace(asked.caller, inputs=inputs)), may_be


def _quota(chance: random.Random, asked: Request) -> tuple[Request, bool]:
    usage: Any = chance.choice([{}, {"carry-rate": chance.choice([*ALIEN, *NUMBERS])}, {"x": 0}])
    return replace(asked, usage=usage), True


def _now(chance: random.Random, asked: Request) -> tuple[Request, bool]:
    if chance.random() < 0.3:
        return replace(asked, now=chance.choice([NOW + 0.01, 100.1, 100.1000001, 100.05, 101, 1e15])), True
    return replace(asked, now=chance.choice([*ALIEN, True, 99.999999, -100, 0])), False


def _mapping(chance: random.Random, asked: Request) -> tuple[Request, bool]:
    """A mapping that holds the right things and is not a `dict`, or something else altogether."""
    field = chance.choice(["inputs", "parameters", "readings", "usage"])
    caller, action = asked.caller, asked.action
    old = {"inputs": caller.inputs, "parameters": action.parameters}.get(field, getattr(asked, field, None))
    aliens = [one for one in ALIEN if type(one) is not dict]
    wrappers: list[Callable[[Any], Any]] = [
        types.MappingProxyType,
        UserDict,
        EvilDict,
        Counter,
        list,
        lambda one: tuple(one.items()),
    ]
    new = chance.choice(wrappers)(old) if chance.random() < 0.5 else chance.choice(aliens)
    if field == "inputs":
        return replace(asked, caller=replace(caller, inputs=new)), False
    if field == "parameters":
        return replace(asked, action=Action(action.kind, new)), False
    return replace(asked, **{field: new}), False


def _identity(chance: random.Random, asked: Request) -> tuple[Request, bool]:
    """Another caller, or another kind, or nothing of the sort."""
    wrong = chance.choice([one for one in ALIEN if type(one) is not Action])
    names = [wrong, "Handling", "", "QUICKLY", EvilStr("handling"), EvilStr("quickly"), "handling\0"]
    caller, action = asked.caller, asked.action
    match chance.randrange(6):
        case 0:
            return replace(asked, caller=chance.choice([c for c in ALIEN if type(c) is not Caller])), False
        case 1:
            return replace(asked, caller=replace(caller, module=chance.choice(names))), False
        case 2:
            return replace(asked, caller=replace(caller, skill=chance.choice(names))), False
        case 3:
            return replace(asked, action=wrong), False
        case 4:
            kinds = [wrong, "Move", "fly", "throw", "drive", "", EvilStr("stop")]
            return replace(asked, action=Action(chance.choice(kinds), action.parameters)), False
        case _:
            fields = chance.choice([(), (action.kind,), (*action, None), (action.parameters, action.kind)])
            return replace(asked, action=tuple.__new__(Action, fields)), False


CORRUPTIONS: tuple[Corruption, ...] = (
    _state_value, _state_value, _state_time, _state_reading, _state_missing, _state_name,
    _parameter_value, _parameter_value, _parameter_name, _input, _quota, _now, _mapping, _identity,
)  # fmt: skip


def _corrupted(seed: int, count: int) -> Iterator[tuple[Request, bool, str]]:
    """Corrupted requests, whether each may be allowed all the same, and where to find it again."""
    chance = random.Random(seed)  # noqa: S311 - repeats, and guards nothing
    bases = [request(skill, kind) for skill, kind in ALLOWED]
    near = request(human_distance=1.0, fitted="knife")
    bases += [near, request("quickly", "sweep", wind=2.0, gust=5.0, pace=0.5)]
    for number in range(count):
        base, corruption = chance.choice(bases), chance.choice(CORRUPTIONS)
        asked, may_be = corruption(chance, base)
        of = f"{corruption.__name__} of {base.caller.skill}.{base.action.kind}"
        yield asked, may_be, f"seed {seed}, number {number}: {of}"


def corruptions(seed: int, count: int) -> Iterator[Request]:
    """`count` corrupted requests."""
    return (asked for asked, _, _ in _corrupted(seed, count))


def corrupt(gate: CompiledGate, seed: int, count: int) -> Counter[str]:
    """Count each verdict on `count` corrupted requests; fail on the first wrong one."""
    seen: Counter[str] = Counter()
    for asked, may_be_allowed, where in _corrupted(seed, count):
        decision = asked.decided_by(gate)
        if decision.kind is DecisionKind.DENY:
            assert decision.reasons, where
            assert decision.action is None, where
            assert all(
                type(part) is str for one in decision.reasons for part in (one.code, one.rule, one.text)
            )
        else:
            assert may_be_allowed, where
            allowed = decision.kind is DecisionKind.ALLOW
            assert decision.action is not None
            executed = asked if allowed else replace(asked, action=decision.action)
            assert admits(configuration(), asked) is allowed, where
            assert admits(configuration(), executed), where
        if may_be_allowed and decision.kind is DecisionKind.DENY:
            assert not admits(configuration(), asked), where
        seen[decision.kind.value] += 1
    return seen


def test_no_corrupted_request_is_allowed_and_none_raises() -> None:
    seen = corrupt(gate(), seed=0, count=COUNT)
    assert sum(seen.values()) == COUNT
    # What may be allowed all the same is a part of it: zeros, whole numbers, state that no rule reads.
    assert seen["DENY"] > 0.8 * COUNT
    assert seen["ALLOW"] > 0.02 * COUNT
    assert seen["ATTENUATE"] > 0


def test_z3_and_the_checked_gate_take_no_corrupted_request_either() -> None:
    corrupt(gate(GateMode.CHECKED), seed=1, count=max(1_000, COUNT // 100))


@pytest.mark.parametrize(("skill", "kind"), ALLOWED)
def test_no_value_of_a_foreign_type_is_accepted_anywhere(skill: str, kind: str) -> None:
    base = request(skill, kind)
    for alien in ALIEN:
        for asked in _alien_anywhere(base, alien):
            decision = asked.decided_by(gate())
            assert decision.kind is DecisionKind.DENY, type(alien)
            assert decision.reasons, type(alien)


def _alien_anywhere(base: Request, alien: Any) -> list[Request]:
    """The request with `alien` in place of each value that is looked at."""
    kind = base.action.kind
    corrupted = [
        replace(base, now=alien),
        replace(base, readings=alien if type(alien) is not dict else [alien]),
        *(
            replace(base, action=Action(kind, {**base.action.parameters, name: alien}))
            for name in base.action.parameters
        ),
        *(replace(base, readings={**base.readings, n: Reading(alien, NOW)}) for n in base.readings),
        *(
            replace(base, readings={**base.readings, n: Reading(one.value, alien)})
            for n, one in base.readings.items()
        ),
        *(replace(base, caller=replace(base.caller, inputs={n: alien})) for n in ("tool", "limit")),
    ]
    if kind == "carry":
        corrupted.append(replace(base, usage={"carry-rate": alien}))
    return corrupted
