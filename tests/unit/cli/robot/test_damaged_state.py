"""Damaged, empty or foreign files in a robot's state folder: each command refuses in words, or goes on."""

from __future__ import annotations

import json
import random
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest

from aeros.agent.recovery.quarantine import Quarantine
from aeros.cli.main import main
from aeros.spec.migrations.formats import QUARANTINE, RUN
from tests.repo.tree import ROOT

BASE = ROOT / "docs" / "codes" / "base"

NOISE = random.Random(25).randbytes(500)  # noqa: S311 - no secret


def _replaced(content: bytes) -> Callable[[Path], None]:
    def replace(path: Path) -> None:
        path.write_bytes(content)

    return replace


def _cut(path: Path) -> None:
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])


def _folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def _link_to(target: str) -> Callable[[Path], None]:
    def link(path: Path) -> None:
        path.unlink()
        path.symlink_to(target or path.name)

    return link


DAMAGES: dict[str, Callable[[Path], None]] = {
    "empty": _replaced(b""),
    "noise": _replaced(NOISE),
    "another format": _replaced(b'{"schema": "other/9", "a": [1]}\n'),
    "cut": _cut,
    "a folder": _folder,
    "a link to itself": _link_to(""),
    "a link to nowhere": _link_to("/nonexistent/file"),
    "unreadable": lambda path: path.chmod(0),  # to all but root
}

MORE = ("cut", "another format", "a link to nowhere")
"""Damages like others, for `make deep`."""

REGISTRY = (("list",), ("block", "--id", "new", "--reason", "x", "--action", "grip"), ("pause",))
AGENT = (
    ("run", "clean", "--plant", "symbolic", "--timeout", "0.1", "--out", "out"),
    ("memory", "show"),
    ("release",),
)
RESUME = (("run", "--resume"),)

FILES: dict[str, Sequence[Sequence[str]]] = {
    "registry/registry.sqlite3": REGISTRY,
    "registry/audit.jsonl": REGISTRY,
    "registry.anchor": REGISTRY,
    "registry/live": REGISTRY,
    "registry/change.lock": REGISTRY,
    "registry/motion-0.lock": REGISTRY,
    "registry/motion-1.lock": REGISTRY,
    "registry/policies/": REGISTRY,
    "registry/modules/": REGISTRY,
    "audit.key": (AGENT[0], *REGISTRY[1:]),
    "audit.key.pub": (AGENT[0], *REGISTRY[1:]),
    "anchors/": AGENT[:1],
    "agent.lock": AGENT,
    "identity.json": AGENT,
    "memory.sqlite3": AGENT,
    "phase.json": AGENT,
    "checkpoint.json": (*AGENT, *RESUME),
    "crashes.json": AGENT[2:],
    "quarantine.json": AGENT,
    "latest-run.json": (("top", "--once"),),
    "run.json": RESUME,
}
"""By file of the state folder, or folder of such files, the commands that read it."""


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The state of a robot that ran a task, with what a killed and a quarantined run leave."""
    folder = tmp_path_factory.mktemp("state")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        state = ("--state", "robot")
        assert main(["policy", str(BASE / "site.yaml"), *state]) == 0
        assert main(["install", str(BASE / "tidy"), *state]) == 0
        for command in ("configure", "activate"):
            assert main([command, "tidy", *state]) == 0
        main([*AGENT[0], *state])
        Path("robot/run.json").write_text(json.dumps({"schema": RUN.schema}))
        Quarantine(Path("robot")).record_crash("a test", time.time(), 3, 600.0)
        Path("robot/quarantine.json").write_text(json.dumps({"schema": QUARANTINE.schema}))
        yield folder / "robot"


def paths_of(name: str, state: Path) -> list[Path]:
    return (
        [path for path in (state / name).rglob("*") if path.is_file()]
        if name.endswith("/")
        else [state / name]
    )


def test_every_file_of_a_state_is_damaged(whole: Path) -> None:
    found = {path for path in whole.rglob("*") if path.is_file()}
    assert found - {path for name in FILES for path in paths_of(name, whole)} == set()


@pytest.mark.parametrize(
    "damage", [pytest.param(one, marks=[pytest.mark.deep] if one in MORE else []) for one in DAMAGES]
)
@pytest.mark.parametrize("name", FILES)
def test_a_damaged_state_is_refused_in_words_or_done_without(
    name: str,
    damage: str,
    whole: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    for command in FILES[name]:
        shutil.rmtree("robot", ignore_errors=True)
        shutil.rmtree("out", ignore_errors=True)
        shutil.copytree(whole, "robot")
        if name != "quarantine.json":
            Path("robot/quarantine.json").unlink()
        for path in paths_of(name, Path("robot")):
            DAMAGES[damage](path)
        code = main([*command, "--state", "robot"])
        message = capsys.readouterr()
        assert code in (0, 1, 2), (command, message.err)
        assert "Traceback" not in message.err + message.out
        if code:
            assert message.err.strip() or "goal not reached" in message.out, command
