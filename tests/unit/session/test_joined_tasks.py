"""Tasks of one instruction: each once, those behind a goal too, and an initial state for all."""

from __future__ import annotations

from dataclasses import replace

import pytest

from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.understand import understand
from aeros.apps.goal import parse_goal
from aeros.runtime.gate.configuration import Configuration
from aeros.session.joined_tasks import joined_task, request_for_goal, tasks_of
from aeros.spec.expr import terms as t
from aeros.spec.model.composition import Composition, Step
from aeros.spec.model.ecm import Task
from aeros.spec.model.step_graph import Seq
from tests.modules.robot import configuration_of


def around() -> Configuration:
    modules = {name: configuration_of(name).modules[name] for name in ("make_dumplings", "clean_table")}
    found = configuration_of("clean_table")
    return replace(found, site=found.site.with_modules(modules.values()), modules=modules)


def tasks(instruction: str, goal: str | None = None) -> list[str]:
    configuration = around()
    meaning = understand(instruction, configuration.modules)
    asked = None if goal is None else parse_goal(goal, configuration.site)
    return [task.id for task in tasks_of(meaning, configuration, asked)]


@pytest.mark.parametrize(
    ("instruction", "goal", "expected"),
    [
        ("make dumplings", None, ["make_dumplings"]),
        ("clean the table, then make dumplings", None, ["clean_table", "make_dumplings"]),
        (
            "clean the table, make dumplings and clean the table",
            None,
            ["clean_table", "make_dumplings"],
        ),
        ("make dumplings", "dumpling_wrapped", ["make_dumplings"]),
        ("make dumplings", "dumpling_cooked and table_wiped", ["make_dumplings", "clean_table"]),
        ("make dumplings", "table_wiped and not holding", ["make_dumplings", "clean_table"]),
    ],
)
def test_each_task_is_listed_once_and_those_behind_the_goal_last(
    instruction: str, goal: str | None, expected: list[str]
) -> None:
    assert tasks(instruction, goal) == expected


@pytest.mark.parametrize(
    ("goal", "request_"),
    [
        ("dumpling_cooked", ["make_dumplings.make_dumplings"]),
        ("table_wiped and region == left", ["clean_table.clean_table", "region=left"]),
        ("2 == count and dumpling_wrapped", ["make_dumplings.make_dumplings", "count=2"]),
        ("not (region == left) and table_wiped", ["clean_table.clean_table"]),
        ("holding and clutter_on_table", ["clean_table.clean_table"]),
        ("robot_at_bench and table_wiped", ["clean_table.clean_table"]),
        ("table_wiped and dumpling_cooked", ["clean_table.clean_table"]),
    ],
)
def test_a_goal_alone_is_of_the_task_whose_variables_it_reads(goal: str, request_: list[str]) -> None:
    configuration = around()
    assert request_for_goal(parse_goal(goal, configuration.site), configuration) == request_


def test_a_goal_that_reads_no_module_is_of_no_task() -> None:
    configuration = around()
    with pytest.raises(InstructionError, match="`holding` is of no task: give an instruction"):
        request_for_goal(parse_goal("holding", configuration.site), configuration)


def test_a_goal_of_nothing_but_values_of_parameters_moves_nothing_and_is_refused() -> None:
    configuration = around()
    for text in ("region == left", "region == left and count == 2"):
        with pytest.raises(InstructionError, match="no motion changes: add what is to be reached, as in"):
            request_for_goal(parse_goal(text, configuration.site), configuration)


def test_the_first_task_says_where_the_robot_starts() -> None:
    modules = around().modules
    bench, table = (modules[name].tasks[name] for name in ("make_dumplings", "clean_table"))
    joined: Task = joined_task([bench, table])
    assert joined.initial["base_position"] == bench.initial["base_position"] != table.initial["base_position"]
    assert joined.initial["clean_table.table_wiped"] is False
    assert (joined.id, joined.scene) == (bench.id, bench.scene)


def test_the_tasks_of_modules_whose_skills_a_composition_runs_come_after_that_of_the_instruction() -> None:
    configuration = around()
    meaning = understand("clean the table", configuration.modules)
    span = meaning.first.task.span
    wipe, wrap = (
        Step(name, skill, {}, {}, 0, None, None, span)
        for name, skill in (("wipe", "wipe"), ("wrap", "make_dumplings.wrap"))
    )
    own = Composition("tidy", t.TRUE, None, wipe, {}, span)
    assert [one.id for one in tasks_of(meaning, configuration, None, own)] == ["clean_table"]
    for both in (replace(own, body=Seq((wipe, wrap))), replace(own, handlers={"wrap": wrap})):
        listed = tasks_of(meaning, configuration, None, both)
        assert [one.id for one in listed] == ["clean_table", "make_dumplings"]
