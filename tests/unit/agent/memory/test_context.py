"""The context of a record: task, code, and the predicates that preconditions read, and nothing else."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from aeros.agent.memory.context import evidence_context
from aeros.agent.world.world import WorldModel, world_from_readings
from aeros.runtime.ports import Reading
from aeros.spec.model.configured import BoundNames
from aeros.spec.model.ecm import Skill
from aeros.spec.model.perception import Thing
from tests.unit.agent.dumplings import FORCE, PREDICATES, STATE, module, outcome, skill

DONE = outcome("done", {})
ALIGN = skill("align", DONE, precondition="not wrapper_aligned and fill_level > 0.5")
PLACE = skill("place", DONE, precondition="area == pot or inputs.force > 0", inputs={"force": FORCE})
LOOK = skill("look", DONE)
KITCHEN = replace(module("kitchen", (ALIGN, PLACE, LOOK)), code_digest="v1")


def world(**values: Any) -> WorldModel:
    return world_from_readings(STATE, {name: Reading(value, 0.0) for name, value in values.items()}, 0.0)


def context(*skills: Skill, **values: Any) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(evidence_context("kitchen.cook", KITCHEN, skills, world(**values)))
    return found


def test_predicates_count_and_neither_quantities_nor_inputs_do() -> None:
    assert context(ALIGN, wrapper_aligned=True, fill_level=0.75) == {
        "task": "kitchen.cook",
        "code": "v1",
        "predicates": {"wrapper_aligned": True},
    }
    assert context(PLACE, area="pot")["predicates"] == {"area": "pot"}


def test_the_text_is_canonical() -> None:
    text = evidence_context("t", KITCHEN, (ALIGN, PLACE), world(wrapper_aligned=True, area="pot"))
    assert text == '{"code": "v1", "predicates": {"area": "pot", "wrapper_aligned": true}, "task": "t"}'


def test_a_skill_without_precondition_reads_nothing() -> None:
    assert context(LOOK, wrapper_aligned=True)["predicates"] == {}
    assert context()["predicates"] == {}


def test_unmeasured_variables_are_unknown_in_the_context() -> None:
    assert context(ALIGN)["predicates"] == {"wrapper_aligned": None}


def test_a_capability_has_the_predicates_of_all_its_providers() -> None:
    both = context(ALIGN, PLACE, LOOK, area="table", wrapper_aligned=False)
    assert both["predicates"] == {"area": "table", "wrapper_aligned": False}


def test_another_version_of_the_code_or_another_task_is_another_context() -> None:
    seen = world(wrapper_aligned=True)
    contexts = {
        evidence_context("kitchen.cook", KITCHEN, (ALIGN,), seen),
        evidence_context("kitchen.clean", KITCHEN, (ALIGN,), seen),
        evidence_context("kitchen.cook", replace(KITCHEN, code_digest="v2"), (ALIGN,), seen),
    }
    assert len(contexts) == 3


@given(st.permutations((ALIGN, PLACE, LOOK)), st.sets(st.sampled_from(PREDICATES)))
def test_the_text_does_not_depend_on_the_order_of_the_skills(skills: list[Skill], true: set[str]) -> None:
    seen = world(**dict.fromkeys(true, True), area="pot")
    one = evidence_context("t", KITCHEN, skills, seen)
    assert one == evidence_context("t", KITCHEN, sorted(skills, key=lambda skill: skill.id), seen)


def test_the_kind_of_a_thing_that_the_task_says_counts() -> None:
    things = {"dish": Thing("kitchen.dish", "", kind_from="area"), "cup": Thing("kitchen.cup", "cup")}
    kitchen = replace(KITCHEN, things=things)
    text = evidence_context("kitchen.cook", kitchen, (LOOK,), world(area="pot"))
    assert json.loads(text)["predicates"] == {"area": "pot"}
    other = evidence_context("kitchen.cook", KITCHEN, (LOOK,), world(area="pot"), [kitchen])
    assert json.loads(other)["predicates"] == {"area": "pot"}


def test_other_values_of_parameters_are_another_context_and_without_any_the_code_alone_counts() -> None:
    seen = world(wrapper_aligned=True)
    slow, fast = (
        replace(KITCHEN, names=BoundNames(parameters={"pace": pace})) for pace in ("1 m/s", "2 m/s")
    )
    contexts = [evidence_context("kitchen.cook", one, (ALIGN,), seen) for one in (KITCHEN, slow, fast, slow)]
    assert len({*contexts}) == 3
    assert contexts[1] == contexts[3]
    assert json.loads(contexts[0])["code"] == "v1"
