from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any, cast

import pytest

from aeros.agent.errors import AgentError
from aeros.agent.instructions.refusals import InstructionError
from aeros.cli.main import main
from aeros.runtime.audit.keys import InvalidKeyError, make_key, read_public_key
from aeros.runtime.audit.log import AuditLog
from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.registry.registry import Registry
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.session.plant_factory import PlantSetupError
from aeros.session.setup import (
    KEY,
    SETUP_ERRORS,
    build_signing,
    create_output_folder,
    default_anchor,
    find_signing_key,
    open_governor,
    open_isolated_skills,
    understand_instruction,
)
from tests.repo.tree import ROOT
from tests.unit.runtime.bench import configuration

BASE = ROOT / "docs" / "codes" / "base"


def test_an_output_folder_is_new_or_empty(tmp_path: Path) -> None:
    assert create_output_folder(tmp_path / "a" / "b", "tidy") == tmp_path / "a" / "b"
    with pytest.raises(PlantSetupError, match="is not empty; give a new folder with --out"):
        create_output_folder(tmp_path / "a", "tidy")
    (tmp_path / "file").touch()
    with pytest.raises(PlantSetupError, match="cannot write to"):
        create_output_folder(tmp_path / "file", "tidy")


def test_without_a_name_the_folder_is_named_for_the_task(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    first, second = (create_output_folder(None, "tidy") for _ in range(2))
    assert first != second
    assert first.parent == Path("runs")
    assert first.name.startswith("tidy-")


def test_the_governor_of_named_modules_obeys_the_operator(tmp_path: Path) -> None:
    governor, configuration, proof = open_governor(tmp_path, [ROOT / "ecms" / "clean_table"], None)
    with governor:
        assert list(configuration.modules) == ["clean_table"]
        assert [one.name for one in proof.modules] == ["clean_table"]
        assert governor.command is OperatorCommand.RUN
        assert str(understand_instruction("please clean the table", configuration, governor).first) == (
            "clean_table.clean_table"
        )


def test_the_first_run_makes_the_key_of_its_agent_and_later_ones_use_it(tmp_path: Path) -> None:
    state, out = tmp_path / "state", tmp_path / "out"
    signing = build_signing(find_signing_key(state), state, out)
    assert (state / KEY).stat().st_mode & 0o777 == 0o600
    assert state.stat().st_mode & 0o777 == 0o700
    assert read_public_key(state / "audit.key.pub").id == signing.key.public.id
    assert find_signing_key(state).public.id == signing.key.public.id
    assert signing.anchors == (default_anchor(state, out),)
    assert default_anchor(state, out) != default_anchor(state, tmp_path / "other" / "out")


@pytest.mark.parametrize("lost", [("audit.key",), ("audit.key", "audit.key.pub")])
def test_a_lost_key_is_not_replaced_silently(lost: tuple[str, ...], tmp_path: Path) -> None:
    state, out = tmp_path / "state", tmp_path / "out"
    out.mkdir()
    with AuditLog(out / "audit.jsonl", signing=build_signing(find_signing_key(state), state, out)):
        pass
    for name in lost:
        (state / name).unlink()
    with pytest.raises(InvalidKeyError, match=r"audit\.key` is gone: .* Restore it from a backup"):
        find_signing_key(state)
    assert not (state / KEY).exists()


def test_another_key_and_further_anchors_can_be_named(tmp_path: Path) -> None:
    make_key(tmp_path / "key")
    state, out, other = tmp_path / "state", tmp_path / "out", tmp_path / "anchor"
    signing = build_signing(find_signing_key(state, tmp_path / "key"), state, out, [other])
    assert signing.anchors == (default_anchor(state, out), other)
    assert signing.key.public.id == read_public_key(tmp_path / "key.pub").id
    assert not (state / KEY).exists()
    with pytest.raises(InvalidKeyError):
        find_signing_key(state, tmp_path / "nowhere")


def test_an_anchor_of_an_earlier_folder_of_that_name_is_dropped_only_if_there_is_no_log(
    tmp_path: Path,
) -> None:
    state, out = tmp_path / "state", tmp_path / "out"
    for has_log in (True, False):
        (anchor,) = build_signing(find_signing_key(state), state, out).anchors
        anchor.write_text("of an earlier log")
        out.mkdir(exist_ok=True)
        if has_log:
            (out / "audit.jsonl").touch()
        else:
            (out / "audit.jsonl").unlink()
        build_signing(find_signing_key(state), state, out)
        assert anchor.exists() == has_log


def test_without_modules_of_its_own_a_robot_runs_those_of_the_folder_ecms(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Once a module was installed, the folder counts only if it is named."""
    monkeypatch.chdir(tmp_path)
    state = tmp_path / "state"
    Registry(state).set_policy(BASE / "site.yaml")
    with open_governor(state, None, None)[0] as governor:
        assert governor.configuration()[1].site.id == "bench"
        with pytest.raises(InstructionError, match="no installed module provides"):
            understand_instruction("clean it", governor.configuration()[1], governor)
    (tmp_path / "ecms").mkdir()
    shutil.copytree(BASE / "tidy", tmp_path / "ecms" / "tidy")
    assert main(["verify", "ecms", "--site", str(BASE / "site.yaml")]) == 0
    for installs, found in ((False, ["tidy"]), (True, [])):
        if installs:
            Registry(state).install(BASE / "tidy")
        with open_governor(state, None, None)[0] as governor:
            assert list(governor.configuration()[1].modules) == found
        with open_governor(state, [Path("ecms")], BASE / "site.yaml")[0] as governor:
            assert list(governor.configuration()[1].modules) == ["tidy"]


def test_a_module_that_is_installed_and_not_active_is_named_as_a_hint(tmp_path: Path) -> None:
    registry = Registry(tmp_path)
    registry.set_policy(BASE / "site.yaml")
    registry.install(BASE / "tidy")
    with open_governor(tmp_path, None, None)[0] as governor:
        configuration = governor.configuration()[1]
        with pytest.raises(InstructionError, match=r"`aeros activate tidy`"):
            understand_instruction("clean it", configuration, governor)


class Skills:
    """A factory of skill runs on a host with given isolation layers."""

    unavailable_reason: str | None = None
    weakness_warning: str | None = None

    def __init__(self, *_: object) -> None:
        self.is_open = True

    def __enter__(self) -> Skills:
        return self

    def __exit__(self, *_: object) -> None:
        self.is_open = False


def open_skills(monkeypatch: pytest.MonkeyPatch, **host: str) -> tuple[Skills, list[str]]:
    warned: list[str] = []
    made = type("Host", (Skills,), host)
    monkeypatch.setattr("aeros.session.setup.SkillRunFactory", made)
    with open_isolated_skills(configuration(), warned.append) as opened:
        skills = cast(Any, opened)
        assert skills.is_open
    return skills, warned


def test_skills_are_isolated_until_the_block_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    skills, warned = open_skills(monkeypatch)
    assert (skills.is_open, warned) == (False, [])


def test_a_host_that_isolates_too_little_is_warned_of_or_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    assert open_skills(monkeypatch, weakness_warning="no landlock")[1] == ["no landlock"]
    with pytest.raises(SkillRefusedError, match="no seccomp"):
        open_skills(monkeypatch, unavailable_reason="no seccomp")


def test_every_reason_not_to_begin_is_among_the_errors_of_setting_up() -> None:
    assert set(SETUP_ERRORS) >= {AgentError, PlantSetupError, SkillRefusedError, InvalidKeyError}
