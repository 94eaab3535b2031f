"""Subscriptions to resources, by the protocol's own client in both of its eras."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from tests.unit.apps.mcp.cells import FREE, cell, dumplings
from tests.unit.apps.mcp.test_server import proposed, talk

pytestmark = [
    pytest.mark.skipif(find_spec("mcp") is None, reason="the extra `mcp` is not installed"),
    pytest.mark.filterwarnings("ignore:resources/"),
]
CHANGING = ("aeros://world", "aeros://plan", "aeros://records")


@pytest.fixture(autouse=True)
def frequent_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    if find_spec("mcp") is not None:
        monkeypatch.setattr("aeros.apps.mcp.resource_updates.UPDATE_INTERVAL_S", 0.02)


async def carry_out(client: Any) -> None:
    found = await client.call_tool("execute_plan", {"plan": await proposed(client), "wait": 30})
    assert found.structured_content["status"] == "goal reached"


def test_an_older_client_hears_of_changes_until_it_unsubscribes(tmp_path: Path) -> None:
    import anyio
    import mcp

    heard: set[str] = set()

    async def on_message(message: Any) -> None:
        if message.method == "notifications/resources/updated":
            heard.add(str(message.params.uri))

    async def all_heard(wanted: set[str]) -> None:
        with anyio.fail_after(20):
            while heard != wanted:
                await anyio.sleep(0.02)

    async def conversation(client: Any) -> None:
        assert client.server_capabilities.resources.subscribe is True
        for uri in (*CHANGING, "aeros://site"):
            await client.subscribe_resource(uri)
        await carry_out(client)
        await all_heard(set(CHANGING))
        await client.unsubscribe_resource("aeros://records")
        heard.clear()
        await carry_out(client)
        await all_heard({"aeros://world", "aeros://plan"})
        for uri, why in (
            ("aeros://nothing", "there are aeros://site"),
            ("aeros://records/9", "subscribe to"),
        ):
            with pytest.raises(mcp.MCPError, match=why):
                await client.subscribe_resource(uri)

    with cell(dumplings(), tmp_path, FREE) as one:
        talk(one, "legacy", conversation, message_handler=on_message)


@pytest.mark.deep
def test_a_newer_client_hears_of_changes_on_its_stream(tmp_path: Path) -> None:
    async def conversation(client: Any) -> None:
        async with client.listen(resource_subscriptions=CHANGING) as stream:
            heard = set()
            await carry_out(client)
            async for event in stream:
                heard.add(event.uri)
                if heard == set(CHANGING):
                    break

    with cell(dumplings(), tmp_path, FREE) as one:
        talk(one, "auto", conversation)
