"""Calls of tools of an MCP server that is started for the call."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.tools.exchange import ToolError
from aeros.spec.model.policy import IsolationPolicy
from aeros.spec.model.tools import McpService
from tests.unit.runtime.tools.services import PYTHON, mcp_server

POLICY = IsolationPolicy(refuses_missing=False)


def call_mcp(
    service: McpService, policy: IsolationPolicy, parameters: dict[str, float], seconds: float
) -> Any:
    """Call a tool; the SDK is imported here, as each process that collects the tests would take a second."""
    from aeros.runtime.tools import mcp_service

    return mcp_service.call_mcp(service, policy, parameters, seconds)


@pytest.mark.parametrize(("tool", "seconds"), [("ask", 3.0), ("text", 7.5)])
def test_the_result_is_structured_or_the_json_of_its_text(tmp_path: Path, tool: str, seconds: float) -> None:
    service = McpService(tool, mcp_server(tmp_path), confinement=PYTHON)
    assert call_mcp(service, POLICY, {"mass": 0.05}, 20.0) == {"cooking_time": seconds}


@pytest.mark.parametrize(
    ("tool", "seconds", "reason"),
    [("fail", 20.0, "it reported an error: no such book"), ("sleep", 1.5, "did not answer within 1.5 s")],
)
def test_a_result_that_is_none_has_a_reason(tmp_path: Path, tool: str, seconds: float, reason: str) -> None:
    with pytest.raises(ToolError, match=reason):
        call_mcp(McpService(tool, mcp_server(tmp_path), confinement=PYTHON), POLICY, {}, seconds)


@pytest.mark.parametrize(
    "service",
    [McpService("ask", ("/no/such/program",)), McpService("ask", url="http://127.0.0.1:1/mcp")],
)
def test_a_server_that_is_not_there_has_a_reason(service: McpService) -> None:
    with pytest.raises(ToolError, match=r"cannot be (reached|started)"):
        call_mcp(service, POLICY, {}, 5.0)
