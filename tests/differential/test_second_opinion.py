"""A second opinion on every query of the reference modules and of both corpora.

cvc5 agrees with Z3, and the texts for both with the definition of the language. `make test` asks half of
the queries of the reference modules and of a twentieth of the cases, and compares texts of a tenth of them;
`make deep` takes all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cache
from pathlib import Path

import pytest

import aeros.spec.verification.examine
import aeros.spec.verification.second_opinion.cross_check
from aeros.spec.backends.answer_store import AnswerStore
from aeros.spec.backends.cvc5_solver import Cvc5
from aeros.spec.backends.oracle import SolverQuery
from aeros.spec.backends.solver_results import SecondSolver
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.verification.second_opinion.cross_check import SecondSolverReport, cross_check_queries
from aeros.spec.verification.second_opinion.encodings import compare_encodings
from aeros.spec.verification.verify import verify

ROOT = Path(__file__).parents[2]
CORPUS = ROOT / "tests" / "corpus"
BEYOND = {"safety/tidy/reach/short-reach (accepted/distance_within_a_cube/ecm.yaml)"}
"""Question that cvc5 does not decide: a point within a cube is no farther away than the cube's corner."""


def _queries_of(cases: Sequence[Path], folder: Path) -> list[SolverQuery]:
    """Each query of the reference modules and of `cases` once: cases repeat what others ask."""
    found: dict[object, SolverQuery] = {}

    def collect(
        asked: Iterable[SolverQuery], second: SecondSolver, progress: Callable[[str], None]
    ) -> SecondSolverReport:
        for one in asked:
            q = one.question
            found.setdefault((tuple(q.variables), tuple(q.ranges.items()), tuple(q.terms)), one)
        return SecondSolverReport(second.name, 0, ())

    store = AnswerStore(folder / "answers.sqlite3")
    second = Cvc5()
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(CORPUS)
        patch.setattr(aeros.spec.verification.second_opinion.cross_check, "cross_check_queries", collect)
        patch.setattr(
            aeros.spec.verification.examine,
            "examine_site",
            cache(aeros.spec.verification.examine.examine_site),
        )
        verify([ROOT / "ecms"], reference_site_path(), store=store, second=second)
        for path in cases:
            if (path / "site.yaml").exists():
                verify([Path("site/idle")], path / "site.yaml", store=store, second=second)
            elif path.is_dir():
                verify([path], Path("site/table.yaml"), store=store, second=second)
    return list(found.values())


@pytest.mark.parametrize(
    ("step", "least"), [(20, 120), pytest.param(1, 800, marks=pytest.mark.deep)], ids=["some", "all"]
)
def test_solvers_and_texts_agree_on_the_reference_modules_and_both_corpora(
    step: int, least: int, tmp_path: Path
) -> None:
    cases = [
        one.relative_to(CORPUS) for pattern in ("accepted/*", "rejected/*/*") for one in CORPUS.glob(pattern)
    ]
    questions = _queries_of(sorted(cases)[::step], tmp_path)[:: min(step, 2)]
    about = {one.description.partition("/")[0] for one in questions}
    assert about >= {"policy", "permission", "safety", "composition", "an explanation"}
    agreement = cross_check_queries(questions, Cvc5(rlimit=300_000), lambda _: None)
    undecided = {about for about, _ in agreement.undecided_queries}
    assert undecided <= BEYOND
    assert step > 1 or undecided == BEYOND
    assert agreement.agreed_count > least
    encodings = compare_encodings(questions[:: min(step, 5)], lambda _: None)
    assert encodings.unread_questions == ()
    assert encodings.truth_count > 80 * least
