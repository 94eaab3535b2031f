from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from aeros.agent.errands import barred_skills, barred_steps, combined_report, modules_of
from aeros.agent.execution.report import RunReport
from aeros.agent.instructions.meaning import Errand, Understanding
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import PlanStep, TaskGraph
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Ecm
from aeros.spec.text.discovery import reference_site_path
from tests.unit.agent.dumplings import rule, task

ECMS = Path(__file__).parents[3] / "ecms"

MAKE = RoutedTask("m", task("make", (), "wrapper_aligned", rule("wrapper_aligned", "wrap", 1, "recover")))
SHARED = RoutedTask("m", task("fold", (), "wrapper_aligned", rule("wrapper_aligned", "recover")))


def report(name: str, *, reached: bool = True) -> RunReport:
    reason = None if reached else "no luck"
    return RunReport("both", "m", name, f"{name}_done", reached, {name: reached}, (), 1, reason)


@pytest.fixture(scope="module")
def modules() -> dict[str, Ecm]:
    sink = Diagnostics()
    site = load_site(reference_site_path(), sink)
    assert site is not None
    loaded = [load_ecm(ECMS / name, site, sink) for name in ("clean_table", "inspect_table", "serve_table")]
    return {one.ecm.id: one.ecm for one in loaded if one is not None}


def test_skills_of_prohibited_tasks_are_barred_unless_the_errand_needs_them() -> None:
    errand = Errand(SHARED)
    assert barred_skills(Understanding("", (errand,), (MAKE,)), errand, {}) == {"m.wrap"}
    assert barred_skills(Understanding("", (errand,)), errand, {}) == frozenset()


def test_a_plan_with_a_barred_skill_in_a_step_or_handler_is_refused() -> None:
    step = PlanStep("m", "recover", {}, 1, between_tries=PlanStep("m", "wrap"))
    plan = TaskGraph((step, PlanStep("m", "recover", {}, on_failure=PlanStep("m", "boil"))))
    assert barred_steps(plan, frozenset(), {}) == []
    assert barred_steps(plan, frozenset({"m.fly"}), {}) == []
    for name in ("m.wrap", "m.boil", "m.recover"):
        assert barred_steps(plan, frozenset({name}), {}) == [
            f"`{name}` belongs to a task that the instruction prohibits"
        ]


def test_a_prohibition_reaches_the_skills_behind_capabilities_and_compositions(
    modules: dict[str, Ecm],
) -> None:
    serve = RoutedTask("serve_table", modules["serve_table"].tasks["serve_table"])
    errand = Errand(MAKE)
    barred = barred_skills(Understanding("", (errand,), (serve,)), errand, modules)
    assert barred >= {
        "clean_table.wipe",
        "clean_table.verify",
        "inspect_table.inspect",
        "serve_table.find_sponge",
    }
    plan = TaskGraph((PlanStep("serve_table", "table_setting"),))
    assert barred_steps(plan, frozenset({"clean_table.wipe"}), modules) == [
        "`clean_table.wipe` belongs to a task that the instruction prohibits, and "
        "`serve_table.table_setting` may run it"
    ]


def test_the_report_of_several_errands_has_all_goals_and_the_last_result() -> None:
    assert combined_report("both", [report("one")]) == report("one")
    whole = combined_report("both", [report("one"), report("two", reached=False)])
    assert (whole.task, whole.reached, whole.reason) == ("two", False, "m.two: no luck")
    assert (whole.goal, whole.replans) == ("(one_done), then (two_done)", 2)
    assert whole.measured == {"one": True, "two": False}


def test_a_skipped_errand_is_neither_the_result_nor_measured() -> None:
    skipped = replace(report("two"), reached=False, skipped=True)
    whole = combined_report("both", [report("one"), skipped])
    assert (whole.task, whole.reached, whole.skipped) == ("one", True, False)
    assert whole.goal == "(one_done), then (two_done) skipped"
    assert whole.measured == {"one": True}
    assert combined_report("both", [skipped, skipped]).skipped


def test_an_instruction_concerns_the_modules_of_its_tasks_goals_and_conditions(
    modules: dict[str, Ecm],
) -> None:
    clean = RoutedTask("clean_table", modules["clean_table"].tasks["clean_table"])
    serve = RoutedTask("serve_table", modules["serve_table"].tasks["serve_table"])
    is_clean = clean.task.goal
    assert modules_of(Understanding("", (Errand(clean),), (serve,))) == {"clean_table"}
    assert modules_of(Understanding("", (Errand(serve),), ())) == {"serve_table", "clean_table"}
    assert modules_of(Understanding("", (Errand(MAKE),), ())) == {"m"}
    assert modules_of(Understanding("", (Errand(MAKE, is_clean), Errand(SHARED)), ())) == {"m", "clean_table"}
