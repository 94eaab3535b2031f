"""Subscriptions of clients to resources: which of them have changed, looked at once a second.

Clients of the protocol's version 2026-07-28 open a stream (`subscriptions/listen`); older ones subscribe to
one resource at a time.  A notification names the resource and has no content: the client reads it again.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from typing import Any, Final

import anyio
import mcp_types as types
from mcp.server.context import ServerRequestContext
from mcp.server.lowlevel import Server
from mcp.server.session import ServerSession
from mcp.server.subscriptions import InMemorySubscriptionBus, ListenHandler, ResourceUpdated
from mcp.shared.exceptions import MCPError

from aeros.apps.mcp.resources import ResourceError, Resources

UPDATE_INTERVAL_S: Final = 1.0
"""Interval at which resources are compared with their last state, s of real time."""

MAX_SUBSCRIPTIONS: Final = 64
"""Subscriptions of older clients, and streams of newer ones, at once."""

_SEND_LIMIT_S: Final = 1.0  # real time for one notification, then the client loses that subscription

_Context = ServerRequestContext[Any, Any]


class ResourceUpdates:
    """Subscriptions of all clients of one server.

    Args:
        resources: The resources.

    Attributes:
        listen: Handler of `subscriptions/listen`.
    """

    def __init__(self, resources: Resources) -> None:
        self._resources = resources
        self._bus = InMemorySubscriptionBus()
        self.listen = ListenHandler(self._bus, max_subscriptions=MAX_SUBSCRIPTIONS)
        self._sessions: dict[tuple[int, str], ServerSession] = {}
        """Of each subscription of an older client, by its connection and resource, a session to notify it."""

    async def subscribe(self, context: _Context, params: types.SubscribeRequestParams) -> types.EmptyResult:
        """Subscribe an older client to a resource, until it unsubscribes or its connection ends.

        Args:
            context: The request's context.
            params: The resource's address.

        Returns:
            The empty result.

        Raises:
            MCPError: There is no such resource, or there are too many subscriptions.
        """
        uri = str(params.uri)
        try:
            kind, rest = self._resources.check_address(uri)
        except ResourceError as error:
            raise MCPError(types.INVALID_PARAMS, str(error)) from error
        if kind == "records" and rest:
            raise MCPError(types.INVALID_PARAMS, "subscribe to `aeros://records`, which every record changes")
        key = _subscription_key(context, uri)
        if key not in self._sessions:
            if len(self._sessions) >= MAX_SUBSCRIPTIONS:
                raise MCPError(types.INTERNAL_ERROR, f"too many subscriptions ({MAX_SUBSCRIPTIONS})")
            # The SDK's session does not offer its connection, which alone knows its own end.
            context.session._connection.exit_stack.callback(self._sessions.pop, key, None)
        self._sessions[key] = context.session
        return types.EmptyResult()

    async def unsubscribe(
        self, context: _Context, params: types.UnsubscribeRequestParams
    ) -> types.EmptyResult:
        """End a subscription of an older client; without one, do nothing.

        Args:
            context: The request's context.
            params: The resource's address.

        Returns:
            The empty result.
        """
        self._sessions.pop(_subscription_key(context, str(params.uri)), None)
        return types.EmptyResult()

    @asynccontextmanager
    async def lifespan(self, _: Server[Any]) -> AsyncIterator[dict[str, Any]]:
        """Notify subscribers as long as the server runs.

        Yields:
            Nothing that handlers need.
        """
        async with anyio.create_task_group() as group:
            group.start_soon(self._watch)
            yield {}
            self.listen.close()
            group.cancel_scope.cancel()

    async def _watch(self) -> None:
        latest = self._resources.states()
        while True:
            await anyio.sleep(UPDATE_INTERVAL_S)
            states = self._resources.states()
            for uri in changed_resources(latest, states):
                await self._notify(uri)
            latest = states

    async def _notify(self, uri: str) -> None:
        await self._bus.publish(ResourceUpdated(uri=uri))
        for key, session in list(self._sessions.items()):
            if key[1] != uri:
                continue
            with anyio.move_on_after(_SEND_LIMIT_S) as scope:
                await session.send_resource_updated(uri)
            if scope.cancelled_caught:  # else a client that does not read delays the others each time
                self._sessions.pop(key, None)


def changed_resources(before: Mapping[str, Any], after: Mapping[str, Any]) -> list[str]:
    """Find the resources that have changed.

    Args:
        before: State of each resource that can change, by its address, at the last look.
        after: Likewise now.

    Returns:
        The addresses.
    """
    return [uri for uri, state in after.items() if before.get(uri) != state]


def _subscription_key(context: _Context, uri: str) -> tuple[int, str]:
    return id(context.session._connection), uri
