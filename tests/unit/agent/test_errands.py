from __future__ import annotations

from aeros.agent.errands import barred_skills, barred_steps, combined_report
from aeros.agent.execution.report import RunReport
from aeros.agent.instructions.understand import Errand, Understanding
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import PlanStep, TaskGraph
from tests.unit.agent.dumplings import rule, task

MAKE = RoutedTask("m", task("make", (), "wrapper_aligned", rule("wrapper_aligned", "wrap", 1, "recover")))
SHARED = RoutedTask("m", task("fold", (), "wrapper_aligned", rule("wrapper_aligned", "recover")))


def report(name: str, *, reached: bool = True) -> RunReport:
    reason = None if reached else "no luck"
    return RunReport("both", "m", name, f"{name}_done", reached, {name: reached}, (), 1, reason)


def test_skills_of_prohibited_tasks_are_barred_unless_the_errand_needs_them() -> None:
    errand = Errand(SHARED)
    assert barred_skills(Understanding("", (errand,), (MAKE,)), errand) == {"m.wrap"}
    assert barred_skills(Understanding("", (errand,)), errand) == frozenset()


def test_a_plan_with_a_barred_skill_in_a_step_or_handler_is_refused() -> None:
    step = PlanStep("m", "recover", {}, 1, "wrap")
    plan = TaskGraph((step, PlanStep("m", "recover", {}, handler=PlanStep("m", "boil", {}))))
    assert barred_steps(plan, frozenset()) == []
    assert barred_steps(plan, frozenset({"m.fly"})) == []
    for name in ("m.wrap", "m.boil", "m.recover"):
        assert barred_steps(plan, frozenset({name})) == [
            f"`{name}` belongs to a task that the instruction prohibits"
        ]


def test_the_report_of_several_errands_has_all_goals_and_the_last_result() -> None:
    assert combined_report("both", [report("one")]) == report("one")
    whole = combined_report("both", [report("one"), report("two", reached=False)])
    assert (whole.task, whole.reached, whole.reason) == ("two", False, "m.two: no luck")
    assert (whole.goal, whole.replans) == ("(one_done), then (two_done)", 2)
    assert whole.measured == {"one": True, "two": False}
