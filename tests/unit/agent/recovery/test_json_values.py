"""A written plan reads back as the same plan, to the last fraction; anything else is refused."""

from __future__ import annotations

import json
from fractions import Fraction
from typing import Any

import pytest

from aeros.agent.execution.attempt import AttemptResult
from aeros.agent.planning.base import RulePlanner
from aeros.agent.planning.compositions import composition_to_graph
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import PlanStep, TaskGraph, verify_plan
from aeros.agent.recovery.json_values import ValueSerializer
from aeros.agent.world.world import WorldModel
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import ActionCondition, Ecm
from aeros.spec.model.rules import Conjunct
from aeros.spec.model.site import Site
from aeros.spec.model.step_graph import HeldPart, If, Par, Seq, TimedPart
from aeros.spec.text.discovery import reference_site_path
from tests.repo.tree import ROOT
from tests.unit.agent.dumplings import SPAN, term

WORLD = WorldModel(0.0, {}, {}, {})


def there_and_back(value: Any) -> Any:
    writing = ValueSerializer((AttemptResult,))
    return writing.decode(json.loads(json.dumps(writing.encode(value), allow_nan=False)))


@pytest.fixture(scope="module")
def site() -> Site:
    found = load_site(reference_site_path(), Diagnostics())
    assert found is not None
    return found


@pytest.fixture(scope="module", params=["make_dumplings", "clean_table", "fetch_object"])
def ecm(request: pytest.FixtureRequest, site: Site) -> Ecm:
    loaded = load_ecm(ROOT / "ecms" / request.param, site, Diagnostics())
    assert loaded is not None
    return loaded.ecm


def test_plans_by_rules_read_back_as_they_were(ecm: Ecm, site: Site) -> None:
    for task in ecm.tasks.values():
        plan = RulePlanner().plan(RoutedTask(ecm.id, task), WORLD, {ecm.id: ecm})
        again = there_and_back(plan)
        assert again == plan
        assert verify_plan(again, {ecm.id: ecm}, site) == []


def test_compositions_read_back_as_they_were(ecm: Ecm, site: Site) -> None:
    for composition in ecm.compositions.values():
        plan = composition_to_graph(composition, ecm.id)
        again = there_and_back(plan)
        # Where in a file a part stands is not kept: it says nothing of what is run.
        assert str(again) != ""
        assert [str(part) for part in again.parts] == [str(part) for part in plan.parts]
        assert again.steps == plan.steps
        assert verify_plan(again, {ecm.id: ecm}, site) == []


def test_every_kind_of_part_is_written() -> None:
    step = PlanStep("kitchen", "knead", {"force": Fraction(1, 3), "at": (Fraction(1), 2.5)}, 1, id="one")
    other = PlanStep(
        "kitchen", "boil", flows={"force": ("one", "felt")}, between_tries=step, needs_recovery=True
    )
    condition = term("fill_level <= 0.25 and not wrapper_aligned and joint[j1] < 1")
    clause = ActionCondition(condition, "so", SPAN, (Conjunct(condition, SPAN),))
    timed = TimedPart(step, SPAN, True, Fraction(1, 3))
    plan = TaskGraph(
        (
            Par((step, other), SPAN),
            If(condition, "so", Seq((step,)), None, SPAN),
            HeldPart(timed, SPAN, False, clause),
        )
    )
    again = there_and_back(plan)
    held = again.parts[2]
    assert (held.condition.term, held.part.timeout) == (condition, Fraction(1, 3))
    assert [one.term for one in held.condition.conjuncts] == [condition]
    assert again.steps == plan.steps
    assert again.parts[1].condition == condition


def test_an_attempt_is_written_as_it_was() -> None:
    attempt = AttemptResult(failed=True, reason="“no”\n", is_retryable=True, outputs={"felt": 0.1})
    assert there_and_back(attempt) == attempt


@pytest.mark.parametrize(
    "written",
    [
        {"class": "Popen", "fields": {"args": "true"}},
        {"class": "Step", "fields": {"modul": "kitchen"}},
        {"class": "Step"},
        {"enum": "role", "value": "king"},
        {"enum": "unheard of", "value": 1},
        {"fraction": "1/0"},
        {"fraction": "one third"},
        {"span": "elsewhere"},
        {},
    ],
)
def test_malformed_values_are_refused(written: Any) -> None:
    with pytest.raises(ValueError, match=r".+"):
        ValueSerializer().decode(written)


def test_values_of_unknown_classes_cannot_be_written() -> None:
    with pytest.raises(ValueError, match="a object cannot be written"):
        ValueSerializer().encode({"a": [object()]})
