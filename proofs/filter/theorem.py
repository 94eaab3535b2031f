"""An answer of the floating-point filter has the certain sign, by its error bound: theorem 7."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any, Final, cast

from aeros.spec.expr import terms as t
from aeros.spec.expr.doubles import adjacent_doubles
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import NUMBER
from aeros.spec.theorems.module_copies import ModuleSource, Mutant
from aeros.spec.theorems.smtlib import smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, SymbolicValue, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, Theorem, TheoremObligation

CLOSURE: Final = "aeros.spec.backends.compiled"

_UNIT_ROUNDOFF: Final = smt_literal(Fraction(1, 2**53))
_UNDERFLOW_ERROR: Final = smt_literal(Fraction(1, 2**1075))
_A, _B = (t.Variable(name, RealType(NUMBER), t.VariableRole.STATE) for name in "ab")

_OPERANDS: Final = (
    "(define-fun size ((x Real)) Real (ite (<= 0 x) x (- x)))",
    *(
        f"(declare-const {one}{what} Real)"
        for one in "ab"
        for what in ("", ".computed", ".magnitude", ".error")
    ),
    "(declare-fun rounded (Real) Real)",
)
"""Each operand exactly, as it is computed in doubles, and the two bounds that the compiler has of that."""

_BOUNDED: Final = {
    f"bounds-of-{one}": f"(and (<= (size {one}.computed) {one}.magnitude)"
    f" (<= (size (- {one}.computed {one})) {one}.error))"
    for one in "ab"
}
"""An induction over the term: what holds of the operands, is to hold of what is made of them."""


class _SymbolicDouble(SymbolicValue):
    """A double; each operation on it is rounded once, as CPython performs each on its own."""

    __slots__ = ()

    def _rounded(self, exact: SymbolicValue) -> _SymbolicDouble:
        return _SymbolicDouble(f"(rounded {exact.term})", self.ask)

    def __add__(self, other: Any) -> _SymbolicDouble:
        return self._rounded(SymbolicValue.__add__(self, other))

    def __sub__(self, other: Any) -> _SymbolicDouble:
        return self._rounded(SymbolicValue.__sub__(self, other))

    def __mul__(self, other: Any) -> _SymbolicDouble:
        return self._rounded(SymbolicValue.__mul__(self, other))

    def __abs__(self) -> _SymbolicDouble:
        return _SymbolicDouble(SymbolicValue.__abs__(self).term, self.ask)


def _max_stub(*values: Any) -> Any:
    """Stands for `max`, of bounds and of doubles."""
    first, *others = values
    for other in others:
        either = SymbolicValue("", first.ask)._apply("ite", other <= first, first, other)
        first = type(first)(either.term, first.ask)
    return first


def _min_stub(first: Any, other: Any) -> Any:
    """Stands for `min`."""
    either = SymbolicValue("", first.ask)._apply("ite", first <= other, first, other)
    return type(first)(either.term, first.ask)


def _generator(code: ModuleSource, ask: DecideBranch) -> tuple[Any, Mapping[str, Any]]:
    """The compiler, with operands of which only bounds are known; and what their code then stands for."""
    closure = code.module(CLOSURE, max=_max_stub)
    generator = closure._CodeGenerator({}, {"a": "a", "b": "b"})

    def real(term: Any) -> Any:
        bounds = (SymbolicValue(f"{term.name}.{what}", ask) for what in ("magnitude", "error", "magnitude"))
        return closure._RealCode(term.name, *bounds)

    generator._real = real
    computed: dict[str, Any] = {one: _SymbolicDouble(f"{one}.computed", ask) for one in "ab"}
    return generator, {**computed, "abs": abs, "max": _max_stub, "min": _min_stub}


@dataclass(frozen=True)
class _RoundedOperation:
    """One operation of the language: its term, what it means, and what IEEE 754 says of its rounding."""

    term: t.Term
    exact: str
    assumptions: Mapping[str, str]


def _rounding(of: str, underflow: str = "") -> dict[str, str]:
    room = f"(* {_UNIT_ROUNDOFF} (size {of}))"
    return {"ieee": f"(<= (size (- (rounded {of}) {of})) {f'(+ {room} {underflow})' if underflow else room})"}


def _product(x: str, size_of_x: str, y: str, size_of_y: str) -> str:
    """An instance of what the obligation `products` says."""
    return f"(<= (size (* {x} {y})) (* {size_of_x} {size_of_y}))"


_ROUNDING_ERRORS: Final = {one: f"(- {one}.computed {one})" for one in "ab"}

_OPERATIONS: Final = {
    "sum": _RoundedOperation(t.Add(_A, _B), "(+ a b)", _rounding("(+ a.computed b.computed)")),
    "product": _RoundedOperation(
        t.Multiply(_A, _B),
        "(* a b)",
        {
            **_rounding("(* a.computed b.computed)", _UNDERFLOW_ERROR),
            "products.0": _product("a.computed", "a.magnitude", "b.computed", "b.magnitude"),
            "products.1": _product("a.computed", "a.magnitude", _ROUNDING_ERRORS["b"], "b.error"),
            "products.2": _product(_ROUNDING_ERRORS["a"], "a.error", "b.computed", "b.magnitude"),
            "products.3": _product(_ROUNDING_ERRORS["a"], "a.error", _ROUNDING_ERRORS["b"], "b.error"),
        },
    ),
    "least": _RoundedOperation(t.Extremum("min", _A, _B), "(ite (<= a b) a b)", {}),
    "largest": _RoundedOperation(t.Extremum("max", _A, _B), "(ite (<= a b) b a)", {}),
    "size-of": _RoundedOperation(t.Absolute(_A), "(size a)", {}),
}


def _bounds(name: str, code: ModuleSource) -> TheoremObligation:
    operation = _OPERATIONS[name]

    def run(ask: DecideBranch, what: str) -> str:
        generator, values = _generator(code, ask)
        made = generator._arithmetic(operation.term)
        if what == "computed":
            # It is the compiler's own code.
            return str(eval(made.code, {"__builtins__": {}}, dict(values)).term)  # noqa: S307
        return str(getattr(made, what).term)

    return TheoremObligation(
        f"`_CodeGenerator._arithmetic` of a {name.replace('-', ' ')}: what its code computes is no larger\n"
        "than its `magnitude`, and no further from the exact value than its `error`.",
        _OPERANDS,
        f"(and (<= (size computed) magnitude) (<= (size (- computed {operation.exact})) error))",
        tables=tuple(
            SymbolicFunction(what, "Real", execute_symbolically(partial(run, what=what)))
            for what in ("computed", "magnitude", "error")
        ),
        assumptions={**_BOUNDED, **operation.assumptions},
    )


def _products(_: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "A product is no larger than that of bounds of its factors.",
        (*_OPERANDS[:1], *(f"(declare-const {name} Real)" for name in ("x", "y", "x.size", "y.size"))),
        "(<= (size (* x y)) (* x.size y.size))",
        assumptions={"x": "(<= (size x) x.size)", "y": "(<= (size y) y.size)"},
    )


def _comparison(op: str, code: ModuleSource) -> TheoremObligation:
    """With the exact interpreter put aside, and the bound as large as it has to be or larger."""

    def run(ask: DecideBranch, what: str) -> str:
        generator, values = _generator(code, ask)
        needed: list[Any] = []

        class Bound:
            """Symbolic error bound, as the code writes it."""

            def __repr__(self) -> str:
                return "bound"

        def at_least(value: Any) -> Any:
            needed.append(value)
            return Bound()

        closure_of = type(generator)._comparison.__globals__
        closure_of["_round_up"] = at_least
        closure_of["_is_real"] = lambda _: True
        generator._values = lambda _: ""
        closure_of["_LARGEST"] = SymbolicValue("largest", ask)
        term = t.Compare(cast("Any", op), _A, _B)
        written = generator._comparison(term)
        if what == "needed":
            return str(needed[0].term) if needed else "0.0"
        exact = f"({'=' if op == '==' else op} a b)"
        names = {name: (lambda: ask(exact)) for name in generator.names if name.startswith("exact")}
        values = {**values, **names, "bound": SymbolicValue("bound", ask)}
        return smt_literal(bool(eval(written, {"__builtins__": {}, **values})))  # noqa: S307 - the compiler's own

    return TheoremObligation(
        f"The code of `a {op} b` answers as the exact comparison does: at once where the sign is certain,\n"
        "and by the exact interpreter in between.",
        (*_OPERANDS, "(declare-const bound Real)", "(declare-const largest Real)"),
        f"(= answer ({'=' if op == '==' else op} a b))",
        tables=(
            SymbolicFunction("needed", "Real", execute_symbolically(partial(run, what="needed"))),
            SymbolicFunction("answer", "Bool", execute_symbolically(partial(run, what="answer"))),
        ),
        assumptions={
            **_BOUNDED,
            **_rounding("(- a.computed b.computed)"),
            "bound": "(<= needed bound)",
            "errors": "(and (<= 0 a.error) (<= 0 b.error))",
            "zero": "(=> (= a.computed b.computed) (= (rounded (- a.computed b.computed)) 0.0))",
            "order": "(and (=> (< a.computed b.computed) (< (rounded (- a.computed b.computed)) 0.0))"
            " (=> (< b.computed a.computed) (< 0.0 (rounded (- a.computed b.computed)))))",
        },
    )


def _constant_comparison(op: str, flipped: bool, code: ModuleSource) -> TheoremObligation:
    constant = Fraction(1, 10)
    below, above = map(Fraction, adjacent_doubles(constant))
    closure = code.module(CLOSURE)

    def run(ask: DecideBranch) -> str:
        written = closure._compare_to_constant("x", op, constant, flipped=flipped)
        return smt_literal(bool(eval(written, {"__builtins__": {}, "x": SymbolicValue("x", ask)})))  # noqa: S307

    sides = (smt_literal(constant), "x") if flipped else ("x", smt_literal(constant))
    shown = ("1/10", "x") if flipped else ("x", "1/10")
    return TheoremObligation(
        f"The code of `{shown[0]} {op} {shown[1]}` answers exactly of every double x, though 1/10 is none.",
        ("(declare-const x Real)",),
        f"(= answer ({'=' if op == '==' else op} {sides[0]} {sides[1]}))",
        tables=(SymbolicFunction("answer", "Bool", execute_symbolically(run)),),
        assumptions={"a-double": f"(or (<= x {smt_literal(below)}) (<= {smt_literal(above)} x))"},
    )


_COMPARED: Final = {"less": "<", "at-most": "<=", "equal": "=="}

_OBLIGATIONS: dict[str, Callable[[ModuleSource], TheoremObligation]] = {
    **{f"bounds-of-{name}": partial(_bounds, name) for name in _OPERATIONS},
    "products": _products,
    **{f"{name}": partial(_comparison, op) for name, op in _COMPARED.items()},
    **{
        f"{name}-{'constant-first' if flipped else 'constant-last'}": partial(
            _constant_comparison, op, flipped
        )
        for name, op in _COMPARED.items()
        for flipped in (False, True)
        if not (flipped and op == "==")
    },
}

THEOREM = Theorem(
    "if the gate's floating-point filter gives a result, the exact comparison gives the same result",
    _OBLIGATIONS,
    (
        Mutant(
            "forgets-that-a-sum-is-rounded",
            "bounds-of-sum",
            CLOSURE,
            "error = a.error + b.error + UNIT_ROUNDOFF * total\n"
            '                return _derived_real(f"({a.code} + {b.code})"',
            'error = a.error + b.error\n                return _derived_real(f"({a.code} + {b.code})"',
        ),
        Mutant(
            "forgets-underflow",
            "bounds-of-product",
            CLOSURE,
            "error = carried + UNIT_ROUNDOFF * total + UNDERFLOW_ERROR",
            "error = carried + UNIT_ROUNDOFF * total",
        ),
        Mutant(
            "takes-the-better-of-two-bounds",
            "bounds-of-largest",
            CLOSURE,
            "max(a.magnitude, b.magnitude), max(a.error, b.error), a, b",
            "max(a.magnitude, b.magnitude), a.error, a, b",
        ),
        Mutant(
            "forgets-that-the-difference-is-rounded",
            "less",
            CLOSURE,
            "bound = _round_up(a.error + b.error + UNIT_ROUNDOFF * (a.magnitude + b.magnitude))",
            "bound = _round_up(a.error)",
        ),
        Mutant(
            "rounds-a-constant-the-wrong-way",
            "less-constant-last",
            CLOSURE,
            'else f"({code} < {above!r})"',
            'else f"({code} < {below!r})"',
        ),
    ),
)
