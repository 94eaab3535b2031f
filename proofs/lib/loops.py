"""Obligation that no loop of the covered code depends on the number of its elements: two stand for any.

`aeros.spec.theorems.loop_forms` finds the loops in the source.  Those that do not treat each element by
itself are listed in `loops.toml`, with what is to be found in them and why the theorem holds nevertheless.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.theorems.loop_forms import loop_forms
from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.theorem import TheoremObligation

REGISTER: Final = Path(__file__).with_name("loops.toml")


@cache
def registered_loops() -> Mapping[str, Mapping[str, Mapping[str, Any]]]:
    """By module and place, the `faults` that a loop may have, and `why` the theorem holds for any number."""
    return tomllib.loads(REGISTER.read_text("utf-8"))


def loops_of(*covered: str | tuple[str, Sequence[str]]) -> Callable[[ModuleSource], TheoremObligation]:
    """Make the obligation about the loops of modules, or of some functions of a module."""
    return partial(_loops, dict(one if isinstance(one, tuple) else (one, None) for one in covered))


def _loops(covered: Mapping[str, Sequence[str] | None], code: ModuleSource) -> TheoremObligation:
    by_itself, argued, dependent = [], [], []
    for module, functions in covered.items():
        register = registered_loops().get(module, {})
        short = module.rpartition(".")[2]
        for form in loop_forms(code.source(module)):
            function = form.place.partition(":")[0]
            if functions is not None and not any(f"{function}.".startswith(f"{one}.") for one in functions):
                continue
            allowed = register.get(form.place, {}).get("faults", [])
            name = f"{short}.{form.place}"
            if not form.faults:
                by_itself.append(name)
            elif set(form.faults) <= set(allowed):
                argued.append(name)
            else:
                dependent.append(f"{name}: {', '.join(sorted({*form.faults} - {*allowed}))}")
    names = list(dict.fromkeys([*by_itself, *argued, *dependent]))
    if not names:
        raise InternalError(f"no loop is found in {', '.join(covered)}")
    return TheoremObligation(
        "Each loop of the code treats each of its elements by itself, or `loops.toml` says why their number\n"
        "does not matter; no part of a sequence is taken elsewhere.",
        (
            "(declare-datatypes ((Loop 0)) ((" + " ".join(f"({_symbol(one)})" for one in names) + ")))",
            "(declare-const loop Loop)",
            f"(define-fun by-itself () Bool {_is_one_of(by_itself)})",
            f"(define-fun argued () Bool {_is_one_of(argued)})",
        ),
        "(or by-itself argued)",
    )


def _is_one_of(names: Sequence[str]) -> str:
    alternatives = " ".join(f"(= loop {_symbol(one)})" for one in dict.fromkeys(names))
    return f"(or false {alternatives})" if alternatives else "false"


def _symbol(name: str) -> str:
    """Quote a name; SMT-LIB has no `|` and no backslash in a quoted symbol."""
    return "|" + name.replace("|", "or").replace("\\", "/") + "|"
