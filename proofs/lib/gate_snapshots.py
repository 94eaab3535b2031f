"""Moments as the gate takes them apart, explored: `MomentTaker.scalars`, whatever it has kept.

A moment of two state variables, and perhaps of what is none, stands for one of any number: each place of
the column is treated by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from types import SimpleNamespace
from typing import Any, Final

from aeros.spec.theorems.module_copies import Code
from aeros.spec.theorems.smtlib import application, literal
from aeros.spec.theorems.symbolic_execution import Ask, explore
from aeros.spec.theorems.theorem import Obligation, Table
from proofs.lib import gate_validation as forms

MOMENTS: Final = "aeros.runtime.gate.compiled.snapshots"

_STATE: Final = ("lit", "near")
_STRANGE: Final = "mood"

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
            f"has.{_STRANGE}",
            *(f"{place}.is-same" for place in (*_STATE, _STRANGE)),
            *(f"{place}.{what}" for place in _STATE for what in ("is-list", "is-formed", "was-taken")),
        )
    ),
    *(f"(define-fun {x}.can-be-taken () Bool (and (not {x}.is-list) {x}.is-formed))" for x in _STATE),
    "(define-fun all-can () Bool"
    f" (and (not has.{_STRANGE}) {' '.join(f'{x}.can-be-taken' for x in _STATE)}))",
)
"""A moment, what was kept of an earlier one, and what comes of them.

`same-order`, `same-column`, `X.is-same`: that the names, the column, the value of X are the very objects
that were kept.  `X.was-taken`: the value that was kept of X was no list, and of its form.
"""

_KEPT_IS_RIGHT: Final = (
    f"(=> (and keeps-one same-order) (and (not has.{_STRANGE}) {' '.join(f'{x}.was-taken' for x in _STATE)}))"
)
"""The invariant: what is kept was all declared, no list, and of its form."""


class _Value:
    """A value that was measured, or its scalar."""

    def __init__(self, of: str, when: str) -> None:
        self.of, self.when = of, when


def moment_obligations() -> dict[str, Callable[[Code], Obligation]]:
    """What a moment is taken apart into, and that a value is, where it has its form."""
    return {"moment": _moment, **forms.taking_obligations()}


def _moment(code: Code) -> Obligation:
    def run(ask: Ask) -> str:
        def is_not(value: _Value, _: _Value) -> bool:
            return not ask(f"{value.of}.is-same")

        def taking(name: str, value: _Value) -> Mapping[str, _Value] | None:
            formed = value.of == name and ask(f"{name}.is-formed")
            return {name: _Value(name, "current")} if formed else None

        def type_(value: Any) -> Any:
            return list if isinstance(value, _Value) and ask(f"{value.of}.is-list") else type(value)

        def column_of(names: Iterable[str]) -> tuple[_Value, ...]:
            return tuple(_Value(name, "measured") for name in names)

        moments = code.module(MOMENTS, is_not=is_not, type=type_)
        taker = moments.MomentTaker({})
        taker._taking = {name: partial(taking, name) for name in _STATE}
        order = SimpleNamespace(names=(*_STATE, _STRANGE) if ask(f"has.{_STRANGE}") else _STATE)
        column = column_of(order.names)
        had, before = None, None
        if ask("keeps-one"):
            before = {name: _Value(name, "kept") for name in _STATE}
            # Names in another order stand for any others.
            names = order if ask("same-order") else SimpleNamespace(names=order.names[::-1])
            of_old = column if ask("same-column") else column_of(names.names)
            had = taker._taken = moments._Taken(names, of_old, dict(before))
        found = taker.scalars(SimpleNamespace(order=order, column=column))
        now = taker._taken
        is_this = now is not None and now.order is order and now.column is column and now.scalars is found
        is_untouched = now is had and (had is None or had.scalars == before)
        return application("outcome", _answer(found), literal(is_this), literal(is_untouched))

    right = " ".join(
        f"(or (= ({x} (answer found)) current)"
        f" (and keeps-one same-order {x}.is-same (= ({x} (answer found)) kept)))"
        for x in _STATE
    )
    return Obligation(
        "`MomentTaker.scalars` answers exactly where all of a moment are declared state variables, of their\n"
        "forms and no lists, whatever it kept of an earlier one; with the scalars of these very values.\n"
        "What it keeps is then this moment, or what it had.",
        _DECLARATIONS,
        f"(and (= all-can (not (= (answer found) refused))) (=> all-can (and {right}))"
        " (or (keeps-what-it-had found) (and all-can (keeps-this found))))",
        tables=(Table("found", "Outcome", explore(run)),),
        assumptions={
            "what-is-kept-is-right": _KEPT_IS_RIGHT,
            "a-column-is-its-values": "(=> (and keeps-one same-order same-column)"
            f" (and {' '.join(f'{x}.is-same' for x in _STATE)}))",
            **{
                f"what-is-no-list-stays.{x}": f"(=> (and keeps-one same-order {x}.is-same {x}.was-taken)"
                f" {x}.can-be-taken)"
                for x in _STATE
            },
        },
    )


def _answer(found: Mapping[str, _Value] | None) -> str:
    if found is None:
        return "refused"
    return application("scalars", *(found[name].when if name in found else "none" for name in _STATE))
