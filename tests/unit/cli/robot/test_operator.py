"""The operator's commands: policy, blocks, pause, resume, stop and release."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from aeros.agent.recovery.quarantine import Quarantine
from aeros.cli.main import main
from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.registry.bundle_store import bundle_digest, module_files
from aeros.runtime.registry.control_page import ControlPage, MotionTimeoutError
from aeros.runtime.registry.registry import Registry
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
def test_a_block_of_nothing_is_a_mistake(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("block", "--id", "x", "--reason", "y") == 2
    assert "give --module" in capsys.readouterr().err


@pytest.mark.usefixtures("robot")
def test_the_policy_in_force_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert run("policy") == 0
    assert capsys.readouterr().out.startswith("bench is in force; sha256:")


def test_nobody_is_paused_where_nobody_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["pause", "--state", str(tmp_path / "none")]) == 1
    assert "no robot runs from" in capsys.readouterr().err
    assert not (tmp_path / "none").exists()


@pytest.mark.usefixtures("robot")
def test_a_policy_with_settings_of_a_module_that_is_not_installed_is_a_warning(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    other = tmp_path / "other.yaml"
    other.write_text((BASE / "site.yaml").read_text() + "modules:\n  polish: {set: {force: 6 N}}\n")
    capsys.readouterr()
    assert run("policy", str(other)) == 0
    assert capsys.readouterr().err == ""  # nothing is installed yet
    assert run("install", str(BASE / "tidy")) == 0
    capsys.readouterr()
    assert run("policy", str(other)) == 0
    shown = capsys.readouterr()
    assert shown.out.startswith("bench is in force; sha256:")
    assert "warning[AE886] absent-module: the site has settings for `polish`" in shown.err
    assert f"{other}:" in shown.err
    assert run("policy", str(BASE / "site.yaml")) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.usefixtures("robot")
@pytest.mark.parametrize("command", ["pause", "resume", "stop"])
def test_each_command_prints_a_confirmation(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert run(command) == 0
    assert capsys.readouterr().out


@pytest.mark.usefixtures("robot")
def test_a_block_is_in_force_until_it_is_removed(capsys: pytest.CaptureFixture[str]) -> None:
    block = ("block", "--id", "worn", "--reason", "a finger is worn", "--module", "tidy", "--skill", "wipe")
    capsys.readouterr()
    assert run(*block) == 0
    assert capsys.readouterr().out == (
        "worn is in force\n"
        "no module `tidy` is installed now; the block holds for runs that load it from a folder, "
        "and after an install\n"
    )
    (override,) = Registry(Path("robot")).configuration()[0].site.blocks
    assert (override.id, override.reason) == ("worn", "a finger is worn")
    assert (override.module, override.skill, override.action) == ("tidy", "wipe", None)
    assert run("unblock", "worn") == 0
    assert capsys.readouterr().out == "block worn removed\n"
    assert Registry(Path("robot")).configuration()[0].site.blocks == ()


@pytest.mark.usefixtures("robot")
def test_another_policy_is_in_force_once_it_is_set(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    other = tmp_path / "other.yaml"
    other.write_text((BASE / "site.yaml").read_text().replace("id: bench\n", "id: table\n"))
    capsys.readouterr()
    assert run("policy", str(other)) == 0
    assert capsys.readouterr().out.startswith("table is in force; sha256:")


@pytest.mark.parametrize(
    ("command", "message", "asked"),
    [
        ("pause", "paused: no action starts until `aeros resume`\n", OperatorCommand.PAUSE),
        ("resume", "resumed\n", OperatorCommand.RUN),
        ("stop", "stopped\n", OperatorCommand.STOP),
    ],
)
def test_a_command_reaches_the_page_that_robots_read(
    robot: Path, command: str, message: str, asked: OperatorCommand, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    assert run(command) == 0
    assert capsys.readouterr().out == message
    with ControlPage(Registry(robot).folder) as page:
        assert page.command is asked


@pytest.mark.usefixtures("robot")
def test_motion_that_does_not_end_sends_to_the_emergency_stop(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def still_moving(*_: object) -> None:
        raise MotionTimeoutError("after 10 s")

    monkeypatch.setattr("aeros.cli.robot.operator.request_command", still_moving)
    capsys.readouterr()
    assert run("stop") == 1
    message = capsys.readouterr()
    assert (message.out, message.err) == (
        "",
        "aeros: still moving after 10 s; use the robot's emergency stop\n",
    )


def test_a_quarantine_is_lifted_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Quarantine(tmp_path).record_crash("killed", 1000.0, most=1, within=60.0)
    for message in ("quarantine lifted; the agent can start again\n", "the agent is not quarantined\n"):
        assert main(["release", "--state", str(tmp_path)]) == 0
        assert capsys.readouterr().out == message
    assert Quarantine(tmp_path).reason() is None


DIGEST = bundle_digest(module_files(BASE / "tidy"))


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        (("--version", "<1.2"), "--version needs --module"),
        (("--module", "tidy", "--version", "new"), "`new` is neither a version"),
        (("--module", "tidy", "--version", "1.0 "), "begins or ends with a space"),
        (
            ("--module", "tidy", "--version", f"<{'9' * 5000}"),
            "has 5,001 characters; at most 256 are allowed",
        ),
        (("--skill", "wipe"), "--skill needs --module"),
        *(
            ((option, name), "a name is a lower-case letter, then letters, digits and `_`")
            for option in ("--module", "--skill", "--action")
            for name in ("tidy ", "Tidy", "", "tidy\n", "\u202etidy")
        ),
        (("--module", "t" * 129), "has 129 characters; at most 128 are allowed"),
        *((("--module", "tidy", "--id", id_), "is no id") for id_ in ("", "a\nb", "a b", "-")),
        (("--module", "tidy", "--reason", " "), "write a reason"),
        (("--module", "tidy", "--reason", "a\nb"), "is not allowed in a reason"),
        (("--module", "tidy", "--reason", "r" * 1001), "at most 1,000 are allowed"),
        (("--digest", "abc"), "`abc` is no digest"),
    ],
)
@pytest.mark.usefixtures("robot")
def test_a_block_of_no_version_or_digest_is_a_mistake(
    parts: tuple[str, ...], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    try:
        code = run("block", "--id", "x", "--reason", "y", *parts)
    except SystemExit as ended:
        code = int(ended.code or 0)
    assert code == 2
    assert message in capsys.readouterr().err


@pytest.mark.usefixtures("robot")
def test_a_block_of_versions_or_contents_is_shown_wherever_the_module_is(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run("block", "--id", "old", "--reason", "drops cups", "--module", "tidy", "--version", "<1.2") == 0
    assert run("block", "--id", "bad", "--reason", "odd", "--digest", f"sha256:{DIGEST}") == 0
    assert run("block", "--id", "other", "--reason", "odd", "--digest", "0" * 64) == 0
    lines = [
        f"blocked: bad: odd (digest sha256:{DIGEST})\n",
        "blocked: old: drops cups (module tidy, version <1.2)\n",
    ]
    for command in (("install", str(BASE / "tidy")), ("configure", "tidy"), ("activate", "tidy"), ("list",)):
        capsys.readouterr()
        assert run(*command) == 0
        message = capsys.readouterr().out
        assert all(line in message for line in lines)
        assert ("blocked: other" in message) == (command == ("list",))
    assert run("list", "--format", "json") == 0
    found = json.loads(capsys.readouterr().out)
    assert [(one["id"], one["version"], one["digest"]) for one in found["blocks"]] == [
        ("bad", None, f"sha256:{DIGEST}"),
        ("old", "<1.2", None),
        ("other", None, f"sha256:{'0' * 64}"),
    ]
    assert found["withdrawn"] == []
    blocks = Registry(Path("robot")).configuration()[0].site.blocks
    assert [(one.id, one.module) for one in blocks] == [("bad", "tidy"), ("old", "tidy")]


def test_a_registry_is_repaired_from_its_record(robot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("repair") == 0
    assert "nothing to repair" in capsys.readouterr().out
    assert run("block", "--id", "worn", "--reason", "why", "--action", "grip") == 0
    (robot / "registry" / "registry.sqlite3").unlink()
    assert run("list") == 1
    assert "`aeros repair`" in capsys.readouterr().err
    assert run("repair") == 0
    assert capsys.readouterr().out == "the last recorded change is in force again, as change 3\n"
    run("list")
    assert "blocked: worn: why (action grip)" in capsys.readouterr().out


def test_a_kind_that_no_policy_knows_is_refused_with_the_way_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    state = str(tmp_path / "robot")
    assert main(["block", "--id", "a", "--reason", "b", "--action", "fly", "--state", state]) == 1
    assert "for runs with --site: `aeros policy SITE` first" in capsys.readouterr().err
    assert not (tmp_path / "robot").exists()


@pytest.mark.parametrize(
    ("option", "value"),
    [
        *(("--id", value) for value in ("", "a b", "a\nb", "\u202ea")),
        *((name, value) for name in ("--module", "--skill") for value in ("", "Tidy", "tidy ")),
        *(("--reason", value) for value in ("", "  ")),
    ],
)
def test_a_block_that_can_reach_nothing_or_cannot_be_recorded_is_refused(
    option: str, value: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = {"--id": "one", "--reason": "why", "--module": "tidy", option: value}
    words = [word for pair in given.items() for word in pair]
    with pytest.raises(SystemExit) as refused:
        main(["block", *words, "--state", str(tmp_path / "robot")])
    assert refused.value.code == 2
    assert f"argument {option}: " in capsys.readouterr().err


def test_a_policy_that_is_no_file_is_refused_and_not_waited_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    os.mkfifo(tmp_path / "pipe")
    assert main(["policy", str(tmp_path / "pipe"), "--state", str(tmp_path / "robot")]) == 1
    assert "it is not a regular file" in capsys.readouterr().err


def test_an_overlay_grants_a_module_its_access_and_is_stored_with_its_site(
    robot: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    poor = (BASE / "site.yaml").read_text().replace("panel, gripper, camera]", "panel, gripper]")
    (tmp_path / "site.yaml").write_text(poor)
    (tmp_path / "cell.yaml").write_text(
        "schema: aeros/overlay/1\nbase: site.yaml\ngrants: {tidy: {sensors: [camera]}}\n"
    )
    assert run("policy", "site.yaml") == 0
    assert run("install", str(BASE / "tidy")) == 1
    assert "AE404" in capsys.readouterr().err
    assert run("policy", "cell.yaml") == 0
    assert "  tidy may also use sensors camera\n" in capsys.readouterr().out
    (tmp_path / "site.yaml").unlink()
    (tmp_path / "cell.yaml").unlink()
    assert run("install", str(BASE / "tidy")) == 0
    snapshot = Registry(robot).snapshot()
    assert Registry(robot).configuration(snapshot)[0].site.grants["tidy"].sensors == {"camera"}
    changes = [json.loads(line) for line in (robot / "registry" / "audit.jsonl").read_text().splitlines()]
    assert any(str(one).count(snapshot.site) and "policy cell.yaml" in str(one) for one in changes)
    (tmp_path / "site.yaml").write_text(poor)
    assert run("policy", "site.yaml") == 1
    assert "AE404" in capsys.readouterr().err


@pytest.mark.usefixtures("robot")
def test_blocks_of_a_policy_are_shown_and_misspelt_names_are_a_warning(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "site.yaml").write_text((BASE / "site.yaml").read_text())
    block = "blocks: [{id: worn, reason: the cloth is worn, module: tidy, skill: wipee}]\n"
    (tmp_path / "cell.yaml").write_text(f"schema: aeros/overlay/1\nbase: site.yaml\n{block}")
    assert run("install", str(BASE / "tidy")) == 0
    capsys.readouterr()
    assert run("policy", str(tmp_path / "cell.yaml")) == 0
    shown = capsys.readouterr()
    assert "  blocked: worn: the cloth is worn (module tidy, skill wipee)\n" in shown.out
    assert "the operator override `worn` blocks `tidy.wipee`, which is not in this set" in shown.err
    assert "did you mean `tidy.wipe`?" in shown.err


@pytest.mark.usefixtures("robot")
def test_a_site_whose_robot_would_not_be_found_again_is_not_put_in_force(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    site = (BASE / "site.yaml").read_text()
    (tmp_path / "site.yaml").write_text(site.replace("id: bench\n", "id: bench\nrobot: my_arm.yaml\n", 1))
    assert run("policy", str(tmp_path / "site.yaml")) == 1
    assert "the robot `my_arm.yaml` is a path relative to" in capsys.readouterr().err
    assert run("policy", str(BASE / "site.yaml")) == 0
