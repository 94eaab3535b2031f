"""A server on this machine that speaks as an OpenAI-compatible API does, or lies, stalls, and breaks off."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

Reply = Callable[[BaseHTTPRequestHandler], None]


@dataclass
class Stub:
    """Stub of a model: its replies, in order (then the last again), and the requests."""

    replies: list[Reply]
    url: str = ""
    asked: list[dict[str, Any]] = field(default_factory=list)
    headers: list[dict[str, str]] = field(default_factory=list)


def send(handler: BaseHTTPRequestHandler, status: int, body: bytes, **headers: str) -> None:
    handler.send_response(status)
    for name, value in {"content-length": str(len(body)), **headers}.items():
        handler.send_header(name.replace("_", "-"), value)
    handler.end_headers()
    handler.wfile.write(body)


def says(content: Any, finish_reason: str = "stop") -> Reply:
    """A chat completion; `content` as JSON unless it is text."""
    text = content if isinstance(content, str) else json.dumps(content)
    choice = {"index": 0, "finish_reason": finish_reason, "message": {"role": "assistant", "content": text}}
    body = json.dumps({"object": "chat.completion", "choices": [choice]}).encode()
    return lambda handler: send(handler, 200, body)


def sends(status: int, body: bytes = b"", **headers: str) -> Reply:
    return lambda handler: send(handler, status, body, **headers)


def stalls(handler: BaseHTTPRequestHandler) -> None:
    time.sleep(30.0)


def trickles(handler: BaseHTTPRequestHandler) -> None:
    handler.send_response(200)
    handler.end_headers()
    for _ in range(300):
        handler.wfile.write(b" ")
        handler.wfile.flush()
        time.sleep(0.1)


def floods(handler: BaseHTTPRequestHandler) -> None:
    handler.send_response(200)
    handler.end_headers()
    for _ in range(1 << 10):
        handler.wfile.write(b" " * (1 << 16))


def breaks_off(handler: BaseHTTPRequestHandler) -> None:
    handler.send_response(200)
    handler.send_header("content-length", "1000")
    handler.end_headers()
    handler.wfile.write(b'{"choices": [')


@contextmanager
def stub(*replies: Reply) -> Iterator[Stub]:
    """The server, listening on the loopback interface as long as the block runs."""
    state = Stub(list(replies))

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            length = int(self.headers["content-length"])
            state.asked.append({"path": self.path, **json.loads(self.rfile.read(length))})
            state.headers.append({name.lower(): value for name, value in self.headers.items()})
            reply = state.replies[0] if len(state.replies) == 1 else state.replies.pop(0)
            try:
                reply(self)
            except OSError:
                self.close_connection = True  # the client went away

        def log_message(self, *_: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = True
    server.block_on_close = False
    state.url = f"http://127.0.0.1:{server.server_port}/v1"
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
    thread.start()
    try:
        yield state
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
