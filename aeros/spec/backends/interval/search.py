"""Branch-and-prune search: boxes are narrowed and divided until a model is found or none is left."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from itertools import islice, product
from typing import Final

from aeros.spec.backends.interval.box import Box, pick_value, propagate_sums
from aeros.spec.backends.interval.formula import Formula, OpaqueLiteral
from aeros.spec.backends.interval.interval import End, Interval
from aeros.spec.backends.interval.narrowing import SearchState, narrow, propagate_disjunctions
from aeros.spec.backends.solver_results import SatResult, ScalarValue, SolverAnswer
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.types import IntegerType

MAX_BOXES: Final = 24
"""Boxes examined for one question; a question that needs more is left to the SMT solver."""

MAX_CORNERS: Final = 16
"""Points tried near the corners of a box whose middle is no model."""

_ENDS: Final[tuple[End, ...]] = ("low", "high")


class BranchAndPrune:
    """Search for one question."""

    def __init__(self, scalars: Sequence[t.Variable]) -> None:
        self._scalars = scalars
        self._left = MAX_BOXES

    def run(self, formulas: list[Formula], box: Box) -> SolverAnswer | None:
        """Check if all formulas hold somewhere in a box.

        Args:
            formulas: formulas that must hold together; used up.
            box: values of each scalar variable.

        Returns:
            SAT with a model, or UNSAT; None if that takes more than `MAX_BOXES` boxes or finds no model.
        """
        return self._search(formulas, SearchState(box, [], []))

    def _search(self, pending: list[Formula], open_: SearchState) -> SolverAnswer | None:
        """Search as `run` does; the arguments are used up."""
        self._left -= 1
        if self._left < 0:
            return None
        while pending or open_.open_disjunctions:
            if not narrow(open_, pending):
                return SolverAnswer(SatResult.UNSAT, {})
            pending = propagate_disjunctions(open_)
            if not pending and open_.open_disjunctions:
                return self._branch_on_disjunction(open_)
        return self._model(open_)

    def _branch_on_disjunction(self, open_: SearchState) -> SolverAnswer | None:
        first = min(open_.open_disjunctions, key=lambda choice: len(choice.parts))
        open_.open_disjunctions.remove(first)
        is_known = True
        for part in first.parts:
            answer = self._search([part], open_.copy())
            if answer is not None and answer.result is SatResult.SAT:
                return answer
            is_known &= answer is not None
        return SolverAnswer(SatResult.UNSAT, {}) if is_known else None

    def _model(self, open_: SearchState) -> SolverAnswer | None:
        """Return a point of the box at which the unsettled conditions hold too, if one is found."""
        model = self._sample_point(open_.box, {})
        if model is None or _replays(open_.opaque_literals, model):
            return None if model is None else SolverAnswer(SatResult.SAT, model)
        spoken = sorted(
            frozenset[str]().union(*(t.variables_of(other.term) for other in open_.opaque_literals))
        )
        real = [name for name in spoken if isinstance(open_.box[name], Interval)]
        for ends in islice(product(_ENDS, repeat=len(real)), MAX_CORNERS):
            model = self._sample_point(open_.box, dict(zip(real, ends, strict=True)))
            if model is not None and _replays(open_.opaque_literals, model):
                return SolverAnswer(SatResult.SAT, model)
        return None

    def _sample_point(self, within: Box, ends: Mapping[str, End]) -> dict[str, ScalarValue] | None:
        """Pick a point of the box: for each variable in turn, a value that the sums leave it."""
        box = dict(within)
        model: dict[str, ScalarValue] = {}
        summed = {name for of in box if isinstance(of, tuple) for name, _ in of}
        for scalar in sorted(self._scalars, key=lambda scalar: scalar.name not in summed):
            name = scalar.name
            value = model[name] = pick_value(scalar, box[name], ends.get(name))
            if isinstance(value, Fraction):
                if isinstance(scalar.type, IntegerType) and value.denominator != 1:
                    return None
                box[name] = Interval(value, value)
                if name in summed and not propagate_sums(box):
                    return None
        return model


def _replays(others: Iterable[OpaqueLiteral], model: Mapping[str, ScalarValue]) -> bool:
    return all(is_true(other.term, model) is other.is_true for other in others)
