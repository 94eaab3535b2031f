"""Handlers of the MCP server, asked by the protocol's own client in this process, in both of its eras."""

from __future__ import annotations

import json
from collections.abc import Awaitable, Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from aeros.apps.mcp.approvals import approve, reject
from aeros.runtime.execution.governor import OperatorCommand
from aeros.spec.model.policy import Execute, McpPolicy
from tests.unit.apps.mcp.cells import FREE, LAID_OUT, PREPARE, Cell, cell, dumplings

pytestmark = pytest.mark.skipif(find_spec("mcp") is None, reason="the extra `mcp` is not installed")

ERAS = ("legacy", pytest.param("auto", marks=pytest.mark.deep))
ASKING = McpPolicy(Execute.ELICITATION)


def talk(one: Cell, era: str, conversation: Callable[[Any], Awaitable[None]], **options: Any) -> None:
    """Let a client of the protocol's SDK talk to a server of this cell."""
    import anyio
    import mcp

    from aeros.apps.mcp.resources import Resources
    from aeros.apps.mcp.server import build_server

    server = build_server(one.tools, Resources(one.tools, one.folder / "audit.jsonl"))

    async def session() -> None:
        with anyio.fail_after(60):
            async with mcp.Client(server, mode=era, **options) as client:
                await conversation(client)

    anyio.run(session)


async def proposed(client: Any) -> str:
    found = await client.call_tool("propose_plan", {"steps": PREPARE, "goal": LAID_OUT})
    plan: str = found.structured_content["plan"]
    return plan


@pytest.mark.parametrize("era", ERAS)
def test_a_client_finds_tools_with_schemas_resources_and_prompts(era: str, tmp_path: Path) -> None:
    async def conversation(client: Any) -> None:
        tools = (await client.list_tools()).tools
        assert [one.name for one in tools if one.annotations.read_only_hint] == [
            "list_skills", "state", "propose_plan",
        ]  # fmt: skip
        assert all(one.output_schema["additionalProperties"] is False for one in tools)
        # The client compares each structured result with its tool's schema.
        for tool in ("list_skills", "state"):
            found = await client.call_tool(tool, {})
            assert json.loads(found.content[0].text) == found.structured_content
        listed = [str(one.uri) for one in (await client.list_resources()).resources]
        assert "aeros://modules/make_dumplings" in listed
        manifest = (await client.read_resource("aeros://modules/make_dumplings")).contents[0]
        assert manifest.text.startswith("schema: aeros/ecm/")
        templates = (await client.list_resource_templates()).resource_templates
        assert {one.uri_template for one in templates} == {
            "aeros://modules/{module}", "aeros://records/{count}",
        }  # fmt: skip
        (prompt, *_) = (await client.list_prompts()).prompts
        text = (await client.get_prompt(prompt.name, {"task": "make dumplings"})).messages[0].content.text
        assert "Carry out this task with the robot: make dumplings" in text

    with cell(dumplings(), tmp_path, FREE) as one:
        talk(one, era, conversation)
        assert one.decisions() == 0


def test_unknown_names_are_errors_that_name_the_known_ones(tmp_path: Path) -> None:
    import mcp

    async def conversation(client: Any) -> None:
        with pytest.raises(mcp.MCPError, match="there are aeros://site"):
            await client.read_resource("aeros://nothing")
        with pytest.raises(mcp.MCPError, match="there are carry_out"):
            await client.get_prompt("nothing", {})
        found = await client.call_tool("statx", {})
        assert (found.is_error, found.content[0].text) == (
            True, "there is no tool `statx`; did you mean `state`?",
        )  # fmt: skip

    with cell(dumplings(), tmp_path, FREE) as one:
        talk(one, "auto", conversation)


@pytest.mark.parametrize("era", ERAS)
def test_a_call_that_waits_reports_progress(era: str, tmp_path: Path) -> None:
    heard: list[tuple[float, float | None, str | None]] = []

    async def on_progress(done: float, total: float | None, text: str | None) -> None:
        heard.append((done, total, text))

    async def conversation(client: Any) -> None:
        found = await client.call_tool(
            "execute_plan", {"plan": await proposed(client), "wait": 30}, progress_callback=on_progress
        )
        assert found.structured_content["status"] == "goal reached"

    with cell(dumplings(), tmp_path, FREE) as one:
        talk(one, era, conversation)
    assert heard[-1][:2] == (1.0, 1)
    assert "make_dumplings.prepare: outcome `laid_out`" in str(heard[-1][2])
    assert [done for done, _, _ in heard] == sorted({done for done, _, _ in heard})


@pytest.mark.parametrize("era", ERAS)
def test_cancelling_the_call_brings_the_robot_to_rest(era: str, tmp_path: Path) -> None:
    import anyio

    async def conversation(client: Any) -> None:
        plan = await proposed(client)
        with anyio.move_on_after(0.5):
            await client.call_tool("execute_plan", {"plan": plan, "wait": 60})
        running = one.robot.running
        assert running is not None
        while not running.ended.is_set():
            await anyio.sleep(0.02)
        found = (await client.call_tool("state", {})).structured_content["running"]
        assert (found["status"], found["reason"][:12]) == ("cancelled", "cancelled by")

    with cell(dumplings(), tmp_path, FREE) as one:
        one.operator.at_first["decision"] = lambda: one.operator.ask(OperatorCommand.PAUSE)
        talk(one, era, conversation)
        ended = [record for record in one.records() if record["event"] == "step-ended"]
        assert [record["details"]["status"] for record in ended] == ["cancelled"]


def answering(action: str, **content: Any) -> dict[str, Any]:
    """Options of a client whose user gives this answer; `asked` collects the questions."""
    import mcp_types as types

    asked: list[str] = []

    async def on_question(_: Any, params: Any) -> Any:
        asked.append(params.message)
        return types.ElicitResult(action=action, content=content or None)  # type: ignore[arg-type]

    return {"elicitation_callback": on_question, "asked": asked}


@pytest.mark.parametrize(
    ("action", "content", "status"),
    [
        ("accept", {"approve": True}, "goal reached"),
        ("decline", {}, "the client's user did not approve it; propose a plan again"),
        *(
            pytest.param(*one, marks=pytest.mark.deep)
            for one in (
                ("accept", {"approve": False}, "the client's user did not approve it; propose a plan again"),
                ("accept", {}, "the client's user did not approve it; propose a plan again"),
                ("cancel", {}, "waits for approval"),
            )
        ),
    ],
)
@pytest.mark.parametrize("era", ["legacy", "auto"])
def test_where_the_site_says_so_the_clients_user_may_approve(
    era: str, action: str, content: dict[str, Any], status: str, tmp_path: Path
) -> None:
    options = answering(action, **content)
    asked = options.pop("asked")

    async def conversation(client: Any) -> None:
        found = await client.call_tool("execute_plan", {"plan": await proposed(client), "wait": 30})
        answer = found.content[0].text if found.is_error else found.structured_content["status"]
        assert answer == status

    with cell(dumplings(), tmp_path, ASKING) as one:
        talk(one, era, conversation, **options)
        started = one.noted("mcp-plan-started")
        assert [note["approved"]["verified"] for note in started] == [False] * (status == "goal reached")
        assert all("as the client says" in note["approved"]["by"] for note in started)
    (question,) = asked
    assert "1. make_dumplings.prepare" in question
    assert LAID_OUT in question


def test_where_the_operator_must_approve_the_clients_user_is_not_asked(tmp_path: Path) -> None:
    options = answering("accept", approve=True)
    asked = options.pop("asked")

    async def conversation(client: Any) -> None:
        found = await client.call_tool("execute_plan", {"plan": await proposed(client), "wait": 30})
        assert found.structured_content["status"] == "waits for approval"
        assert found.structured_content["user_may_approve"] is False
        await client.call_tool("pause", {})
        assert (await client.call_tool("resume", {})).structured_content["status"] == "waits for approval"

    with cell(dumplings(), tmp_path, McpPolicy()) as one:
        talk(one, "legacy", conversation, **options)
        assert (asked, one.decisions()) == ([], 0)


@pytest.mark.parametrize("decision", [pytest.param(approve, marks=pytest.mark.deep), reject])
def test_the_operators_terminal_stands_above_the_clients_user(
    decision: Callable[[Path, str], None], tmp_path: Path
) -> None:
    import mcp_types as types

    async def on_question(_: Any, __: Any) -> Any:
        (request,) = one.call("state")["waiting_for_approval"]
        decision(tmp_path / "state", request)
        return types.ElicitResult(
            action="decline" if decision is approve else "accept", content={"approve": True}
        )

    async def conversation(client: Any) -> None:
        found = await client.call_tool("execute_plan", {"plan": await proposed(client), "wait": 30})
        if decision is approve:
            assert found.structured_content["status"] == "goal reached"
        else:
            assert "the operator did not approve it" in found.content[0].text

    with cell(dumplings(), tmp_path, ASKING) as one:
        talk(one, "legacy", conversation, elicitation_callback=on_question)
        assert [note["approved"]["verified"] for note in one.noted("mcp-plan-started")] == [True] * (
            decision is approve
        )


def test_a_flood_of_calls_is_refused_and_a_stop_is_not(tmp_path: Path) -> None:
    import anyio

    from aeros.apps.mcp.server import MAX_CALLS

    answers: list[Any] = []

    async def conversation(client: Any) -> None:
        plan = await proposed(client)
        one.operator.at_first["decision"] = lambda: one.operator.ask(OperatorCommand.PAUSE)

        async def watch() -> None:
            answers.append(await client.call_tool("execute_plan", {"plan": plan, "wait": 60}))

        async with anyio.create_task_group() as group:
            for _ in range(MAX_CALLS + 5):
                group.start_soon(watch)
            while len(answers) < 5:
                await anyio.sleep(0.02)
            assert "too many calls at once" in answers[0].content[0].text
            assert (await client.call_tool("stop", {})).structured_content == {"status": "stopped"}
        assert [found.is_error for found in answers].count(True) == 5

    with cell(dumplings(), tmp_path, FREE) as one:
        talk(one, "auto", conversation)
