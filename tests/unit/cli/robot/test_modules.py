"""Commands about what is on a robot: what they print, how they end, and that they refuse in words."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any
from uuid import uuid4

import pytest

from aeros.agent.agent import MEMORY_FILE
from aeros.agent.identity import Identity
from aeros.agent.memory.store import open_memory
from aeros.cli.main import main
from aeros.cli.robot import modules as module
from tests.repo.tree import ROOT

BASE = ROOT / "docs" / "codes" / "base"


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A robot with the site of docs/codes in force; commands are run beside its folder."""
    monkeypatch.chdir(tmp_path)
    assert main(["policy", str(BASE / "site.yaml"), "--state", "robot"]) == 0
    return tmp_path / "robot"


def run(*arguments: str) -> int:
    return main([*arguments, "--state", "robot"])


@pytest.mark.usefixtures("robot")
def test_a_module_is_brought_up_listed_and_taken_down(capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    message = []
    for command in ("install", "configure", "activate", "deactivate", "remove"):
        assert run(command, str(BASE / "tidy") if command == "install" else "tidy") == 0
        message.append(capsys.readouterr().out)
    assert message[0].startswith("tidy 1.0.0 is installed; sha256:")
    assert message[1:] == [
        f"tidy 1.0.0 is {state}\n" for state in ("configured", "active", "configured", "absent")
    ]
    assert run("list") == 0
    assert capsys.readouterr().out == (
        "no modules installed\nremoved: tidy: no run uses it until it is installed and activated again\n"
    )


@pytest.mark.usefixtures("robot")
def test_a_module_is_installed_configured_and_activated_in_one_step(
    capsys: pytest.CaptureFixture[str],
) -> None:
    capsys.readouterr()
    for _ in range(2):  # again, it stays active
        assert run("activate", "--install", str(BASE / "tidy")) == 0
        assert capsys.readouterr().out.startswith("tidy 1.0.0 is active; sha256:")
    assert run("list") == 0
    assert capsys.readouterr().out.startswith("tidy 1.0.0  active")


@pytest.mark.usefixtures("robot")
def test_a_module_that_cannot_be_activated_is_not_installed(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("activate", "--install", str(BASE / "tidy"), "--bind", "camera=nowhere") == 1
    refusal = capsys.readouterr().err
    assert "nowhere" in refusal or "camera" in refusal
    assert run("list") == 0
    assert capsys.readouterr().out == "no modules installed\n"


@pytest.mark.usefixtures("robot")
def test_an_older_version_is_activated_at_once_where_that_is_allowed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    older = shutil.copytree(BASE / "tidy", tmp_path / "older")
    manifest = older / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace("version: 1.0.0", "version: 0.9.0"))
    assert run("activate", "--install", str(BASE / "tidy"), "--digest", "sha256:12") == 1
    assert "does not have the pinned digest" in capsys.readouterr().err
    assert run("activate", "--install", str(BASE / "tidy")) == 0
    assert run("activate", "--install", str(older)) == 1
    assert "give --allow-downgrade" in capsys.readouterr().err
    assert run("activate", "--install", str(older), "--allow-downgrade") == 0
    assert "tidy 0.9.0 is active" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "error"),
    [
        ((), "name an installed module, or give `--install SOURCE`"),
        (("tidy", "--install", "tidy"), "name an installed module, or give `--install SOURCE`"),
        *(
            (("tidy", *options), "are for a module that `--install` installs")
            for options in (("--bind", "a=b"), ("--digest", "sha256:1"), ("--allow-downgrade",))
        ),
    ],
)
@pytest.mark.usefixtures("robot")
def test_activation_is_of_one_module_installed_or_to_install(
    words: tuple[str, ...], error: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("activate", *words) == 2
    assert error in capsys.readouterr().err


@pytest.mark.usefixtures("robot")
def test_the_list_finds_by_capability_and_is_there_for_programs(capsys: pytest.CaptureFixture[str]) -> None:
    run("install", str(BASE / "tidy"))
    run("block", "--id", "worn", "--reason", "a finger is worn", "--action", "grip")
    capsys.readouterr()
    assert run("list") == 0
    assert (
        capsys.readouterr().out
        == "tidy 1.0.0  installed   tidying\nblocked: worn: a finger is worn (action grip)\n"
    )
    assert run("list", "--capability", "cooking") == 1
    assert "no installed module provides it" in capsys.readouterr().out
    assert run("list", "--capability", "tidying", "--format", "json") == 0
    listed: Any = json.loads(capsys.readouterr().out)
    (module,) = listed["modules"]
    assert (module["name"], module["state"], module["capabilities"]) == ("tidy", "installed", ["tidying"])
    assert [block["id"] for block in listed["blocks"]] == ["worn"]


@pytest.mark.parametrize(
    "command",
    [("run", "--plant", "symbolic"), ("mcp", "--plant", "symbolic", "--http", "127.0.0.1:0"), ("plan",)],
    ids=lambda command: command[0],
)
@pytest.mark.usefixtures("robot")
def test_a_module_that_is_not_active_is_named_to_who_asks_for_its_task(
    command: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    if command[0] == "mcp":
        pytest.importorskip("mcp", reason="the extra `mcp` is not installed")
    run("install", str(BASE / "tidy"))
    assert run(*command, "clean it") == 1
    message = "no active module provides `clean it`; installed is `tidy.clean_up` (`aeros activate tidy`)"
    assert message in capsys.readouterr().err


@pytest.mark.usefixtures("robot")
def test_plans_are_made_with_what_is_active_on_the_robot(capsys: pytest.CaptureFixture[str]) -> None:
    for command in ("install", "configure", "activate"):
        run(command, str(BASE / "tidy") if command == "install" else "tidy")
    capsys.readouterr()
    assert run("plan", "clean it") == 0
    assert "tidy.wipe" in capsys.readouterr().out


def test_a_broken_assumption_is_listed_with_the_module_of_that_version(
    robot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run("install", str(BASE / "tidy"))
    capsys.readouterr()
    with open_memory(robot / MEMORY_FILE, Identity(uuid4(), "chef", "", 1)) as memory:
        for version, time in (("0.9.0", 1.0), ("1.0.0", 2.0), ("1.0.0", 3.0)):
            details = {
                "module": "tidy",
                "skill": "tidy.wipe",
                "version": version,
                "declared": ["wiped", "missed"],
            }
            proof = {"certificate": "ab" * 32, "obligations": ["closed-loop/clean/progress"], "halted": False}
            memory.add_event(time, "broken-assumption", details | proof)
    assert run("list") == 0
    assert capsys.readouterr().out.splitlines()[1:] == [
        "broken assumption: tidy.wipe ended in none of `wiped`, `missed`, 2 times, "
        "last in session 1 at 3.00 s; affects 1 obligations of certificate abababababab"
    ]
    assert run("list", "--format", "json") == 0
    (module,) = json.loads(capsys.readouterr().out)["modules"]
    assert [one["time"] for one in module["broken_assumptions"]] == [2.0, 3.0]


def test_a_memory_that_cannot_be_read_keeps_nothing_from_being_listed(
    robot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run("install", str(BASE / "tidy"))
    (robot / MEMORY_FILE).write_text("no database at all, and longer than its header")
    capsys.readouterr()
    assert run("list") == 0
    message = capsys.readouterr()
    assert message.out.startswith("tidy 1.0.0")
    assert "broken assumptions are unknown" in message.err


@pytest.mark.usefixtures("robot")
def test_a_digest_pins_what_is_installed(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("install", str(BASE / "tidy"), "--digest", "sha256:" + "0" * 64) == 1
    refusal = capsys.readouterr().err
    digest = refusal[refusal.index("sha256:") :].split()[0]
    assert run("install", str(BASE / "tidy"), "--digest", digest) == 0


@pytest.mark.usefixtures("robot")
def test_a_bundle_is_pinned_carried_and_installed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bundle", str(BASE / "tidy")]) == 0
    message = capsys.readouterr().out
    name, digest = message.split(":")[0], message[message.index("sha256:") :].strip()
    assert run("install", name, "--digest", "sha256:" + "0" * 64) == 1
    assert run("install", name, "--digest", digest) == 0
    assert digest in capsys.readouterr().out
    assert main(["bundle", str(BASE / "tidy"), "--out", "again.zip"]) == 0
    assert Path("again.zip").read_bytes() == Path(name).read_bytes()
    assert main(["bundle", str(BASE)]) == 1
    assert "holds no module" in capsys.readouterr().err


@pytest.mark.usefixtures("robot")
def test_a_bundle_that_cannot_be_written_is_reported(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(path: Path, content: bytes, *, is_private: bool) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(module, "replace_durably", full)
    assert main(["bundle", str(BASE / "tidy"), "--out", "again.zip"]) == 1
    assert "`again.zip` cannot be written: No space left on device" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("install", "nowhere"), "is not a folder, a file or an entry point"),
        (("activate", "tidy"), "there is no module `tidy` here"),
        (("unblock", "worn"), "there is no block `worn` here"),
        (("block", "--id", "x", "--reason", "y", "--action", "gripp"), "did you mean `grip`?"),
    ],
)
@pytest.mark.usefixtures("robot")
def test_refusals_say_why(
    arguments: tuple[str, ...], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(*arguments) == 1
    assert message in capsys.readouterr().err
