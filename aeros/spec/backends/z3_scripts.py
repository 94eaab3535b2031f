"""SMT-LIB text by Z3: solved, or evaluated at given values."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import z3

from aeros.spec.backends.resource_limit import DEFAULT_RLIMIT
from aeros.spec.backends.smtlib import add_points, split_points
from aeros.spec.backends.solver_results import NoAnswerError, SatResult, ScriptAnswer


def solve_script(script: str, rlimit: int = DEFAULT_RLIMIT) -> ScriptAnswer:
    """Check if the assertions of a script can hold together.

    Args:
        script: SMT-LIB text with one `check-sat`.
        rlimit: budget in Z3's resource units.

    Returns:
        SAT with a model, UNSAT with the size of an unsat core, or UNKNOWN with the reason.
    """
    context = z3.Context()
    solver = z3.Solver(ctx=context)
    solver.set("random_seed", 0)
    solver.set("rlimit", rlimit)
    try:
        for number, assertion in enumerate(z3.parse_smt2_string(script, ctx=context)):
            solver.assert_and_track(assertion, f"assertion!{number}")
        outcome = solver.check()
    except z3.Z3Exception as error:
        return ScriptAnswer(SatResult.UNKNOWN, {}, 0, 0, str(error))
    spent = solver.statistics().get_key_value("rlimit count")
    if outcome == z3.unsat:
        return ScriptAnswer(SatResult.UNSAT, {}, len(solver.unsat_core()), spent)
    if outcome == z3.unknown:
        return ScriptAnswer(SatResult.UNKNOWN, {}, 0, spent, solver.reason_unknown())
    model = solver.model()
    # Z3's model also has defined functions and names of assertions: keep only declared constants.
    declared = set(_DECLARED.findall(script))
    constants = [constant for constant in model.decls() if constant.name() in declared]
    return ScriptAnswer(
        SatResult.SAT, {constant.name(): model[constant].sexpr() for constant in constants}, 0, spent
    )


_DECLARED = re.compile(r"^\(declare-const (\S+) ", re.MULTILINE)


def truths_at(script: str, points: Sequence[Mapping[str, str]]) -> list[list[bool | None]]:
    """Evaluate the assertions of a script at points, without solving.

    Args:
        script: SMT-LIB text.
        points: for each point, the value of each constant of the script, as SMT-LIB text by name.

    Returns:
        For each point the truth of each assertion in order; None where no truth value is left.

    Raises:
        NoAnswerError: Z3 cannot read the script.
    """
    try:
        parsed = z3.parse_smt2_string(add_points(script, points), ctx=z3.Context())
    except z3.Z3Exception as error:
        raise NoAnswerError(str(error)) from error
    assertions, values = split_points(list(parsed), points)
    if not assertions:
        return [[] for _ in points]
    whole = z3.And(*assertions)  # values are put into all at once, as each call takes long
    truths = []
    for point in values:
        closed = z3.substitute(whole, *((equal.arg(0), equal.arg(1)) for equal in point))
        truths.append([_truth(z3.simplify(one)) for one in closed.children()])
    return truths


def _truth(expression: object) -> bool | None:
    return True if z3.is_true(expression) else False if z3.is_false(expression) else None
