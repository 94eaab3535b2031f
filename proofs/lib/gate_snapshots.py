"""Snapshots as the gate unpacks them, explored: `SnapshotCache.scalars`, whatever it has kept.

A snapshot of two state variables, and perhaps of one undeclared name, stands for one of any size: each
place of the column is treated by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from types import SimpleNamespace
from typing import Any, Final

from aeros.runtime.ports import ColumnNames
from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.smtlib import smt_apply, smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation
from proofs.lib import gate_validation as forms

SNAPSHOTS: Final = "aeros.runtime.gate.compiled.fast_path"

_STATE: Final = ("lit", "near")
_UNDECLARED_NAME: Final = "mood"

_DECLARATIONS: Final = (
    "(declare-datatypes ((Scalars 0)) (((current) (kept) (none))))",
    f"(declare-datatypes ((Answer 0)) (((refused) (scalars {' '.join(f'({x} Scalars)' for x in _STATE)}))))",
    "(declare-datatypes ((Outcome 0))"
    " (((outcome (answer Answer) (keeps-this Bool) (keeps-what-it-had Bool)))))",
    *(
        f"(declare-const {name} Bool)"
        for name in (
            "keeps-one",
            "same-order",
            "same-column",
            f"has.{_UNDECLARED_NAME}",
            *(f"{place}.is-same" for place in (*_STATE, _UNDECLARED_NAME)),
            *(f"{place}.{what}" for place in _STATE for what in ("is-list", "is-formed", "was-taken")),
        )
    ),
    *(f"(define-fun {x}.can-be-taken () Bool (and (not {x}.is-list) {x}.is-formed))" for x in _STATE),
    "(define-fun all-can () Bool"
    f" (and (not has.{_UNDECLARED_NAME}) {' '.join(f'{x}.can-be-taken' for x in _STATE)}))",
)
"""A moment, what was kept of an earlier one, and what comes of them.

`same-order`, `same-column`, `X.is-same`: that the names, the column, the value of X are the very objects
that were kept.  `X.was-taken`: the value that was kept of X was no list, and of its form.
"""

_CACHE_IS_CONSISTENT: Final = (
    f"(=> (and keeps-one same-order) (and (not has.{_UNDECLARED_NAME})"
    f" {' '.join(f'{x}.was-taken' for x in _STATE)}))"
)
"""The invariant: what is kept was all declared, no list, and of its form."""


class _SymbolicValue:
    """A value that was measured, or its scalar."""

    def __init__(self, of: str, when: str) -> None:
        self.of, self.time = of, when


def snapshot_obligations() -> dict[str, Callable[[ModuleSource], TheoremObligation]]:
    """Make the obligations on unpacking a snapshot and each well-formed value."""
    return {"moment": _snapshot_obligation, **forms.unpacking_obligations()}


def _snapshot_obligation(code: ModuleSource) -> TheoremObligation:
    def run(ask: DecideBranch) -> str:
        def is_not(value: _SymbolicValue, _: _SymbolicValue) -> bool:
            return not ask(f"{value.of}.is-same")

        def unpack(name: str, value: _SymbolicValue) -> Mapping[str, _SymbolicValue] | None:
            formed = value.of == name and ask(f"{name}.is-formed")
            return {name: _SymbolicValue(name, "current")} if formed else None

        def type_(value: Any) -> Any:
            return list if isinstance(value, _SymbolicValue) and ask(f"{value.of}.is-list") else type(value)

        def column_of(names: Iterable[str]) -> tuple[_SymbolicValue, ...]:
            return tuple(_SymbolicValue(name, "measured") for name in names)

        snapshots = code.module(SNAPSHOTS, is_not=is_not, type=type_)
        cache = snapshots.SnapshotCache({})
        cache._unpackers = {name: partial(unpack, name) for name in _STATE}
        order = ColumnNames((*_STATE, _UNDECLARED_NAME) if ask(f"has.{_UNDECLARED_NAME}") else _STATE)
        column = column_of(order.names)
        had, before = None, None
        if ask("keeps-one"):
            before = {name: _SymbolicValue(name, "kept") for name in _STATE}
            # Names in another order stand for any others.
            names = order if ask("same-order") else ColumnNames(order.names[::-1])
            of_old = column if ask("same-column") else column_of(names.names)
            had = cache._cached = snapshots._CachedColumn(names, of_old, dict(before))
        found = cache.scalars(SimpleNamespace(order=order, column=column))
        now = cache._cached
        is_this = now is not None and now.order is order and now.column is column and now.scalars is found
        is_untouched = now is had and (had is None or had.scalars == before)
        return smt_apply("outcome", _answer(found), smt_literal(is_this), smt_literal(is_untouched))

    right = " ".join(
        f"(or (= ({x} (answer found)) current)"
        f" (and keeps-one same-order {x}.is-same (= ({x} (answer found)) kept)))"
        for x in _STATE
    )
    return TheoremObligation(
        "`SnapshotCache.scalars` answers exactly where all of a moment are declared state variables, of\n"
        "their forms and no lists, whatever it kept of an earlier one; with the scalars of these very\n"
        "values. What it keeps is then this moment, or what it had.",
        _DECLARATIONS,
        f"(and (= all-can (not (= (answer found) refused))) (=> all-can (and {right}))"
        " (or (keeps-what-it-had found) (and all-can (keeps-this found))))",
        tables=(SymbolicFunction("found", "Outcome", execute_symbolically(run)),),
        assumptions={
            "what-is-kept-is-right": _CACHE_IS_CONSISTENT,
            "a-column-is-its-values": "(=> (and keeps-one same-order same-column)"
            f" (and {' '.join(f'{x}.is-same' for x in _STATE)}))",
            **{
                f"what-is-no-list-stays.{x}": f"(=> (and keeps-one same-order {x}.is-same {x}.was-taken)"
                f" {x}.can-be-taken)"
                for x in _STATE
            },
        },
    )


def _answer(scalars: Mapping[str, _SymbolicValue] | None) -> str:
    if scalars is None:
        return "refused"
    return smt_apply("scalars", *(scalars[name].time if name in scalars else "none" for name in _STATE))
