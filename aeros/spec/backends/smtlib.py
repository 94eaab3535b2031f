"""Questions as SMT-LIB 2.6 text for a second solver, written from the definition of the language.

This shares neither code nor form with the translation to Z3 and with `lower.py`: enumerations are data types
in place of integers, integers are of sort Int, a family is a function of its index, and a quantifier binds
its index by `let`. So a mistake in one of the two translations shows as a disagreement of the solvers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import TypeVar

from aeros.spec.backends.solver_results import Question, ScalarValue
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BoolType, EnumType, FamilyType, IntegerType, Type, VectorType

_Xyz = tuple[str, str, str]
_Read = TypeVar("_Read")


def question_script(question: Question) -> str:
    """Write a question as a script for any solver of SMT-LIB 2.6.

    Args:
        question: variables with their ranges, and conditions.

    Returns:
        Text with one assertion for each range, then one for each condition in order, and a `check-sat`.
        Each scalar variable is a constant of its name, as `p.x` or `q[member]`.
    """
    return _Script(question).text()


def literal(type_: Type, value: ScalarValue) -> str:
    """Write a value of a scalar variable, as `question_script` writes values of its type.

    Args:
        type_: the scalar type.
        value: truth value, exact real (SI), or member.

    Returns:
        The text.
    """
    match type_:
        case BoolType():
            return "true" if value else "false"
        case EnumType():
            return _member(type_, str(value))
        case IntegerType():
            return _signed(Fraction(value), str)
        case _:
            return _real(Fraction(value))


def add_points(script: str, points: Sequence[Mapping[str, str]]) -> str:
    """Add the values of points to a script, as equations that a solver reads with the right sorts.

    Args:
        script: SMT-LIB text.
        points: for each point, the value of each constant, as SMT-LIB text by name.

    Returns:
        The script without its `check-sat`, and with one more assertion for each value.
    """
    equations = [f"(assert (= {name_of(name)} {value}))" for point in points for name, value in point.items()]
    return "\n".join((script.replace("(check-sat)", ""), *equations))


def split_points(
    assertions: Sequence[_Read], points: Sequence[Mapping[str, str]]
) -> tuple[Sequence[_Read], list[Sequence[_Read]]]:
    """Split the assertions that a solver read from the text of `add_points`.

    Args:
        assertions: all assertions, as the solver represents them.
        points: the points that were added.

    Returns:
        The assertions of the script, and the equations of each point.
    """
    end = len(assertions) - sum(map(len, points))
    equations = []
    start = end
    for point in points:
        equations.append(assertions[start : start + len(point)])
        start += len(point)
    return assertions[:end], equations


class _Script:
    """Script of one question."""

    def __init__(self, question: Question) -> None:
        self._question = question
        self._vectors: dict[int, tuple[t.Term, _Xyz]] = {}
        self._enums: dict[EnumType, None] = {}
        self._tables: dict[str, t.ConstantTable] = {}
        for variable in question.variables:
            self._note_type(variable.type)
        for term in question.terms:
            self._note(term)

    def text(self) -> str:
        """Return the whole script."""
        terms = [f"(assert {self._scalar(term)})" for term in self._question.terms]
        ranges = [f"(assert {one})" for variable in self._question.variables for one in self._range(variable)]
        declared = [line for variable in self._question.variables for line in _declarations(variable)]
        tables = [
            _family(table.name, table.type, [_real(value) for value in table.values])
            for table in self._tables.values()
        ]
        sorts = [_sort(one) for one in self._enums]
        return "\n".join(("(set-logic ALL)", *sorts, *declared, *tables, *ranges, *terms, "(check-sat)\n"))

    def _note(self, term: t.Term) -> None:
        """Note the enumerations and constant families of a term."""
        for one in t.walk([term]):
            match one:
                case t.ConstantTable():  # its index has the type
                    self._tables[one.name] = one
                case t.Literal(type=type_) | t.BoundVariable(type=type_):
                    self._note_type(type_)

    def _note_type(self, type_: Type) -> None:
        if isinstance(type_, FamilyType):
            self._enums[type_.index] = None
        elif isinstance(type_, EnumType):
            self._enums[type_] = None

    def _range(self, variable: t.Variable) -> Iterator[str]:
        """Yield a condition for each scalar of a variable that has a range."""
        for name, sort in _scalars(variable):
            if name in self._question.ranges and sort in ("Int", "Real"):
                low, high = map(_real, self._question.ranges[name])
                value = f"(to_real {name_of(name)})" if sort == "Int" else name_of(name)
                yield f"(<= {low} {value} {high})"

    def _scalar(self, term: t.Term) -> str:
        """Write a condition, a real or a member.

        Raises:
            AssertionError: a condition on the past, or a vector.
        """
        match term:
            case t.Literal(value=value, type=type_):
                return literal(type_, value)
            case t.Variable(name=name, type=IntegerType()):
                return f"(to_real {name_of(name)})"
            case t.Variable(name=name) | t.BoundVariable(name=name):
                return name_of(name)
            case t.Select(family=family, index=index):
                return f"({name_of(family.name)} {self._scalar(index)})"
            case t.Component(vector=vector, axis=axis):
                return self._xyz(vector)[axis]
            case t.Not(operand=operand):
                return f"(not {self._scalar(operand)})"
            case t.And(operands=operands):
                return _joined("and", [self._scalar(one) for one in operands], "true")
            case t.Or(operands=operands):
                return _joined("or", [self._scalar(one) for one in operands], "false")
            case t.Implies(premise=premise, conclusion=conclusion):
                return f"(=> {self._scalar(premise)} {self._scalar(conclusion)})"
            case t.Compare(left=left, right=right) if _is_vector(left):
                return f"(and {' '.join(map('(= {} {})'.format, self._xyz(left), self._xyz(right)))})"
            case t.Compare(op=op, left=left, right=right):
                symbol = "=" if op == "==" else op
                return f"({symbol} {self._scalar(left)} {self._scalar(right)})"
            case t.Add(left=left, right=right):
                return f"(+ {self._scalar(left)} {self._scalar(right)})"
            case t.Multiply(left=left, right=right):
                return f"(* {self._scalar(left)} {self._scalar(right)})"
            case t.Extremum(kind=kind, left=left, right=right):
                names = f"((a {self._scalar(left)}) (b {self._scalar(right)}))"
                return f"(let {names} (ite ({'<' if kind == 'min' else '>'} a b) a b))"
            case t.Absolute(operand=operand):
                return f"(let ((a {self._scalar(operand)})) (ite (< a 0.0) (- a) a))"
            case t.Conditional(condition=condition, then=then, otherwise=otherwise):
                return f"(ite {' '.join(map(self._scalar, (condition, then, otherwise)))})"
            case t.Quantified(kind=kind, index=index, body=body):
                joint, empty = ("and", "true") if kind == "all" else ("or", "false")
                return _joined(joint, self._each(index, self._scalar(body)), empty)
            case t.Aggregate(kind="sum", index=index, body=body):
                return _joined("+", self._each(index, self._scalar(body)), "0.0")
            case t.Aggregate(index=index, body=body):
                return _joined("+", self._each(index, f"(ite {self._scalar(body)} 1.0 0.0)"), "0.0")
            case _:
                raise AssertionError(f"not a scalar condition on one state: {term}")

    def _each(self, index: t.BoundVariable, body: str) -> list[str]:
        """Write the body once for each member that the index takes."""
        name = name_of(index.name)
        return [f"(let (({name} {_member(index.type, one)})) {body})" for one in index.type.members]

    def _xyz(self, term: t.Term) -> _Xyz:
        """Write the components of a vector, each vector once, as several components are read of many."""
        if id(term) not in self._vectors:
            self._vectors[id(term)] = term, self._components(term)
        return self._vectors[id(term)][1]

    def _components(self, term: t.Term) -> _Xyz:
        match term:
            case t.Variable(name=name):
                return name_of(f"{name}.x"), name_of(f"{name}.y"), name_of(f"{name}.z")
            case t.Vector(x=x, y=y, z=z):
                return self._scalar(x), self._scalar(y), self._scalar(z)
            case t.Add(left=left, right=right):
                (a, b, c), (u, v, w) = self._xyz(left), self._xyz(right)
                return f"(+ {a} {u})", f"(+ {b} {v})", f"(+ {c} {w})"
            case t.Multiply(left=left, right=right):
                factor, (u, v, w) = self._scalar(left), self._xyz(right)
                return f"(* {factor} {u})", f"(* {factor} {v})", f"(* {factor} {w})"
            case t.Conditional(condition=condition, then=then, otherwise=otherwise):
                case_, (a, b, c), (u, v, w) = self._scalar(condition), self._xyz(then), self._xyz(otherwise)
                return f"(ite {case_} {a} {u})", f"(ite {case_} {b} {v})", f"(ite {case_} {c} {w})"
            case _:
                raise AssertionError(f"not a vector: {term}")


def name_of(name: str) -> str:
    """Quote a name; no name of AEROS has a `|` or a backslash.

    Args:
        name: name of a scalar variable, family or index.

    Returns:
        The symbol.
    """
    return f"|{name}|"


def _is_vector(term: t.Term) -> bool:
    match term:
        case t.Vector():
            return True
        case t.Variable(type=type_):
            return isinstance(type_, VectorType)
        case t.Add(left=part) | t.Multiply(right=part) | t.Conditional(then=part):
            return _is_vector(part)
        case _:
            return False


def _declarations(variable: t.Variable) -> Iterator[str]:
    scalars = list(_scalars(variable))
    for name, sort in scalars:
        yield f"(declare-const {name_of(name)} {sort})"
    if isinstance(variable.type, FamilyType):
        values = [f"(to_real {name_of(n)})" if sort == "Int" else name_of(n) for n, sort in scalars]
        yield _family(variable.name, variable.type, values)


def _scalars(variable: t.Variable) -> Iterator[tuple[str, str]]:
    """Yield the name and the sort of each scalar of a variable."""
    match variable.type:
        case VectorType():
            yield from ((f"{variable.name}.{axis}", "Real") for axis in "xyz")
        case FamilyType(index=index, element=element):
            yield from ((f"{variable.name}[{one}]", _sort_name(element)) for one in index.members)
        case type_:
            yield variable.name, _sort_name(type_)


def _sort_name(type_: Type) -> str:
    match type_:
        case BoolType():
            return "Bool"
        case IntegerType():
            return "Int"
        case EnumType(name=name):
            return name_of(name)
        case _:
            return "Real"


def _sort(enum: EnumType) -> str:
    members = " ".join(f"({_member(enum, one)})" for one in enum.members)
    return f"(declare-datatype {name_of(enum.name)} ({members}))"


def _family(name: str, type_: FamilyType, values: list[str]) -> str:
    """Define a family as a function of its index; the last value is that of every other index."""
    pairs = list(zip(type_.index.members, values, strict=True))
    _, text = pairs.pop()
    for member, value in reversed(pairs):
        text = f"(ite (= index {_member(type_.index, member)}) {value} {text})"
    sort = "Bool" if isinstance(type_.element, BoolType) else "Real"
    return f"(define-fun {name_of(name)} ((index {name_of(type_.index.name)})) {sort} {text})"


def _member(enum: EnumType, member: str) -> str:
    return name_of(f"{enum.name}/{member}")


def _joined(symbol: str, parts: list[str], empty: str) -> str:
    if len(parts) < 2:
        return parts[0] if parts else empty
    return f"({symbol} {' '.join(parts)})"


def _real(value: Fraction) -> str:
    if value.denominator == 1:
        return _signed(value, lambda one: f"{one}.0")
    return _signed(value, lambda one: f"(/ {one.numerator}.0 {one.denominator}.0)")


def _signed(value: Fraction, write: Callable[[Fraction], str]) -> str:
    return f"(- {write(-value)})" if value < 0 else write(value)
