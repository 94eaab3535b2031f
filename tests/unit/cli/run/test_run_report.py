"""Output of a run: one line for each event, and a summary with the report's numbers."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

from aeros.agent.execution.report import RunReport
from aeros.cli.run.run_report import summary
from aeros.sim.referee import GoalJudgement
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from tests.repo.tree import ROOT


def report(**changed: Any) -> RunReport:
    steps = [SimpleNamespace(role=None, allowed=5, attenuated=2, denied=1)] * 3
    given: dict[str, Any] = {
        "instruction": "x", "module": "m", "task": "t", "goal": "a and b", "reached": True,
        "measured": {"a": True, "b": None}, "steps": tuple(steps), "replans": 4, "reason": None, **changed,
    }  # fmt: skip
    return RunReport(**given)


def test_the_summary_holds_the_numbers_of_the_report() -> None:
    modules = [SimpleNamespace(claim_count=20, runtime_checked_count=3)] * 2
    proof = cast("Any", SimpleNamespace(modules=modules))
    message = summary(proof, report(), "symbolic", 12.34, 5.67)
    assert message.splitlines() == [
        "",
        "m.t: goal reached",
        "goal       a and b",
        "measured   a = true, b = unknown (symbolic plant)",
        "modules    2 proved, 40 obligations, 6 runtime-checked",
        "steps      3 run, 0 retries, 0 recoveries, 4 re-plans",
        "decisions  15 allowed, 6 attenuated, 3 denied",
        "time       12.3 s simulated, 5.7 s real",
    ]
    judged = GoalJudgement(True, False, {"a": True, "b": False})
    refereed = summary(proof, report(), "physics", 12.34, 5.67, judged).splitlines()
    assert (
        refereed[4] == "truth      goal reached: believed true, false in the simulator: a = true, b = false"
    )
    assert refereed[:4] + refereed[5:] == message.replace("symbolic", "physics").splitlines()
    blind = summary(
        proof, report(reached=False, reason="why"), "symbolic", 0.0, 0.0, failures=["dark", "late"]
    )
    assert "goal not reached: dark; then: late; then: why" in blind
    missed = summary(proof, report(reached=False, reason="why"), "symbolic", 0.0, 0.0)
    assert "m.t: goal not reached: why" in missed


def test_values_are_shown_in_their_units() -> None:
    proof = cast("Any", SimpleNamespace(modules=[]))
    diagnostics = Diagnostics()
    site = load_site(ROOT / "tests" / "corpus" / "site" / "table.yaml", diagnostics)
    assert site is not None
    values = {"dirt": 0.123456, "hand": (0.1, 0.25, -1.0), "table_tidy": True, "load": 1e-3, "odd": 0.5}
    shown = summary(proof, report(measured=values), "physics", 0.0, 0.0, declared=site.state).splitlines()[3]
    assert shown == (
        "measured   dirt = 12.35 %, hand = [0.1, 0.25, -1] m, table_tidy = true, load = 0.001 kg, odd = 0.5 "
        "(physics plant)"
    )


def test_the_reason_is_shown_harmlessly_and_on_one_line() -> None:
    proof = cast("Any", SimpleNamespace(modules=[]))
    hostile = report(reached=False, reason="raised: \x1b[2J\rm.t: goal reached\nm.t: goal reached\u202e")
    message = summary(proof, hostile, "symbolic", 0.0, 0.0).splitlines()
    assert (
        message[1] == "m.t: goal not reached: raised: \\x1b[2J\\rm.t: goal reached\\nm.t: goal reached\\u202e"
    )
