"""A stand-in for `maraboupy.MarabouCore`, which no lock file holds: Z3 decides its queries exactly."""

from __future__ import annotations

from types import SimpleNamespace

import z3


class Equation:
    """Sum of factors times variables = scalar."""

    def __init__(self) -> None:
        self.terms: list[tuple[float, int]] = []
        self.scalar = 0.0

    def addAddend(self, factor: float, variable: int) -> None:  # noqa: N802 - Marabou's name
        """Add a factor times a variable."""
        assert factor, "Marabou is given no zeros"
        self.terms.append((factor, variable))

    def setScalar(self, scalar: float) -> None:  # noqa: N802
        """Set what the sum is equal to."""
        self.scalar = scalar


class InputQuery:
    """Bounds, equations and clips on numbered variables."""

    def __init__(self) -> None:
        self.variables: list[z3.ArithRef] = []
        self.lower: dict[int, float] = {}
        self.upper: dict[int, float] = {}
        self.asserted: list[z3.BoolRef] = []
        self.marked: dict[str, list[int]] = {"in": [], "out": []}

    def setNumberOfVariables(self, count: int) -> None:  # noqa: N802
        """Declare the variables."""
        self.variables = [z3.Real(f"v{number}") for number in range(count)]

    def setLowerBound(self, variable: int, bound: float) -> None:  # noqa: N802
        """Set the least value of a variable."""
        self.lower[variable] = bound

    def setUpperBound(self, variable: int, bound: float) -> None:  # noqa: N802
        """Set the greatest value of a variable."""
        self.upper[variable] = bound

    def addEquation(self, equation: Equation) -> None:  # noqa: N802
        """Add an equation."""
        total = sum(real(factor) * self.variables[at] for factor, at in equation.terms)
        self.asserted.append(total == real(equation.scalar))

    def markInputVariable(self, variable: int, number: int) -> None:  # noqa: N802
        """Number an input."""
        assert number == len(self.marked["in"])
        self.marked["in"].append(variable)

    def markOutputVariable(self, variable: int, number: int) -> None:  # noqa: N802
        """Number an output."""
        assert number == len(self.marked["out"])
        self.marked["out"].append(variable)


def real(number: float) -> z3.RatNumRef:
    top, bottom = number.as_integer_ratio()
    return z3.Q(top, bottom)


def _clip(query: InputQuery, source: int, target: int, lower: float, upper: float) -> None:
    x = query.variables[source]
    x = z3.If(x < real(lower), real(lower), x)
    query.asserted.append(query.variables[target] == z3.If(x > real(upper), real(upper), x))


def _relu(query: InputQuery, source: int, target: int) -> None:
    x = query.variables[source]
    query.asserted.append(query.variables[target] == z3.If(x < 0, z3.RealVal(0), x))


def _solve(query: InputQuery, options: SimpleNamespace, redirect: str) -> tuple[str, dict[int, float], None]:
    assert (vars(options), redirect) == ({"_verbosity": 0}, "/dev/null"), "it would write to our output"
    assert query.lower.keys() == query.upper.keys() == {*range(len(query.variables))}
    solver = z3.Solver()
    for number, variable in enumerate(query.variables):
        solver.add(real(query.lower[number]) <= variable, variable <= real(query.upper[number]))
    solver.add(*query.asserted)
    if solver.check() == z3.unsat:
        return "unsat", {}, None
    model = solver.model()
    values = [model.eval(one, model_completion=True).as_fraction() for one in query.variables]
    return "sat", {number: float(one) for number, one in enumerate(values)}, None


MARABOU = SimpleNamespace(
    Equation=Equation,
    InputQuery=InputQuery,
    Options=SimpleNamespace,
    addClipConstraint=_clip,
    addReluConstraint=_relu,
    solve=_solve,
)
