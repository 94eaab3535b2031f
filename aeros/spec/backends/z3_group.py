"""Questions that are put to Z3 together: as a rule a few models and one `unsat` settle those of a module.

Each question gets a Boolean that is equal to its conditions. Z3 is asked for values that make one of the open
Booleans true, and prefers to make as many true as it can. All that are true have a model. When none can be
true any more, every question that is left is unsatisfiable.

This is sound although the questions share variables and ranges: the Booleans are definitions, so values that
meet one question's conditions meet the whole set; and the ranges alone are shown to have values first.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import partial
from typing import Any

import z3

from aeros.spec.backends.solver_results import Question, SatResult, SolverAnswer
from aeros.spec.backends.z3_solver import IncrementalSolver, SolverContext
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import scalar_variables

_Range = tuple[Fraction, Fraction]

_ALWAYS_TRUE = 1
"""Z3 tries `true` first for a Boolean that it has to choose, so that one model settles many questions."""


def answer_together(questions: Sequence[Question], rlimit: int, seconds: float) -> list[SolverAnswer | None]:
    """Answer questions together.

    Args:
        questions: the questions. A model and a budget may depend on which are asked together, and in which
            order; whether there is a model does not.
        rlimit: budget of one step, in Z3's resource units.
        seconds: time limit of one step, s.

    Returns:
        For each question SAT with a model of its scalars, UNSAT, or None if it has to be asked alone.
    """
    answers: list[SolverAnswer | None] = [None] * len(questions)
    context = SolverContext()
    for numbers in _compatible(questions):
        group = _Group([questions[number] for number in numbers], context, rlimit, seconds)
        for place, answer in enumerate(group.answers()):
            answers[numbers[place]] = answer
    return answers


class _Group:
    """Questions in which each name has one type and one range."""

    def __init__(
        self, questions: Sequence[Question], context: SolverContext, rlimit: int, seconds: float
    ) -> None:
        self._scalars = [
            [scalar for variable in question.variables for scalar in scalar_variables(variable)]
            for question in questions
        ]
        scalars = {scalar.name: scalar for own in self._scalars for scalar in own}
        ranges: dict[str, _Range] = {}
        for question in questions:
            ranges |= question.ranges
        self._questions = questions
        self._encoder = IncrementalSolver(scalars.values(), ranges, rlimit, context, seconds=seconds)
        self._make, self._context = context.expressions, context.z3
        self._solver = self._encoder.new_solver(with_assumptions=True)
        self._solver.set("phase_selection", _ALWAYS_TRUE)
        self._solver.push()  # so that Z3 does not build its other solver, of 16 MB, for the first check

    def answers(self) -> list[SolverAnswer | None]:
        answers: list[SolverAnswer | None] = [None] * len(self._questions)
        if self._solver.check() != z3.sat:
            return answers
        holds = [z3.Bool(f"question!{number}", self._context) for number in range(len(answers))]
        conditions = [self._encoder.encode_all(question.terms) for question in self._questions]
        equal = map(partial(self._make.comparison, "=="), holds, conditions)
        self._solver.add(self._make.conjunction(list(equal)))
        open_ = set(range(len(holds)))
        while open_:
            # Stays true: what is open later is part of what is open now.
            self._solver.add(self._make.disjunction([holds[number] for number in sorted(open_)]))
            outcome = self._check()
            true = []
            if outcome == z3.sat:
                model = self._solver.model()
                true = [number for number in sorted(open_) if self._make.is_true_in(model, holds[number])]
                scalars = {one.name: one for number in true for one in self._scalars[number]}
                values = self._encoder.values(model, scalars.values())
                for number in true:
                    own = {one.name: values[one.name] for one in self._scalars[number]}
                    answers[number] = SolverAnswer(SatResult.SAT, own)
            if outcome == z3.unsat:
                for number in open_:
                    answers[number] = SolverAnswer(SatResult.UNSAT, {})
                break
            if not true:
                break
            open_.difference_update(true)
        return answers

    def _check(self) -> Any:
        try:
            return self._solver.check()
        except z3.Z3Exception:
            return z3.unknown


def _compatible(questions: Sequence[Question]) -> Iterator[list[int]]:
    """Yield the numbers of questions in which each name has one type and one range."""
    groups: list[tuple[dict[str, tuple[t.Variable, _Range | None]], list[int]]] = []
    for number, question in enumerate(questions):
        own = {
            scalar.name: (scalar, question.ranges.get(scalar.name))
            for variable in question.variables
            for scalar in scalar_variables(variable)
        }
        for names, numbers in groups:
            if all(names.get(name, one) == one for name, one in own.items()):
                names |= own
                numbers.append(number)
                break
        else:
            groups.append((own, [number]))
    for _, numbers in groups:
        yield numbers
