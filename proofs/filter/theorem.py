"""Where the floating-point filter answers, its error bound makes the sign certain: theorem 7."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any, Final, cast

from aeros.spec.expr import terms as t
from aeros.spec.expr.doubles import neighbours
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import NUMBER
from aeros.spec.theorems.module_copies import Code, Mutant
from aeros.spec.theorems.smtlib import literal
from aeros.spec.theorems.symbolic_execution import Ask, Symbol, explore
from aeros.spec.theorems.theorem import Obligation, Table, Theorem

CLOSURE: Final = "aeros.spec.backends.compiled"

_U: Final = literal(Fraction(1, 2**53))
_ETA: Final = literal(Fraction(1, 2**1075))
_A, _B = (t.Variable(name, RealType(NUMBER), t.Role.STATE) for name in "ab")

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


class _Double(Symbol):
    """A double; each operation on it is rounded once, as CPython performs each on its own."""

    __slots__ = ()

    def _rounded(self, exact: Symbol) -> _Double:
        return _Double(f"(rounded {exact.term})", self.ask)

    def __add__(self, other: Any) -> _Double:
        return self._rounded(Symbol.__add__(self, other))

    def __sub__(self, other: Any) -> _Double:
        return self._rounded(Symbol.__sub__(self, other))

    def __mul__(self, other: Any) -> _Double:
        return self._rounded(Symbol.__mul__(self, other))

    def __abs__(self) -> _Double:
        return _Double(Symbol.__abs__(self).term, self.ask)


def _largest(*values: Any) -> Any:
    """Stands for `max`, of bounds and of doubles."""
    first, *others = values
    for other in others:
        either = Symbol("", first.ask)._with("ite", other <= first, first, other)
        first = type(first)(either.term, first.ask)
    return first


def _smallest(first: Any, other: Any) -> Any:
    """Stands for `min`."""
    either = Symbol("", first.ask)._with("ite", first <= other, first, other)
    return type(first)(either.term, first.ask)


def _generator(code: Code, ask: Ask) -> tuple[Any, Mapping[str, Any]]:
    """The compiler, with operands of which only bounds are known; and what their code then stands for."""
    closure = code.module(CLOSURE, max=_largest)
    generator = closure._Generator({}, {"a": "a", "b": "b"})

    def real(term: Any) -> Any:
        bounds = (Symbol(f"{term.name}.{what}", ask) for what in ("magnitude", "error", "magnitude"))
        return closure._Real(term.name, *bounds)

    generator._real = real
    computed: dict[str, Any] = {one: _Double(f"{one}.computed", ask) for one in "ab"}
    return generator, {**computed, "abs": abs, "max": _largest, "min": _smallest}


@dataclass(frozen=True)
class _Operation:
    """One operation of the language: its term, what it means, and what IEEE 754 says of its rounding."""

    term: t.Term
    exact: str
    assumed: Mapping[str, str]


def _rounding(of: str, underflow: str = "") -> dict[str, str]:
    room = f"(* {_U} (size {of}))"
    return {"ieee": f"(<= (size (- (rounded {of}) {of})) {f'(+ {room} {underflow})' if underflow else room})"}


def _product(x: str, size_of_x: str, y: str, size_of_y: str) -> str:
    """An instance of what the obligation `products` says."""
    return f"(<= (size (* {x} {y})) (* {size_of_x} {size_of_y}))"


_WRONG: Final = {one: f"(- {one}.computed {one})" for one in "ab"}

_OPERATIONS: Final = {
    "sum": _Operation(t.Add(_A, _B), "(+ a b)", _rounding("(+ a.computed b.computed)")),
    "product": _Operation(
        t.Multiply(_A, _B),
        "(* a b)",
        {
            **_rounding("(* a.computed b.computed)", _ETA),
            "products.0": _product("a.computed", "a.magnitude", "b.computed", "b.magnitude"),
            "products.1": _product("a.computed", "a.magnitude", _WRONG["b"], "b.error"),
            "products.2": _product(_WRONG["a"], "a.error", "b.computed", "b.magnitude"),
            "products.3": _product(_WRONG["a"], "a.error", _WRONG["b"], "b.error"),
        },
    ),
    "least": _Operation(t.Extremum("min", _A, _B), "(ite (<= a b) a b)", {}),
    "largest": _Operation(t.Extremum("max", _A, _B), "(ite (<= a b) b a)", {}),
    "size-of": _Operation(t.Absolute(_A), "(size a)", {}),
}


def _bounds(name: str, code: Code) -> Obligation:
    operation = _OPERATIONS[name]

    def run(ask: Ask, what: str) -> str:
        generator, values = _generator(code, ask)
        made = generator._arithmetic(operation.term)
        if what == "computed":
            # It is the compiler's own code.
            return str(eval(made.code, {"__builtins__": {}}, dict(values)).term)  # noqa: S307
        return str(getattr(made, what).term)

    return Obligation(
        f"`_Generator._arithmetic` of a {name.replace('-', ' ')}: what its code computes is no larger than\n"
        "its `magnitude`, and no further from the exact value than its `error`.",
        _OPERANDS,
        f"(and (<= (size computed) magnitude) (<= (size (- computed {operation.exact})) error))",
        tables=tuple(
            Table(what, "Real", explore(partial(run, what=what)))
            for what in ("computed", "magnitude", "error")
        ),
        assumptions={**_BOUNDED, **operation.assumed},
    )


def _products(_: Code) -> Obligation:
    return Obligation(
        "A product is no larger than that of bounds of its factors.",
        (*_OPERANDS[:1], *(f"(declare-const {name} Real)" for name in ("x", "y", "x.size", "y.size"))),
        "(<= (size (* x y)) (* x.size y.size))",
        assumptions={"x": "(<= (size x) x.size)", "y": "(<= (size y) y.size)"},
    )


def _comparison(op: str, code: Code) -> Obligation:
    """With the exact interpreter put aside, and the bound as large as it has to be or larger."""

    def run(ask: Ask, what: str) -> str:
        generator, values = _generator(code, ask)
        needed: list[Any] = []

        class Bound:
            """How the bound is written in the code."""

            def __repr__(self) -> str:
                return "bound"

        def at_least(value: Any) -> Any:
            needed.append(value)
            return Bound()

        closure_of = type(generator)._comparison.__globals__
        closure_of["_at_least"] = at_least
        closure_of["_is_real"] = lambda _: True
        generator._values = lambda _: ""
        closure_of["_LARGEST"] = Symbol("largest", ask)
        term = t.Compare(cast("Any", op), _A, _B)
        written = generator._comparison(term)
        if what == "needed":
            return str(needed[0].term) if needed else "0.0"
        exact = f"({'=' if op == '==' else op} a b)"
        names = {name: (lambda: ask(exact)) for name in generator.names if name.startswith("exact")}
        values = {**values, **names, "bound": Symbol("bound", ask)}
        return literal(bool(eval(written, {"__builtins__": {}, **values})))  # noqa: S307 - the compiler's own

    return Obligation(
        f"The code of `a {op} b` answers as the exact comparison does: at once where the sign is certain,\n"
        "and by the exact interpreter in between.",
        (*_OPERANDS, "(declare-const bound Real)", "(declare-const largest Real)"),
        f"(= answer ({'=' if op == '==' else op} a b))",
        tables=(
            Table("needed", "Real", explore(partial(run, what="needed"))),
            Table("answer", "Bool", explore(partial(run, what="answer"))),
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


def _against(op: str, flipped: bool, code: Code) -> Obligation:
    constant = Fraction(1, 10)
    below, above = map(Fraction, neighbours(constant))
    closure = code.module(CLOSURE)

    def run(ask: Ask) -> str:
        written = closure._against_constant("x", op, constant, flipped=flipped)
        return literal(bool(eval(written, {"__builtins__": {}, "x": Symbol("x", ask)})))  # noqa: S307

    sides = (literal(constant), "x") if flipped else ("x", literal(constant))
    shown = ("1/10", "x") if flipped else ("x", "1/10")
    return Obligation(
        f"The code of `{shown[0]} {op} {shown[1]}` answers exactly of every double x, though 1/10 is none.",
        ("(declare-const x Real)",),
        f"(= answer ({'=' if op == '==' else op} {sides[0]} {sides[1]}))",
        tables=(Table("answer", "Bool", explore(run)),),
        assumptions={"a-double": f"(or (<= x {literal(below)}) (<= {literal(above)} x))"},
    )


_COMPARED: Final = {"less": "<", "at-most": "<=", "equal": "=="}

_OBLIGATIONS: dict[str, Callable[[Code], Obligation]] = {
    **{f"bounds-of-{name}": partial(_bounds, name) for name in _OPERATIONS},
    "products": _products,
    **{f"{name}": partial(_comparison, op) for name, op in _COMPARED.items()},
    **{
        f"{name}-{'constant-first' if flipped else 'constant-last'}": partial(_against, op, flipped)
        for name, op in _COMPARED.items()
        for flipped in (False, True)
        if not (flipped and op == "==")
    },
}

THEOREM = Theorem(
    "wherever the gate's floating-point filter answers, the exact comparison has that answer",
    _OBLIGATIONS,
    (
        Mutant(
            "forgets-that-a-sum-is-rounded",
            "bounds-of-sum",
            CLOSURE,
            'error = a.error + b.error + U * total\n                return _joined(f"({a.code} + {b.code})"',
            'error = a.error + b.error\n                return _joined(f"({a.code} + {b.code})"',
        ),
        Mutant(
            "forgets-underflow",
            "bounds-of-product",
            CLOSURE,
            "error = carried + U * total + ETA",
            "error = carried + U * total",
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
            "bound = _at_least(a.error + b.error + U * (a.magnitude + b.magnitude))",
            "bound = _at_least(a.error)",
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
