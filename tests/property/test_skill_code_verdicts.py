"""Claims about skill code, which only read it, against running it, in every case, in isolation.

The programs are straight: everything that is written can be reached.  What reading cannot decide is
refused on purpose, and no matter of this comparison.
"""

from __future__ import annotations

import builtins
import inspect
import itertools
import re
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

import aeros.skill
from aeros.runtime.skills.code import CodeFile
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.ecm import ActionCondition, Ecm, Skill
from aeros.spec.model.rules import ActionKind, Risk
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.entry_points import entry_point_obligations
from aeros.spec.obligations.skill_code import skill_code_obligations
from aeros.spec.obligations.skill_syntax.skill_source import read_skill_files
from tests.property.mix import Mix
from tests.property.test_permissions import bounded
from tests.unit.agent.dumplings import SPAN, build

_SPEED = Declared(t.Variable("speed", RealType(NUMBER), t.VariableRole.PARAMETER), SPAN)
SITE = build(
    Site,
    kinds={
        name: ActionKind(name, frozenset(), Risk.LOW, False, {"speed": _SPEED}, SPAN)
        for name in ("push", "pull")
    },
    limits=None,
)


def _module(*envelope: str) -> Ecm:
    clause = ActionCondition(t.TRUE, "", SPAN)
    skill = build(
        Skill, id="tidy", module_name="skills", function="tidy", envelope=dict.fromkeys(envelope, clause),
        timeout=Fraction(1),
    )  # fmt: skip
    return build(Ecm, id="module", skills={"tidy": skill})


ENTRIES, ASKS, REACHES, IMPORTS = Mix(), Mix(), Mix(), Mix()
_BODIES = [
    "yield act('push')",
    "yield from (act(kind) for kind in ())",
    "return",
    "nested = lambda: (yield)",
    "def nested():\n        yield act('push')",
    "class Nested:\n        def tidy(self, observed, inputs):\n            yield",
    "for _ in ():\n        yield",
]


def test_an_entry_point_is_refused_exactly_where_calling_it_gives_no_generator() -> None:
    _entries_are_judged()
    ENTRIES.assert_both("AE123", "AE124")


@bounded
@given(
    st.sampled_from(["tidy", "tidy", "tidy", "tidyup"]),
    st.sampled_from(["", "observed", "observed, inputs", "observed, inputs", "observed, inputs, more"]),
    st.booleans(),
    st.lists(st.sampled_from(_BODIES), min_size=1, max_size=2),
)
def _entries_are_judged(name: str, parameters: str, is_async: bool, body: list[str]) -> None:
    word = "async def" if is_async and not any("yield from" in line for line in body) else "def"
    code = f"{word} {name}({parameters}):\n    " + "\n    ".join(body) + "\n"
    (found,) = entry_point_obligations(_module(), read_skill_files("", {"skills.py": code.encode()}))
    scope: dict[str, Any] = {"act": lambda kind: kind}
    exec(code, scope)  # noqa: S102  our own few lines
    function = scope.get("tidy")
    reported = None if found.diagnostic is None else found.diagnostic.code
    ENTRIES.compare("AE123", proved=reported != "AE123", expected=function is not None)
    if function is not None:
        ENTRIES.compare("AE124", proved=reported is None, expected=_gives_a_generator(function))


def _gives_a_generator(function: Any) -> bool:
    try:
        inspect.signature(function).bind(None, None)
    except TypeError:
        return False
    made = function(None, None)
    if inspect.iscoroutine(made):
        made.close()
    return inspect.isgenerator(made)


_CALLS = ["act('push')", "act('push', speed=2)", "act('pull', speed=1)", "act('push', pace=1)", "act('pull')"]
_ASKING = st.one_of(
    st.sampled_from(_CALLS).map(lambda call: f"yield {call}"),
    st.tuples(st.sampled_from("ab"), st.sampled_from(_CALLS)).map(
        lambda pair: f"if observed['{pair[0]}']:\n        yield {pair[1]}"
    ),
    st.just("yield from helper(observed)"),
)


def test_code_is_refused_exactly_where_a_run_asks_for_what_is_not_declared() -> None:
    _askings_are_judged()
    ASKS.assert_both("AE133", "AE149")


@bounded
@given(
    st.lists(_ASKING, max_size=3),
    st.lists(_ASKING, max_size=1),
    st.frozensets(st.sampled_from(["push", "pull"])),
)
def _askings_are_judged(body: list[str], helped: list[str], envelope: frozenset[str]) -> None:
    helped = [line for line in helped if "helper" not in line]
    code = "".join(
        f"def {name}(observed{more}):\n    yield from ()\n"
        + "".join(f"    {line}\n" for line in lines)
        + "\n"
        for name, more, lines in (("helper", "", helped), ("tidy", ", inputs", body))
    )
    claims = skill_code_obligations(
        _module(*envelope), SITE, read_skill_files("", {"skills.py": code.encode()})
    )
    found = {str(one.id): one.diagnostic for one in claims}["form/tidy/asks"]
    # The site has no state variables, which is said only where each action is declared.
    is_declared = found is None or found.code in ("AE147", "AE149")
    assert is_declared or (found is not None and found.code == "AE133")

    def act(kind: str, **parameters: Any) -> tuple[str, frozenset[str]]:
        return kind, frozenset(parameters)

    scope: dict[str, Any] = {"act": act}
    exec(code, scope)  # noqa: S102
    asked = {
        action
        for a, b in itertools.product((False, True), repeat=2)
        for action in scope["tidy"]({"a": a, "b": b}, None)
    }
    fine = all(kind in envelope and parameters <= {"speed"} for kind, parameters in asked)
    ASKS.compare("AE133", proved=is_declared, expected=fine)
    if fine and (found is None or found.code == "AE149"):
        ASKS.compare("AE149", proved=found is None, expected=all("speed" in given for _, given in asked))


_DOORS = {"open", "eval", "exec", "getattr", "globals", "print"}
_LINES = [
    *("import math", "from math import sqrt", "from aeros.skill import act", "import fractions"),
    *("import os", "from os import path", "import aeros.spec", "import math, sys"),
    "from aeros.skill import dataclass",
    *("x = max(1, 2)", "x = sorted([2, 1])", "x = [n for n in range(3)]", "x = str(1).upper()"),
    *("x = open('f')", "x = eval('1')", "x = getattr(1, 'real')", "print(1)", "x = globals()", "exec('1')"),
    *("x = (1).__class__", "x = (lambda: 1).__globals__", "x = (n for n in ()).gi_frame"),
]
_HARMLESS = {"math": {"sqrt"}, "fractions": set(), "aeros.skill": {"act"}}


class _ReachedError(Exception):
    """A door was opened."""


def test_code_is_refused_exactly_where_running_it_opens_a_door() -> None:
    _reaches_are_judged()
    REACHES.assert_both("AE134")


@bounded
@given(st.lists(st.sampled_from(_LINES), min_size=1, max_size=2))
def _reaches_are_judged(lines: list[str]) -> None:
    code = "\n".join(lines) + "\n"
    claims = skill_code_obligations(_module(), SITE, read_skill_files("", {"skills.py": code.encode()}))
    found = {str(one.id): one.diagnostic for one in claims}["form/code/skills.py"]
    assert found is None or found.code == "AE134"
    REACHES.compare("AE134", proved=found is None, expected=not _opens_a_door(code))


def _opens_a_door(code: str) -> bool:
    def closed(*_: Any) -> None:
        raise _ReachedError

    def imported(name: str, _: Any = None, __: Any = None, names: Any = (), ___: int = 0) -> Any:
        if name not in _HARMLESS or not set(names or ()) <= _HARMLESS[name]:
            raise _ReachedError
        return aeros.skill if name == "aeros.skill" else __import__(name)

    inside = {name: value for name, value in vars(builtins).items() if not name.startswith("_")}
    inside |= dict.fromkeys(_DOORS, closed) | {"__import__": imported}
    try:
        exec(code, {"__builtins__": inside})  # noqa: S102
    except _ReachedError:
        return True
    # Reaching into an object opens nothing by itself: what it gives is what skill code must not hold.
    return re.search(r"\.(__|gi_)", code) is not None


_IMPORTS = ["", *(f"from .{file} import {name} as y\n" for file in ("a", "b", "c") for name in ("x", "z"))]


def test_an_import_is_refused_exactly_where_executing_the_file_finds_nothing() -> None:
    for a, b in itertools.product(_IMPORTS, _IMPORTS):
        code = {"a.py": f"{a}x = 1\n".encode(), "b.py": f"{b}x = 1\n".encode()}
        claims = skill_code_obligations(_module(), SITE, read_skill_files("", code))
        reported = {one.diagnostic.code for one in claims if one.diagnostic is not None}
        outcomes = [_import_error(name, code) for name in code]
        IMPORTS.compare("AE143", proved="AE143" not in reported, expected=not _lacks_something(a + b))
        IMPORTS.compare("AE144", proved="AE144" not in reported, expected=not _goes_round(a, b))
        assert bool(reported) == any(outcomes)
    IMPORTS.assert_both("AE143", "AE144")


def _import_error(name: str, code: Mapping[str, bytes]) -> str:
    others = tuple(one for one in code.items() if one[0] != name)
    try:
        # It has no generator function, which is noticed only after all imports.
        CodeFile("m", name, name, code[name], others).generator_function("tidy")
    except SkillRefusedError as refused:
        return "" if "has no generator function" in str(refused) else str(refused)
    raise AssertionError(code)


def _lacks_something(text: str) -> bool:
    return ".c " in text or " z " in text


def _goes_round(a: str, b: str) -> bool:
    return ".a " in a or ".b " in b or (".b " in a and ".a " in b)
