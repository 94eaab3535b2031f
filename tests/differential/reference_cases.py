"""The reference modules as cases of a prediction, and the prediction of a case."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

from aeros.spec.closed_loop.giving_up import AgentBeliefs, declared_beliefs
from aeros.spec.closed_loop.markov_chain import Prediction, predict
from aeros.spec.closed_loop.outcome_probabilities import with_skill_probabilities
from aeros.spec.closed_loop.transition_system import TransitionSystem
from aeros.spec.consequences.consequences import with_consequences
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Ecm
from aeros.spec.text.discovery import reference_site_path
from tests.differential.planning.small_tasks import Case
from tests.differential.planning.tree_expansion import Expected, variables

MODULES = Path(__file__).parents[2] / "ecms"
REFERENCE = ("make_dumplings", "clean_table", "fetch_object")


def reference(name: str, replans: int) -> Case:
    """A reference module in which every skill that can fail fails in three tries of ten."""
    sink = Diagnostics()
    cell = load_site(reference_site_path(), sink)
    loaded = None if cell is None else load_ecm(MODULES / name, cell, sink)
    assert cell is not None
    assert loaded is not None
    chances = {}
    for one in loaded.ecm.skills.values():
        # Those with a verdict say that the task cannot be done, which is not so here.
        failures = [each.id for each in one.outcomes.values() if each.failure and not each.verdict]
        verdicts = dict.fromkeys((each.id for each in one.outcomes.values() if each.verdict), Fraction(0))
        chances[one.id] = verdicts | {failure: Fraction(3, 10) / len(failures) for failure in failures}
    ecm = with_skill_probabilities(loaded.ecm, chances)
    (pursued,) = ecm.tasks.values()
    start = {name: pursued.initial[name] for name in variables(ecm, pursued)}
    return Case(
        ecm, pursued, replace(cell, limits=replace(cell.limits, replans=replans)).with_modules([ecm]), start
    )


def in_small(case: Case) -> Case:
    """The same at a site that measures nothing else, which is all that the loop without a plant needs."""
    state = {name: case.site.state[name] for name in case.start}
    # Nor what definitions read, so what follows from it is said of the outcomes before.
    ecm = replace(with_consequences(case.ecm, case.site), definitions={})
    return replace(case, ecm=ecm, site=replace(case.site, state=state))


def predicted(case: Case, believed: Ecm | None = None) -> Prediction:
    """The prediction of a case; of an agent whose module is `believed`, if it has another than the world."""
    return _predicted(case, declared_beliefs(believed or case.ecm))


def predicted_without_giving_up(case: Case) -> Prediction:
    """The prediction of an agent that tries until its plans are used up."""
    return _predicted(case, None)


def _predicted(case: Case, beliefs: AgentBeliefs | None) -> Prediction:
    system = TransitionSystem(case.ecm, case.task, case.site, beliefs)
    return predict(system, system.start(case.start), case.site.limits.replans)


def as_tuple(prediction: Prediction) -> Expected:
    return Expected(
        prediction.success,
        prediction.invocations,
        prediction.retries,
        prediction.recoveries,
        prediction.replans,
    )
