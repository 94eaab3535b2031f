"""One skill invocation: what starts it, what comes of it, and what is kept of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from math import inf
from pathlib import Path
from typing import ClassVar

import pytest

from aeros.agent.agent import MEMORY_FILE, start_agent
from aeros.agent.execution.attempt import AttemptResult, RunningAttempt
from aeros.agent.execution.report import RunReport, StepRecord, StepRole
from aeros.agent.memory.evidence import DurationStats
from aeros.agent.memory.posterior import SuccessRecord
from aeros.agent.memory.queries import EpisodeFilter, open_memory_reader
from aeros.agent.planning.base import Planner, RulePlanner
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import TaskGraph
from aeros.agent.world.world import WorldModel
from aeros.runtime.ports import LogHead, Runtime, StepResult, StepStatus
from aeros.spec.expr.shortfall import UnmetBound
from aeros.spec.model.cause import Cause
from aeros.spec.model.ecm import Ecm
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.verification.certificate import Certificate
from tests.unit.agent.dumplings import DUMPLING, STATE, module, outcome, rule, site, skill, task
from tests.unit.agent.fake_runtime import FakeRuntime
from tests.unit.agent.kitchen import Kitchen


def run(folder: Path, runtime: Runtime, planner: Planner | None = None) -> RunReport:
    with start_agent(folder, "chef", runtime, planner) as agent:
        return agent.run("Make dumplings!")


def test_a_halt_in_a_state_that_nothing_declares_is_replanned_and_breaks_an_assumption_too(
    tmp_path: Path,
) -> None:
    runtime = FakeRuntime(endings={"wrap": [StepStatus.TIMED_OUT]}, at=site(stops_at_undeclared=True))
    assert run(tmp_path, runtime).reached
    (details,) = [details for kind, details in runtime.notes if kind == "broken-assumption"]
    assert (details["halted"], details["stops"]) == (True, False)


def test_a_broken_assumption_names_the_certificate_and_what_of_it_rests_on_outcomes(tmp_path: Path) -> None:
    proved = (
        ClaimForm.RULES_PROGRESS("make_dumplings"),
        ClaimForm.RULES_PROGRESS("other"),
        ClaimForm.ENVELOPE_OBEYS("wrap", "grip", "force"),
    )
    certificate = Certificate(
        "s", "dumpling", "1.2.3", "m", "c", {}, "d", "v", "z", dict.fromkeys(proved, "PROVED")
    )
    runtime = FakeRuntime(endings={"wrap": [{}]})
    runtime.certificates["dumpling"] = certificate
    run(tmp_path, runtime)
    (details,) = [details for kind, details in runtime.notes if kind == "broken-assumption"]
    assert details["certificate"] == certificate.digest
    assert details["version"] == "1.2.3"
    assert details["obligations"] == ["closed-loop/make_dumplings/progress"]
    with open_memory_reader(tmp_path / MEMORY_FILE) as memory:
        (kept,) = memory.broken_assumptions()
    assert (kept["skill"], kept["certificate"]) == ("dumpling.wrap", certificate.digest)
    assert kept["declared"] == ["wrapped", "misaligned"]


def test_planners_learn_why_the_plan_before_failed_and_memory_keeps_it_as_data(tmp_path: Path) -> None:
    class Listening(RulePlanner):
        heard: ClassVar[list[list[tuple[str, str]]]] = []

        def plan(self, routed: RoutedTask, world: WorldModel, modules: Mapping[str, Ecm]) -> TaskGraph:
            self.heard.append([(one.kind, one.rule) for one in world.failures])
            return super().plan(routed, world, modules)

    part = UnmetBound("human_distance", 0.41, "at least", 0.5, "m")
    cause = Cause("rule", "separation", "human_distance >= 500 mm", "ISO 13855", "site.yaml:3", (part,))
    runtime = FakeRuntime(
        endings={"boil": [StepResult(StepStatus.STOPPED, "monitor:separation", causes=(cause,))]}
    )
    with start_agent(tmp_path, "chef", runtime, Listening()) as agent:
        assert agent.run("Make dumplings!").reached
    assert Listening.heard == [[], [("rule", "separation")]]
    with open_memory_reader(tmp_path / MEMORY_FILE) as memory:
        (failed,) = memory.search(EpisodeFilter(failed=True), 9)
    assert failed["causes"][0]["shortfalls"][0]["value"] == 0.41
    assert failed["causes"][0]["at"] == "site.yaml:3"


def test_a_skill_does_not_start_where_its_hold_condition_is_not_known(tmp_path: Path) -> None:
    holding = skill("boil", outcome("cooked", {"dumpling_cooked": True}), hold="fill_level > 0.5")
    boil = task("make_dumplings", ("make dumplings",), "dumpling_cooked", rule("dumpling_cooked", "boil"))
    runtime = FakeRuntime({"dumpling": module("dumpling", (holding,), boil)})
    report = run(tmp_path, runtime)
    assert runtime.submitted == []
    assert report.reason is not None
    assert "its hold-condition `fill_level > 0.5` is not met: `fill_level` is not measured" in (report.reason)


def test_the_request_carries_the_default_inputs(tmp_path: Path) -> None:
    runtime = FakeRuntime()
    run(tmp_path, runtime)
    assert runtime.requests[-1].inputs == {"force": DUMPLING.skills["boil"].inputs["force"].default_value}


# The runner itself.


def test_a_step_that_succeeds_is_kept_in_record_and_memory() -> None:
    kitchen = Kitchen({"prepare": [StepResult(StepStatus.FINISHED, "", 5, 6, 7, {"mass": 0.25})]})
    kitchen.runtime.state |= {"dough_on_workspace": True, "filling_on_workspace": True}
    result = kitchen.attempt("prepare")
    record = StepRecord(
        StepRole.STEP,
        "dumpling",
        "prepare",
        {},
        StepStatus.FINISHED,
        "prepared",
        False,
        "",
        100.0,
        101.0,
        5,
        6,
        7,
    )
    assert result == AttemptResult(failed=False, reason="", record=record, outputs={"mass": 0.25})
    assert kitchen.runner.records == [record]
    ((number, end),) = kitchen.memory.ends
    assert (number, end.outcome, end.ended, end.counts_toward_record) == (41, "prepared", 101.0, True)
    assert kitchen.note("step-started")["inputs"] == {}
    assert kitchen.note("step-ended") == {
        "skill": "dumpling.prepare",
        "role": "step",
        "status": "finished",
        "outcome": "prepared",
        "failed": False,
        "reason": "",
        "causes": [],
    }


def test_inputs_are_written_as_json_and_submitted_exactly() -> None:
    kitchen = Kitchen(dumpling_wrapped=True)
    kitchen.attempt("boil", StepRole.RETRY)
    assert kitchen.runtime.requests[0].inputs == {"force": Fraction(1, 2)}
    (start,) = kitchen.memory.starts
    assert (start.inputs, start.role, start.task) == ({"force": 0.5}, "retry", "dumpling.make_dumplings")
    assert start.before["dumpling_wrapped"] is True
    assert kitchen.note("step-started")["inputs"] == {"force": 0.5}


def test_a_step_that_cannot_start_is_neither_submitted_nor_an_episode() -> None:
    kitchen = Kitchen()
    result = kitchen.attempt("wrap")
    assert (result.failed, result.is_retryable, result.record) == (True, False, None)
    assert "its precondition" in result.reason
    assert (kitchen.runtime.submitted, kitchen.memory.starts, kitchen.runner.records) == ([], [], [])
    assert kitchen.note("step-not-started")["reason"] == result.reason


def test_a_barred_step_is_not_started_and_planners_learn_why() -> None:
    kitchen = Kitchen()
    del kitchen.runtime.state["wrapper_aligned"]
    kitchen.runner.observe()
    kitchen.runner.bars.add("dumpling", "recover", {})
    result = kitchen.attempt("recover")
    assert "it began before a crash" in result.reason
    (cause,) = kitchen.runner.planning_world().failures
    assert (cause.kind, cause.rule) == ("interrupted", "dumpling.recover")
    assert kitchen.runner.planning_world().failures == ()


@pytest.mark.parametrize("stops", [True, False])
def test_an_undeclared_outcome_breaks_an_assumption_and_ends_the_run_where_the_site_says_so(
    *, stops: bool
) -> None:
    kitchen = Kitchen({"prepare": [{"dumpling_cooked": True}]})
    kitchen.runtime._site = site(stops_at_undeclared=stops)
    result = kitchen.attempt("prepare")
    assert (result.failed, result.is_retryable, result.ends_run) == (True, False, stops)
    broken = kitchen.note("broken-assumption")
    assert (broken["declared"], broken["certificate"], broken["obligations"]) == (["prepared"], None, [])
    assert (broken["halted"], broken["stops"]) == (False, stops)
    assert kitchen.memory.events == ["broken-assumption"]


def test_a_plan_is_remembered_with_the_state_that_it_was_made_in_once() -> None:
    kitchen = Kitchen()
    assert not kitchen.runner.has_planned_in_current_state()
    kitchen.runner.planning_world()
    kitchen.runner.planning_world()
    assert kitchen.runner.has_planned_in_current_state()
    assert len(kitchen.runner.planned_in) == 1
    kitchen.attempt("recover")
    assert not kitchen.runner.has_planned_in_current_state()


def test_values_grow_too_old_while_nothing_is_measured() -> None:
    kitchen = Kitchen(dumpling_wrapped=True)
    kitchen.runtime.clock += 5.5  # 5 s are allowed
    assert kitchen.runner.world.known == {}
    kitchen.runner.idle_until(107.0)
    assert kitchen.runner.world.known["dumpling_wrapped"] is True
    assert kitchen.runner.world.time == 107.0


def test_a_restored_run_has_the_steps_plans_and_denials_of_the_session_before() -> None:
    kitchen = Kitchen()
    kitchen.attempt("recover")
    later = Kitchen()
    later.runner.restore(kitchen.runner.records, [{"dumpling_cooked": None}], [("dumpling", "boil")])
    assert later.runner.records == kitchen.runner.records
    assert later.runner.planned_in == [{"dumpling_cooked": None}]
    assert later.runner.dispatcher.denied == {("dumpling", "boil")}


def test_a_choice_between_providers_is_reported_with_the_record_of_each() -> None:
    kitchen = Kitchen(record=SuccessRecord(3, 1))
    fold = skill("fold", outcome("folded", {"dumpling_wrapped": True}))
    ecm = module("dumpling", (*DUMPLING.skills.values(), fold), *DUMPLING.tasks.values())
    kitchen.runtime.modules = {"dumpling": replace(ecm, capabilities={"closing": ("fold", "wrap")})}
    kitchen.attempt("closing")
    chosen = kitchen.note("provider-selected")
    assert (chosen["capability"], chosen["skill"]) == ("dumpling.closing", "dumpling.fold")
    fold_option, wrap_option = chosen["options"]
    assert fold_option["record"] == {"successes": 3, "failures": 1}
    assert 0 < fold_option["drawn"] < 1
    assert (fold_option["why_not"], wrap_option["drawn"]) == ("", None)
    assert "its precondition" in wrap_option["why_not"]


def test_a_cancelled_step_says_who_cancelled_it() -> None:
    kitchen = Kitchen()
    started = kitchen.runner.start(StepRole.STEP, "dumpling", "prepare", {})
    assert isinstance(started, RunningAttempt)
    kitchen.runner.cancel(started.handle, "the time is over")
    ended = kitchen.runner.wait(inf)
    assert ended is not None
    assert ended.result == StepResult(StepStatus.CANCELLED, "the time is over")


def test_the_head_is_that_of_the_runtimes_record() -> None:
    assert Kitchen().runner.audit_head == LogHead(0, "0")


def test_the_duration_of_a_success_is_reported_where_it_is_known() -> None:
    kitchen = Kitchen(record=SuccessRecord(3, 1))
    kitchen.memory.usual = DurationStats(2.0, 1.0, 3.0, 4)
    kitchen.attempt("prepare")
    known = kitchen.note("step-started")
    assert (known["successes"], known["failures"], known["usual_seconds"]) == (3, 1, 2.0)
    kitchen = Kitchen()
    kitchen.attempt("prepare")
    assert kitchen.note("step-started")["usual_seconds"] is None


def test_a_site_that_declares_other_variables_is_measured_by_its_own() -> None:
    kitchen = Kitchen()
    only = {"dumpling_cooked": STATE["dumpling_cooked"]}
    kitchen.runtime._site = replace(site(), state=only)
    assert kitchen.runner.observe().known == {"dumpling_cooked": False}
    assert kitchen.runner.observe().known == {"dumpling_cooked": False}
