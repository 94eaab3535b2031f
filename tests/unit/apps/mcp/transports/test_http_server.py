"""The MCP server over HTTP: Host, Origin, token, two clients at once, and clients that go away."""

from __future__ import annotations

import json
import multiprocessing
import socket
import time
from collections.abc import Awaitable, Callable
from contextlib import closing
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.execution.governor import OperatorCommand
from aeros.spec.model.policy import Execute, McpPolicy
from tests.unit.apps.mcp.cells import FREE, LAID_OUT, PREPARE, cell, dumplings
from tests.unit.apps.mcp.http_clients import TOKEN, HttpClient, served

pytestmark = pytest.mark.skipif(find_spec("mcp") is None, reason="the extra `mcp` is not installed")

REFUSED = {
    "another name of this host, as after DNS rebinding": ({"Host": "evil.example"}, 421),
    "this host with another port": ({"Host": "127.0.0.1:1"}, 421),
    "a page of another origin": ({"Origin": "http://evil.example"}, 403),
    "a sandboxed page": ({"Origin": "null"}, 403),
    "no token": ({"Authorization": ""}, 401),
    "another token": ({"Authorization": "Bearer " + "b" * 40}, 401),
    "the token in another scheme": ({"Authorization": f"Basic {TOKEN}"}, 401),
}


def test_requests_without_host_origin_and_token_are_refused(tmp_path: Path) -> None:
    with cell(dumplings(), tmp_path, FREE) as one, served(one) as port:
        found = {
            name: HttpClient(port, **headers).answer("tools/list", {})[0]
            for name, (headers, _) in REFUSED.items()
        }
        assert found == {name: status for name, (_, status) in REFUSED.items()}
        local = HttpClient(port, Origin=f"http://localhost:{port}", Host=f"localhost:{port}")
        assert local.answer("tools/list", {})[0] == 200
        huge = HttpClient(port).answer("tools/call", {"name": "state", "arguments": {"x": "y" * 1_100_000}})
        assert huge[0] == 413
        deep = {"steps": [json.loads('{"a":' * 50 + "1" + "}" * 50)]}
        assert "nested more than 8 deep" in HttpClient(port).call("propose_plan", **deep)
        assert one.decisions() == 0


def test_two_clients_share_the_robot_and_any_can_stop_it(tmp_path: Path) -> None:
    with cell(dumplings(), tmp_path, FREE) as one, served(one) as port:
        one.operator.at_first["decision"] = lambda: one.operator.ask(OperatorCommand.PAUSE)
        first, second = HttpClient(port), HttpClient(port)
        plan, other = first.proposed(), second.proposed()
        watching = first.watch(plan)
        while not one.robot.is_busy:
            time.sleep(0.01)
        assert second.call("execute_plan", plan=other) == f"the robot is busy with plan {plan}"
        assert second.call("stop") == {"status": "stopped"}
        with closing(watching):
            found = watching.getresponse().read().decode()
        assert "stopped by the operator" in found
        assert second.call("execute_plan", plan=other) == "unknown plan; call propose_plan first"
        assert [note["client"] for note in one.noted("mcp-stopped")] == ["by hand 1"]


@pytest.mark.parametrize("way", ["the connection breaks", "nobody waits"])
def test_a_plan_ends_when_its_client_is_gone(way: str, tmp_path: Path) -> None:
    with cell(dumplings(), tmp_path, FREE) as one, served(one) as port:
        one.operator.at_first["decision"] = lambda: one.operator.ask(OperatorCommand.PAUSE)
        client = HttpClient(port)
        plan = client.proposed()
        began = time.monotonic()
        if way == "nobody waits":
            client.call("execute_plan", plan=plan)
        else:
            watching = client.watch(plan)
            while not one.robot.is_busy:
                time.sleep(0.01)
            assert watching.sock is not None
            watching.sock.shutdown(socket.SHUT_RDWR)
            watching.close()
        running = one.robot.running
        assert running is not None
        assert running.ended.wait(20)
        assert time.monotonic() - began < 10
        reason = client.call("state")["running"]["reason"]
        expected = {
            "nobody waits": "no client has waited for the plan for 1 s",
            "the connection breaks": "cancelled by by hand 1",
        }
        assert reason == expected[way]


def talk_over_http(
    port: int, era: str, conversation: Callable[[Any], Awaitable[None]], **options: Any
) -> None:
    """Let a client of the protocol's SDK talk to the server."""
    import anyio
    import httpx2
    import mcp
    from mcp.client.streamable_http import streamable_http_client

    async def session() -> None:
        headers = {"Authorization": f"Bearer {TOKEN}"}
        with anyio.fail_after(60):
            async with httpx2.AsyncClient(headers=headers, timeout=60) as carrier:
                url = f"http://127.0.0.1:{port}/mcp"
                transport = streamable_http_client(url, http_client=carrier)
                async with mcp.Client(transport, mode=era, **options) as client:
                    await conversation(client)

    anyio.run(session)


@pytest.mark.deep
@pytest.mark.parametrize("era", ["legacy", "auto"])
def test_the_protocols_client_gets_progress_and_is_asked_over_http(era: str, tmp_path: Path) -> None:
    import mcp_types as types

    asked: list[str] = []
    heard: list[float] = []

    async def on_question(_: Any, params: Any) -> Any:
        asked.append(params.message)
        return types.ElicitResult(action="accept", content={"approve": True})

    async def on_progress(done: float, _: float | None, __: str | None) -> None:
        heard.append(done)

    async def conversation(client: Any) -> None:
        proposed = await client.call_tool("propose_plan", {"steps": PREPARE, "goal": LAID_OUT})
        plan = {"plan": proposed.structured_content["plan"], "wait": 30}
        found = await client.call_tool("execute_plan", plan, progress_callback=on_progress)
        assert found.structured_content["status"] == "goal reached"
        assert (await client.read_resource("aeros://plan")).contents[0].text != "null"

    with cell(dumplings(), tmp_path, McpPolicy(Execute.ELICITATION)) as one, served(one) as port:
        talk_over_http(port, era, conversation, elicitation_callback=on_question)
        (started,) = one.noted("mcp-plan-started")
        assert started["approved"]["verified"] is False
    assert (len(asked), heard[-1]) == (1, 1.0)


@pytest.mark.deep
@pytest.mark.parametrize("era", ["legacy", "auto"])
def test_the_protocols_client_cancels_over_http(era: str, tmp_path: Path) -> None:
    import anyio

    async def conversation(client: Any) -> None:
        proposed = await client.call_tool("propose_plan", {"steps": PREPARE, "goal": LAID_OUT})
        with anyio.move_on_after(0.5):
            await client.call_tool("execute_plan", {"plan": proposed.structured_content["plan"], "wait": 60})
        running = one.robot.running
        assert running is not None
        with anyio.fail_after(5):
            while not running.ended.is_set():
                await anyio.sleep(0.02)

    with cell(dumplings(), tmp_path, FREE) as one, served(one) as port:
        one.operator.at_first["decision"] = lambda: one.operator.ask(OperatorCommand.PAUSE)
        talk_over_http(port, era, conversation)
        assert one.call("state")["running"]["status"] == "cancelled"


@pytest.mark.deep
@pytest.mark.parametrize("era", ["legacy", "auto"])
def test_a_killed_client_leaves_no_plan_running(era: str, tmp_path: Path) -> None:
    with cell(dumplings(), tmp_path, FREE) as one, served(one) as port:
        one.operator.at_first["decision"] = lambda: one.operator.ask(OperatorCommand.PAUSE)
        child = multiprocessing.get_context("spawn").Process(target=watch_a_plan, args=(port, era))
        child.start()
        while not one.robot.is_busy:
            assert child.is_alive()
            time.sleep(0.05)
        time.sleep(0.5)
        child.kill()
        child.join()
        running = one.robot.running
        assert running is not None
        assert running.ended.wait(5)
        assert running.cancel_reason is not None


def watch_a_plan(port: int, era: str) -> None:
    """A client in a process of its own."""

    async def conversation(client: Any) -> None:
        proposed = await client.call_tool("propose_plan", {"steps": PREPARE, "goal": LAID_OUT})
        await client.call_tool("execute_plan", {"plan": proposed.structured_content["plan"], "wait": 60})

    talk_over_http(port, era, conversation)


def test_an_open_stream_ends_with_the_server_without_a_traceback(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    with cell(dumplings(), tmp_path, FREE) as one, served(one) as port:
        wanted = {"notifications": {"resourceSubscriptions": ["aeros://records"]}}
        connection = HttpClient(port).request("subscriptions/listen", wanted)
        stream = connection.getresponse()
        while b"acknowledged" not in stream.readline():
            pass
    with closing(connection):
        stream.read()  # `IncompleteRead` if the connection only broke
    captured = capfd.readouterr()
    assert (captured.out, captured.err) == ("", "")
