"""`aeros mcp` answers the protocol's own client over standard input and output, and ends when that goes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Awaitable, Callable
from importlib.util import find_spec
from math import inf
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from aeros.agent.identity import lock_folder
from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.runtime.audit.log import verify_log
from tests.repo.tree import ROOT

pytestmark = pytest.mark.skipif(find_spec("mcp") is None, reason="the extra `mcp` is not installed")
"""The tests import it themselves: it takes a second, which each process that collects them would pay."""


def arguments(folder: Path, plant: str = "symbolic") -> list[str]:
    return [
        "-m", "aeros.cli.main", "mcp", "make dumplings", "--ecms", "ecms/make_dumplings",
        "--plant", plant, "--state", str(folder / "state"), "--out", str(folder / "out"),
    ]  # fmt: skip


def as_client(
    folder: Path, talk: Callable[[Any], Awaitable[None]], plant: str = "symbolic"
) -> list[dict[str, Any]]:
    """Return the audit records after a client has talked to a server."""
    import anyio
    import mcp

    async def session() -> None:
        server = mcp.StdioServerParameters(command=sys.executable, args=arguments(folder, plant), cwd=ROOT)
        with (folder / "stderr").open("w") as errors:
            transport = mcp.stdio_client(server, errlog=errors)
            async with transport as (reading, writing), mcp.ClientSession(reading, writing) as client:
                await client.initialize()
                await talk(client)

    anyio.run(session)
    wait_for_release(folder / "state")
    log = folder / "out" / "audit.jsonl"
    assert verify_log(log).is_sound
    return [json.loads(line) for line in log.read_text().splitlines()]


def wait_for_release(state: Path) -> None:
    """The server ends a moment after its client is gone."""
    latest = time.monotonic() + 60
    while (state / "agent.lock").read_text() and time.monotonic() < latest:
        time.sleep(0.05)


def test_a_client_sees_proposes_and_has_executed_what_the_operator_approves(tmp_path: Path) -> None:
    seen: dict[str, Any] = {}

    async def talk(client: Any) -> None:
        seen["tools"] = [tool.name for tool in (await client.list_tools()).tools]
        steps = [{"skill": "make_dumplings.prepare"}]
        goal = "dough_on_workspace and filling_on_workspace"
        proposed = (await client.call_tool("propose_plan", {"steps": steps, "goal": goal})).structured_content
        name = {"plan": proposed["plan"], "wait": 30}
        waiting = (await client.call_tool("execute_plan", name)).structured_content
        seen["waiting"] = waiting["status"]
        id_ = waiting["operator"].split()[-1]
        assert main(["approve", id_, "--state", str(tmp_path / "state")]) == Exit.SUCCESS
        seen["executed"] = (await client.call_tool("execute_plan", name)).structured_content["status"]
        refused = await client.call_tool(
            "propose_plan", {"steps": [{"skill": "a.b", "inputs": {"x": "y" * 2000}}]}
        )
        seen["refused"] = (refused.is_error, refused.content[0].text)

    records = as_client(tmp_path, talk)
    assert seen == {
        "tools": ["list_skills", "state", "propose_plan", "execute_plan", "pause", "stop", "resume"],
        "waiting": "waits for approval",
        "executed": "goal reached",
        "refused": (True, "a text is longer than 1000 characters"),
    }
    notes = [one["details"] for one in records if one["event"] == "note"]
    (noted,) = (note["details"] for note in notes if note["event"] == "mcp-plan-started")
    assert noted["client"].startswith("mcp ")
    assert "uid" in noted["approved"]["by"]


def test_another_terminal_pauses_and_stops_what_a_client_began(tmp_path: Path) -> None:
    seen: list[Any] = []

    async def talk(client: Any) -> None:
        state = str(tmp_path / "state")
        assert main(["pause", "--state", state]) == Exit.SUCCESS
        seen.append((await client.call_tool("state", {})).structured_content["operator"])
        assert main(["stop", "--state", state]) == Exit.SUCCESS
        seen.append((await client.call_tool("state", {})).structured_content["operator"])
        seen.append((await client.call_tool("resume", {})).structured_content["status"])

    records = as_client(tmp_path, talk)
    assert seen == ["pause", "stop", "waits for approval"]
    assert not [one for one in records if one["event"] == "decision"]


@pytest.mark.parametrize("number", [signal.SIGTERM, pytest.param(signal.SIGINT, marks=pytest.mark.deep)])
def test_a_signal_ends_a_server_whose_client_says_nothing(number: int, tmp_path: Path) -> None:
    error_file = tmp_path / "stderr"
    with (
        error_file.open("w") as errors,
        subprocess.Popen(
            [sys.executable, *arguments(tmp_path)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors, cwd=ROOT,
        ) as server,
    ):  # fmt: skip
        latest = time.monotonic() + 60
        while "serving MCP" not in error_file.read_text():
            assert time.monotonic() < latest, error_file.read_text()
            time.sleep(0.05)
        server.send_signal(number)
        assert server.wait(60) == Exit.INTERRUPTED
    assert verify_log(tmp_path / "out" / "audit.jsonl").is_sound


def test_a_robot_that_has_an_agent_gets_no_second_one(tmp_path: Path) -> None:
    with lock_folder(tmp_path / "state"):
        ended = subprocess.run(
            [sys.executable, *arguments(tmp_path)],
            input="", capture_output=True, text=True, cwd=ROOT, timeout=60, check=False,
        )  # fmt: skip
    assert ended.returncode == Exit.REJECTED
    assert "this robot has an agent already: pid" in ended.stderr


NO_MESSAGES = (b"\xff\xfe\n" * 100, b'{"jsonrpc": "2.0"}\n[[[[\n{}\n', b"x" * 2_000_000)
"""Bytes, lines of JSON and, as it ends the session, a line that is too long."""

HIDDEN = json.dumps({"jsonrpc": "2.0", "id": "\u202e\x9b\x7f", "method": "none"}, ensure_ascii=False).encode()
"""A request whose answer repeats characters that act on a terminal."""


@pytest.mark.parametrize(
    "sent",
    [
        pytest.param(b"".join(NO_MESSAGES), id="one after the other"),
        *(pytest.param(one, id=f"alone {at}", marks=pytest.mark.deep) for at, one in enumerate(NO_MESSAGES)),
    ],
)
def test_bytes_that_are_no_message_neither_break_nor_fill_the_server(sent: bytes, tmp_path: Path) -> None:
    ended = subprocess.run(
        [sys.executable, *arguments(tmp_path)],
        input=HIDDEN + b"\n" + sent,
        capture_output=True,
        cwd=ROOT,
        timeout=60,
        check=False,
    )
    assert ended.returncode == Exit.SUCCESS, ended.stderr
    assert rb'"id":"\u202e\u009b\u007f"' in ended.stdout
    assert all(character in b"\n" or 0x20 <= character < 0x7F for character in ended.stdout)
    assert verify_log(tmp_path / "out" / "audit.jsonl").is_sound


async def lines_of(sent: bytes) -> tuple[list[str], list[str]]:
    """The lines that the server reads of a client that sends this and stays, and its warnings."""
    import anyio

    from aeros.apps.mcp.transports.stdio import _StdinLines

    warned: list[str] = []
    reading, writing = os.pipe()
    keep = os.dup(0)
    os.dup2(reading, 0)
    os.close(reading)
    try:
        lines = _StdinLines(warned.append)
    finally:
        os.dup2(keep, 0)
        os.close(keep)
    sender = Thread(target=os.write, args=(writing, sent), daemon=True)
    sender.start()
    found = []
    with anyio.fail_after(20):
        async for line in lines:
            found.append(line)
            if line == "last":
                break
    os.close(lines._file)
    sender.join(20)
    os.close(writing)
    return found, warned


@pytest.mark.parametrize(
    ("sent", "read", "warned"),
    [
        (b"one\nlast\n", ["one", "last"], ["is no message of the protocol"]),
        (b" {}\n{}last\nlast\n", [" {}", "{}last", "last"], ["is no message of the protocol"]),
        (b"{" * 300_000 + b"\nlast\n", ["{" * 300_000, "last"], ["is no message of the protocol"]),
        (b"{}\n" + b"x" * 1_100_000, ["{}"], ["more than 1000000 bytes; the session ends"]),
    ],
    ids=["short lines", "objects", "a long line", "a line without an end"],
)
def test_a_line_without_an_end_ends_the_session(sent: bytes, read: list[str], warned: list[str]) -> None:
    import anyio

    found, warnings = anyio.run(lines_of, sent)
    assert found == read
    assert [text in given for text, given in zip(warned, warnings, strict=True)] == [True] * len(warned)


async def link_speed(client: Any, unknown: float) -> float:
    """Speed of the arm's fastest link, m/s; `unknown` while it is not measured."""
    state = (await client.call_tool("state", {})).structured_content["state"]
    speed: float | None = state["link_speed"]["value"]
    return unknown if speed is None else speed


@pytest.mark.deep
@pytest.mark.physics
@pytest.mark.parametrize("way", ["cancels", "disconnects"])
def test_a_client_that_goes_in_the_middle_of_a_motion_leaves_an_arm_at_rest(way: str, tmp_path: Path) -> None:
    import anyio

    async def talk(client: Any) -> None:
        goal = "dough_on_workspace and filling_on_workspace"
        proposal = {"steps": [{"skill": "make_dumplings.prepare"}], "goal": goal}
        plan = {"plan": (await client.call_tool("propose_plan", proposal)).structured_content["plan"]}
        id_ = (await client.call_tool("execute_plan", plan)).structured_content["operator"].split()[-1]
        assert main(["approve", id_, "--state", str(tmp_path / "state")]) == Exit.SUCCESS
        async with anyio.create_task_group() as group:

            async def execute() -> None:
                await client.call_tool("execute_plan", {**plan, "wait": 60})

            group.start_soon(execute)
            with anyio.fail_after(30):
                while await link_speed(client, 0.0) < 0.1:
                    await anyio.sleep(0.05)
            group.cancel_scope.cancel()
        if way == "cancels":
            with anyio.fail_after(20):
                while await link_speed(client, inf) >= 0.02:
                    await anyio.sleep(0.05)

    records = as_client(tmp_path, talk, plant="mujoco")
    (ended,) = (one["details"] for one in records if one["event"] == "step-ended")
    cancelled = ("cancelled", "cancelled by mcp 0.1.0")
    # A client that leaves may still say that it cancels, or be gone before.
    assert (ended["status"], ended["reason"]) in (
        {cancelled} if way == "cancels" else {cancelled, ("halted", "stopped by the operator")}
    )
    assert not [one for one in records if one["event"] in ("step-broken", "plant-broken")]
