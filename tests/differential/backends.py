"""Back ends for the conformance suite, and twins with one deliberate mistake each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import cast

from aeros.spec.backends import compiled, z3_solver
from aeros.spec.backends.smtlib import literal, question_script
from aeros.spec.backends.solver_results import Question, SatResult, ScalarValue
from aeros.spec.backends.z3_scripts import truths_at
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower, scalar_variables, values_by_scalar
from aeros.spec.expr.random_conditions import Ranges, Raw, exact_environment, to_scalars
from aeros.spec.expr.semantics import is_true

Variables = Mapping[str, t.Variable]
Values = Mapping[str, Raw]


@dataclass
class Closure:
    name: str = "closure"

    def decide(self, term: t.Term, variables: Variables, ranges: Ranges, values: Values) -> bool:
        return compiled.compile_condition(term, ranges)(to_scalars(values))


@dataclass
class Inline:
    name: str = "closure on local variables"

    def decide(self, term: t.Term, variables: Variables, ranges: Ranges, values: Values) -> bool:
        scalars = to_scalars(values)
        local = {name: f"x{number}" for number, name in enumerate(scalars)}
        (code,), names = compiled.inline_conditions([term], ranges, local)
        function = eval(f"lambda {', '.join(local.values())}: {code}", dict(names))  # noqa: S307
        return bool(function(*scalars.values()))


@dataclass
class Together:
    name: str = "closure of several conditions"

    def decide(self, term: t.Term, variables: Variables, ranges: Ranges, values: Values) -> bool:
        scalars = to_scalars(values)
        truths = compiled.compile_conditions([term, t.Not(term)], ranges)
        held, failed = truths.evaluate(*(scalars[name] for name in truths.argument_names))
        assert held is not failed
        return held


@dataclass
class Smt:
    """Asks for the term and for its negation: exactly one may be possible."""

    name: str = "smt"

    def decide(self, term: t.Term, variables: Variables, ranges: Ranges, values: Values) -> bool:
        session = z3_solver.IncrementalSolver(variables.values(), ranges)
        scalars = values_by_scalar(variables, exact_environment(values))
        given = cast("Mapping[str, ScalarValue]", scalars)
        results = [session.check_at_values(given, question).result for question in (term, t.Not(term))]
        assert set(results) == {SatResult.SAT, SatResult.UNSAT}, results
        return results[0] is SatResult.SAT


@dataclass
class TextForCvc5:
    """Evaluated by Z3, so not by the reader that it is written for."""

    name: str = "SMT-LIB text for the second solver"

    def decide(self, term: t.Term, variables: Variables, ranges: Ranges, values: Values) -> bool:
        script = question_script(Question([*variables.values()], ranges, [term]))
        types = {part.name: part.type for one in variables.values() for part in scalar_variables(one)}
        scalars = values_by_scalar(variables, exact_environment(values))
        point = {name: literal(types[name], cast("ScalarValue", value)) for name, value in scalars.items()}
        (truths,) = truths_at(script, [point])
        assert all(truths[:-1])
        return truths[-1] is True


@dataclass
class Lowered:
    name: str = "semantics of the lowered term"

    def decide(self, term: t.Term, variables: Variables, ranges: Ranges, values: Values) -> bool:
        return is_true(lower(term), values_by_scalar(variables, exact_environment(values)))


@dataclass
class Floats:
    """The broken twin that computes in doubles and trusts them."""

    name: str = "floats without a filter"

    def decide(self, term: t.Term, variables: Variables, ranges: Ranges, values: Values) -> bool:
        generator = compiled._CodeGenerator(ranges)
        generator._filtered_comparison = (  # type: ignore[method-assign]
            lambda term, a, b: f"({a.code} {term.op} {b.code})"
        )
        return bool(generator.function("v", generator.condition(lower(term)))(to_scalars(values)))


@dataclass
class StrictOrder:
    """The broken twin that reads `<=` as `<`."""

    name: str = "strict order"

    def decide(self, term: t.Term, variables: Variables, ranges: Ranges, values: Values) -> bool:
        generator = compiled._CodeGenerator(ranges)
        right = generator._comparison
        generator._comparison = (  # type: ignore[method-assign]
            lambda term: right(replace(term, op="<") if term.op == "<=" else term)
        )
        return bool(generator.function("v", generator.condition(lower(term)))(to_scalars(values)))


@dataclass
class NarrowBand:
    """The broken twin whose bound on the rounding error is a million times too small."""

    name: str = "narrow band"

    def decide(self, term: t.Term, variables: Variables, ranges: Ranges, values: Values) -> bool:
        generator = compiled._CodeGenerator(ranges)
        right = generator._filtered_comparison
        generator._filtered_comparison = (  # type: ignore[method-assign]
            lambda term, a, b: right(term, _shrunk(a), _shrunk(b))
        )
        return bool(generator.function("v", generator.condition(lower(term)))(to_scalars(values)))


@dataclass
class Constant:
    """The broken twin that allows everything."""

    name: str = "always true"

    def decide(self, term: t.Term, variables: Variables, ranges: Ranges, values: Values) -> bool:
        return True


def _shrunk(real: compiled._RealCode) -> compiled._RealCode:
    return compiled._RealCode(real.code, real.magnitude / 10**6, real.error / 10**6, real.peak)
