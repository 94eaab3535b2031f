"""Foreign programs talk to `aeros mcp`: the official inspector, and the protocol's conformance suite.

They come from the npm registry into a folder of this test's own, with a Node.js of their own.  The suite asks
most scenarios for tools, resources and prompts with fixed names, which a test server has.  Here are those
that need none, and those that judge a tool, resource or prompt of AEROS under the fixed name.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from itertools import count
from pathlib import Path
from typing import Any, Final

import pytest

from tests.repo.tree import ROOT
from tests.unit.apps.mcp.http_clients import HttpClient

pytestmark = [
    pytest.mark.deep,
    pytest.mark.skipif(find_spec("mcp") is None, reason="the extra `mcp` is not installed"),
]

PACKAGES: Final = (
    "node@22.23.3",
    "@modelcontextprotocol/inspector@2.12.0",
    "@modelcontextprotocol/conformance@0.1.16",
)
Renaming = tuple[tuple[bytes, bytes], ...]
SCENARIOS: Final[dict[str, Renaming]] = {
    "server-initialize": (),
    "ping": (),
    "completion-complete": (),
    "tools-list": (),
    "server-sse-multiple-streams": (),
    "resources-list": (),
    "prompts-list": (),
    "dns-rebinding-protection": (),
    "tools-call-simple-text": ((b'"test_simple_text"', b'"state","arguments":{}'),),
    # It needs an argument, and gets none.
    "tools-call-error": ((b"test_error_handling", b"propose_plan"),),
    "resources-read-text": ((b"test://static-text", b"aeros://policy"),),
    "resources-templates-read": ((b"test://template/123/data", b"aeros://records/123"),),
    "resources-subscribe": ((b"test://watched-resource", b"aeros://records"),),
    "resources-unsubscribe": ((b"test://watched-resource", b"aeros://records"),),
    "prompts-get-simple": ((b"test_simple_prompt", b"explain_latest"),),
}
"""For each scenario, its fixtures, each with the tool or resource of AEROS that takes its place."""


@pytest.fixture(scope="module")
def packages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder with the programs."""
    npm = shutil.which("npm")
    if npm is None:
        pytest.skip("npm is not installed")
    folder = tmp_path_factory.mktemp("npm")
    (folder / "package.json").write_text("{}")
    install = [npm, "install", "--no-audit", "--no-fund", *PACKAGES]
    done = subprocess.run(install, cwd=folder, capture_output=True, text=True, timeout=500, check=False)
    if done.returncode and re.search(r"EAI_AGAIN|ENOTFOUND|ECONNREFUSED|ETIMEDOUT", done.stderr):
        pytest.skip("the npm registry cannot be reached")
    assert done.returncode == 0, done.stderr
    return folder / "node_modules"


def run_node(packages: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [str(packages / "node" / "bin" / "node"), *arguments]
    # The inspector keeps a list of servers in the user's folder.
    at_home = {**os.environ, "HOME": str(packages.parent)}
    return subprocess.run(
        command, capture_output=True, text=True, timeout=180, check=False, cwd=ROOT, env=at_home
    )


class HttpServerProcess:
    """`aeros mcp --http` in a process of its own, with all tasks of the shipped modules."""

    def __init__(self, folder: Path) -> None:
        self.token_file = folder / "token"
        self.process = subprocess.Popen(
            [
                sys.executable, "-m", "aeros.cli.main", "mcp", "--plant", "symbolic", "--http", "0",
                "--token-file", str(self.token_file), "--state", str(folder / "state"),
                "--out", str(folder / "out"),
            ],
            cwd=ROOT, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert self.process.stderr is not None
        line = next(line for line in self.process.stderr if "serving MCP" in line)
        found = re.search(r"http://127\.0\.0\.1:(\d+)/mcp", line)
        assert found is not None
        self.url, self.port = found[0], int(found[1])
        self.token = self.token_file.read_text().strip()

    def close(self) -> None:
        self.process.terminate()
        self.process.communicate(timeout=30)


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[HttpServerProcess]:
    server = HttpServerProcess(tmp_path_factory.mktemp("http"))
    yield server
    server.close()


@contextmanager
def presenting_token(server: HttpServerProcess, renaming: Renaming) -> Iterator[int]:
    """Port of a proxy that adds the token to each request; a foreign `Host` or `Origin` stays as it is."""
    renamed: set[bytes] = set()
    listener = socket.create_server(("127.0.0.1", 0))
    port = listener.getsockname()[1]

    def relay(source: socket.socket, sink: socket.socket) -> None:
        with source, sink:
            try:
                while data := source.recv(65_536):
                    sink.sendall(data)
                sink.shutdown(socket.SHUT_WR)
            except OSError:
                pass

    def serve(client: socket.socket) -> None:
        head = b""
        while b"\r\n\r\n" not in head and (data := client.recv(65_536)):
            head += data
        head, _, body = head.partition(b"\r\n\r\n")
        length = re.search(rb"(?i)content-length: *(\d+)", head)
        while length is not None and len(body) < int(length[1]) and (data := client.recv(65_536)):
            body += data
        for fixture, own in renaming:
            if fixture in body:
                renamed.add(fixture)
                body = body.replace(fixture, own)
        head = re.sub(rb"(?i)(content-length: *)\d+", rb"\g<1>%d" % len(body), head)
        first, _, rest = (head + b"\r\n\r\n" + body).partition(b"\r\n")
        rest = re.sub(rb"(?i)connection:[^\r]*\r\n", b"", rest)
        # Only this proxy's own names become the server's: a forged one stays forged.
        rest = re.sub(rb"(localhost|127\.0\.0\.1):%d\b" % port, rb"\1:%d" % server.port, rest)
        added = f"Authorization: Bearer {server.token}\r\nConnection: close\r\n".encode()
        onward = socket.create_connection(("127.0.0.1", server.port))
        onward.sendall(first + b"\r\n" + added + rest)
        threading.Thread(target=relay, args=(onward.dup(), client.dup()), daemon=True).start()
        relay(client, onward)

    def accept() -> None:
        while True:
            try:
                client, _ = listener.accept()
            except OSError:
                return
            threading.Thread(target=serve, args=(client,), daemon=True).start()

    thread = threading.Thread(target=accept, daemon=True)
    thread.start()
    try:
        yield port
    finally:
        listener.shutdown(socket.SHUT_RDWR)
        listener.close()
    assert renamed == {fixture for fixture, _ in renaming}


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_the_conformance_suite_finds_no_fault(
    scenario: str, packages: Path, served: HttpServerProcess
) -> None:
    # A record that has the number that the suite looks for in the newest 123 records.
    asking = HttpClient(served.port, Authorization=f"Bearer {served.token}")
    assert asking.call("tool_123") == "there is no tool `tool_123`"
    suite = packages / "@modelcontextprotocol" / "conformance" / "dist" / "index.js"
    with presenting_token(served, SCENARIOS[scenario]) as port:
        done = run_node(
            packages, str(suite), "server", "--url", f"http://localhost:{port}/mcp", "--scenario", scenario
        )
    assert done.returncode == 0, done.stdout + done.stderr
    passed = re.search(r"Passed: (\d+)/(\d+), 0 failed, 0 warnings", done.stdout)
    assert passed is not None, done.stdout
    assert passed[1] == passed[2] != "0"


class Inspector:
    """The inspector's command line over one transport."""

    def __init__(self, packages: Path, target: Callable[[], list[str]]) -> None:
        self._packages, self._target = packages, target

    def ask(self, method: str, *options: str) -> Any:
        entry = self._packages / "@modelcontextprotocol" / "inspector" / "clients" / "launcher" / "build"
        done = run_node(
            self._packages,
            *(str(entry / "index.js"), "--cli", *self._target()),
            # It waits 15 s by default, which a loaded machine may need to start the server.
            *("--connect-timeout", "120000", "--method", method, *options),
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return json.loads(done.stdout)


@pytest.fixture(params=["stdio", "http"])
def inspector(
    request: pytest.FixtureRequest, packages: Path, tmp_path: Path, served: HttpServerProcess
) -> Inspector:
    if request.param == "http":
        header = f"Authorization: Bearer {served.token}"
        return Inspector(packages, lambda: [served.url, "--transport", "http", "--header", header])

    command = [sys.executable, "-m", "aeros.cli.main", "mcp", "make dumplings", "--plant", "symbolic"]
    command += ["--state", str(tmp_path / "state"), "--ecms", "ecms/make_dumplings"]
    runs = count()
    # Each request starts a server of its own.
    return Inspector(packages, lambda: [*command, "--out", str(tmp_path / f"out-{next(runs)}")])


def test_the_inspector_lists_and_reads_everything(inspector: Inspector, tmp_path: Path) -> None:
    # `--strict` fails on a schema that a client could not read.
    tools = inspector.ask("tools/list", "--strict")["tools"]
    assert {one["name"] for one in tools} >= {"list_skills", "propose_plan", "execute_plan", "stop"}
    assert all(one["outputSchema"]["type"] == "object" for one in tools)
    resources = {one["uri"] for one in inspector.ask("resources/list")["resources"]}
    assert {"aeros://site", "aeros://modules/make_dumplings"} <= resources
    manifest = inspector.ask("resources/read", "--uri", "aeros://modules/make_dumplings")["contents"][0]
    assert manifest["text"].startswith("schema: aeros/ecm/")
    templates = inspector.ask("resources/templates/list")["resourceTemplates"]
    assert "aeros://records/{count}" in {one["uriTemplate"] for one in templates}
    prompts = {one["name"] for one in inspector.ask("prompts/list")["prompts"]}
    assert "carry_out" in prompts
    given = ("--prompt-name", "carry_out", "--prompt-args", "task=make dumplings")
    prompt = inspector.ask("prompts/get", *given)
    assert "make dumplings" in prompt["messages"][0]["content"]["text"]


def test_the_inspector_calls_tools(inspector: Inspector) -> None:
    state = inspector.ask("tools/call", "--tool-name", "state")["structuredContent"]
    assert state["operator"] == "run"
    proposed = inspector.ask(
        "tools/call", "--tool-name", "propose_plan",
        "--tool-arg", 'steps=[{"skill": "make_dumplings.boil"}]',
        "--tool-arg", "task=make dumplings",
    )["structuredContent"]  # fmt: skip
    assert not proposed["accepted"]
    assert "its precondition" in proposed["problems"][0]
