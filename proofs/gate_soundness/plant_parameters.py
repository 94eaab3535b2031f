"""The plant is given the parameters that were decided: their conversion changes no value."""

from __future__ import annotations

from typing import Any, Final

from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.symbolic_execution import DecideBranch, SymbolicValue, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation

REQUEST_CHECK: Final = "aeros.runtime.gate.request_check"

_NUMBERS: Final = ("number", "first", "second", "inner")
_FLAG: Final = True
_MEMBER: Final = "slow"


class _Double(SymbolicValue):
    """The double that `float` makes from a whole number."""

    __slots__ = ()


def plant_parameters(code: ModuleSource) -> TheoremObligation:
    """Build the obligation: a number, a list with a list in it, a flag and a member of an enumeration."""

    def type_of(value: Any) -> type:
        if isinstance(value, _Double):
            return float
        if isinstance(value, SymbolicValue):
            return int if value.ask(f"{value.term}.is-whole") else float
        return type(value)

    checks = code.module(
        REQUEST_CHECK, type=type_of, int=int, float=lambda value: _Double(value.term, value.ask)
    )

    def leaf(value: Any) -> str:
        if not isinstance(value, SymbolicValue):
            return "exactly" if value is _FLAG or value is _MEMBER else "changed"
        is_whole = value.term in _NUMBERS and type_of(value) is int
        return f"({'integer' if is_whole else 'double'} {value.term})"

    def run(ask: DecideBranch) -> str:
        number, first, second, inner = (SymbolicValue(name, ask) for name in _NUMBERS)
        given = {"list": [first, second, [inner]], "flag": _FLAG, "number": number, "member": _MEMBER}
        declared = dict.fromkeys(("number", "list", "member", "flag"))
        found = checks.to_plant_parameters(declared, given)
        match found, list(found) == list(declared):
            case {"number": a, "list": (b, c, (d,)), "member": e, "flag": f}, True:
                return f"(plant {' '.join(map(leaf, (a, b, c, d, e, f)))})"
        return "others"

    fields = " ".join(f"(field.{number} Plant)" for number in range(6))
    return TheoremObligation(
        "`to_plant_parameters` gives every declared parameter in the declared order, with the value that\n"
        "was decided: whole numbers as doubles, lists as tuples, in lists too; everything else as it is.",
        (
            "(declare-datatypes ((Plant 0)) (((double (value Real)) (integer (whole Real)) (exactly)"
            f" (changed) (plant {fields}) (others))))",
            *(f"(declare-const {name} Real)" for name in _NUMBERS),
            *(f"(declare-const {name}.is-whole Bool)" for name in _NUMBERS),
        ),
        f"(= executed (plant {' '.join(f'(double {name})' for name in _NUMBERS)} exactly exactly))",
        tables=(SymbolicFunction("executed", "Plant", execute_symbolically(run)),),
    )
