"""Snapshots as the gate unpacks them, explored: `SnapshotUnpacker.scalars`.

A snapshot of two state variables, and perhaps of one undeclared name, stands for one of any size: each
place of the column is treated by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from types import SimpleNamespace
from typing import Final

from aeros.runtime.ports import ColumnNames
from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.smtlib import smt_apply
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation
from proofs.lib import gate_validation as forms

SNAPSHOTS: Final = "aeros.runtime.gate.compiled.codegen"

_STATE: Final = ("lit", "near")
_UNDECLARED_NAME: Final = "mood"

_DECLARATIONS: Final = (
    "(declare-datatypes ((Scalars 0)) (((current) (none))))",
    f"(declare-datatypes ((Answer 0)) (((refused) (scalars {' '.join(f'({x} Scalars)' for x in _STATE)}))))",
    f"(declare-const has.{_UNDECLARED_NAME} Bool)",
    *(f"(declare-const {x}.is-formed Bool)" for x in _STATE),
    "(define-fun all-can () Bool"
    f" (and (not has.{_UNDECLARED_NAME}) {' '.join(f'{x}.is-formed' for x in _STATE)}))",
)
"""A snapshot, and what is unpacked of it."""


class _SymbolicValue:
    """A value that was measured, or its scalar."""

    def __init__(self, of: str, when: str) -> None:
        self.of, self.time = of, when


def snapshot_obligations() -> dict[str, Callable[[ModuleSource], TheoremObligation]]:
    """Make the obligations on unpacking a snapshot and each well-formed value."""
    return {"moment": _snapshot_obligation, **forms.unpacking_obligations()}


def _snapshot_obligation(code: ModuleSource) -> TheoremObligation:
    def run(ask: DecideBranch) -> str:
        def unpack(name: str, value: _SymbolicValue) -> Mapping[str, _SymbolicValue] | None:
            formed = value.of == name and ask(f"{name}.is-formed")
            return {name: _SymbolicValue(name, "current")} if formed else None

        unpacker = code.module(SNAPSHOTS).SnapshotUnpacker({})
        unpacker._unpackers = {name: partial(unpack, name) for name in _STATE}
        order = ColumnNames((*_STATE, _UNDECLARED_NAME) if ask(f"has.{_UNDECLARED_NAME}") else _STATE)
        column = tuple(_SymbolicValue(name, "measured") for name in order.names)
        return _answer(unpacker.scalars(SimpleNamespace(order=order, column=column)))

    return TheoremObligation(
        "`SnapshotUnpacker.scalars` answers exactly where all of a snapshot are declared state variables of\n"
        "their forms, with the scalars of these very values.",
        _DECLARATIONS,
        "(and (= all-can (not (= found refused)))"
        f" (=> all-can (and {' '.join(f'(= ({x} found) current)' for x in _STATE)})))",
        tables=(SymbolicFunction("found", "Answer", execute_symbolically(run)),),
    )


def _answer(scalars: Mapping[str, _SymbolicValue] | None) -> str:
    if scalars is None:
        return "refused"
    return smt_apply("scalars", *(scalars[name].time if name in scalars else "none" for name in _STATE))
