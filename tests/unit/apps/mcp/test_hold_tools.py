"""Tools that hold the robot act at once; the one that lets it go on needs the operator."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from aeros.apps.mcp.approvals import approve, reject
from aeros.apps.mcp.tool_arguments import ToolCallError
from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.registry.control_page import MotionTimeoutError
from aeros.spec.model.policy import McpPolicy
from tests.unit.apps.mcp.cells import FREE, Cell, cell, dumplings


@pytest.fixture(scope="module")
def configuration() -> Configuration:
    return dumplings()


@pytest.fixture
def free(configuration: Configuration, tmp_path: Path) -> Iterator[Cell]:
    with cell(configuration, tmp_path, FREE) as one:
        yield one


@pytest.mark.parametrize("policy", [McpPolicy(), FREE])
def test_to_resume_needs_the_operator_on_every_site(
    policy: McpPolicy, configuration: Configuration, tmp_path: Path
) -> None:
    with cell(configuration, tmp_path, policy) as one:
        assert one.call("resume") == {"status": "the robot is neither paused nor stopped"}
        assert one.call("pause") == {"status": "paused"}
        id_ = one.call("resume")["operator"].split()[-1]
        assert one.call("resume")["operator"].split()[-1] == id_
        assert one.call("state")["operator"] == "pause"
        reject(tmp_path / "state", id_)
        again = one.call("resume")["operator"].split()[-1]
        assert again != id_
        approve(tmp_path / "state", again)
        assert one.call("resume") == {"status": "resumed"}
        assert one.call("state")["operator"] == "run"
        assert one.noted("mcp-resumed")[0]["approved"]["by"]


def test_a_pause_does_not_take_a_stop_back(free: Cell) -> None:
    free.call("stop")
    assert free.call("pause") == {"status": "stopped"}


def test_a_stop_that_comes_late_voids_plans_and_approvals_all_the_same(
    configuration: Configuration, tmp_path: Path
) -> None:
    with cell(configuration, tmp_path, McpPolicy()) as one:
        plan = one.proposed()
        approve(tmp_path / "state", one.call("execute_plan", plan=plan)["operator"].split()[-1])
        one.operator.after_asked = late
        for tool in ("pause", "stop"):
            with pytest.raises(
                ToolCallError, match="still moving after 10 s; use the robot's emergency stop"
            ):
                one.call(tool)
        one.operator.after_asked = None
        one.operator.ask(OperatorCommand.RUN)
        with pytest.raises(ToolCallError, match="unknown plan"):
            one.call("execute_plan", plan=plan)
        assert list((tmp_path / "state" / "approvals").iterdir()) == []
        for event in ("mcp-paused", "mcp-stopped"):
            assert one.noted(event) == [{"client": "a client 1.0", "still_moving": True}]


def late() -> None:
    """Do as the control page does if an action goes on."""
    raise MotionTimeoutError("after 10 s")
