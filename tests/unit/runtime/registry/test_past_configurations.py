"""A past configuration can be made again by its digest, or the error names the missing part."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from aeros.runtime.audit.check import Record, verify_log
from aeros.runtime.audit.log import AuditLog
from aeros.runtime.execution.executor import Executor
from aeros.runtime.gate.configuration import Configuration, UnknownConfigurationError
from aeros.runtime.gate.gate import CompiledGate
from aeros.runtime.ports import StepRequest
from aeros.runtime.records.replay import LogReplay
from aeros.runtime.registry.folder_modules import FolderModules
from aeros.runtime.registry.operator_block import OperatorBlock
from aeros.runtime.registry.past_configurations import FolderConfigurations, PastConfigurations
from aeros.runtime.registry.registry import Registry
from aeros.runtime.registry.registry_governor import RegistryGovernor
from aeros.runtime.skills.in_process_run import run_in_process
from aeros.sim.fake import FakePlant
from aeros.sim.symbolic.state import initial_values
from aeros.spec.diagnostics.errors import UserError
from tests.unit.runtime.registry.conftest import BASE, Author

Change = Callable[[list[Record]], None]


def _now(registry: Registry) -> Configuration:
    return registry.configuration()[0]


@pytest.fixture
def lived(registry: Registry, write: Author, tmp_path: Path) -> list[Configuration]:
    """Configurations in force, one after the other, until nothing was installed any more."""
    looser = tmp_path / "looser.yaml"
    looser.write_text((BASE / "site.yaml").read_text().replace("force <= 30 N", "force <= 25 N"))
    was = []
    registry.install(write())
    registry.configure("tidy")
    for change in (
        lambda: registry.activate("tidy"),
        lambda: registry.add_block(OperatorBlock("worn", "a finger is worn", None, None, "grip")),
        lambda: registry.add_block(OperatorBlock("armed", "it is being serviced", "tidy", "wipe", None)),
        lambda: registry.install(write("newer", version="1.1.0")),
        lambda: registry.remove_block("worn"),
        lambda: registry.set_policy(looser),
        lambda: registry.deactivate("tidy"),
        lambda: registry.remove("tidy"),
    ):
        change()
        was.append(_now(registry))
    return was


def test_every_configuration_is_made_again(registry: Registry, lived: list[Configuration]) -> None:
    past = PastConfigurations(registry)
    for was in lived:
        again = past(was.digest)
        assert (again.digest, again.site.blocks) == (was.digest, was.site.blocks)
        assert again.certificates == was.certificates
    assert (
        len({was.digest for was in lived}) == len(lived) - 1
    )  # to remove what is not active changes nothing


def test_the_log_of_changes_names_what_is_then_in_force(
    registry: Registry, lived: list[Configuration]
) -> None:
    lines = (registry.folder / "audit.jsonl").read_text().splitlines()
    records = map(json.loads, lines)
    named = [one["details"]["configuration"] for one in records if one["event"] == "registry-change"]
    assert named[-len(lived) :] == [was.digest for was in lived]


def test_modules_that_were_never_active_are_not_kept(registry: Registry, write: Author) -> None:
    registry.install(write())
    registry.install(write("newer", version="1.1.0"))
    assert len(list((registry.folder / "modules").iterdir())) == 1
    registry.remove("tidy")
    assert not any((registry.folder / "modules").iterdir())


def _refusal(registry: Registry, digest: str) -> str:
    with pytest.raises(UnknownConfigurationError) as raised:
        PastConfigurations(registry)(digest)
    return str(raised.value)


def test_it_says_what_is_missing(registry: Registry, lived: list[Configuration]) -> None:
    first = lived[0]
    log = registry.folder / "audit.jsonl"
    assert _refusal(registry, "0" * 64).startswith(f"no change recorded in `{log}` led to it; ")
    kept = [path for path in (registry.folder / "modules").iterdir() if "1.0.0" in _version(path)]
    (folder,) = kept
    manifest = folder / "tidy" / "ecm.yaml"
    manifest.write_text(manifest.read_text() + "# edited\n")
    assert _refusal(registry, first.digest) == (
        "it is refused now: the stored files of `tidy` differ from the installed ones"
    )
    shutil.rmtree(folder)
    missing = f"parts of it are no longer stored: `tidy` 1.0.0 sha256:{folder.name}"
    assert _refusal(registry, first.digest) == missing
    for policy in (registry.folder / "policies").iterdir():
        policy.unlink()
    assert _refusal(registry, first.digest) == f"{missing}, `policies/{first.site.digest}.yaml`"


def _version(folder: Path) -> str:
    return (folder / "tidy" / "ecm.yaml").read_text()


def test_a_policy_that_was_edited_where_it_is_kept_is_noticed(
    registry: Registry, lived: list[Configuration]
) -> None:
    policy = registry.folder / "policies" / f"{lived[0].site.digest}.yaml"
    policy.write_text(policy.read_text() + "# edited\n")
    refused = _refusal(registry, lived[0].digest)
    assert refused.startswith("it is refused now: the policy")
    assert refused.endswith("differs from the one that was put in force")


def test_an_unreadable_or_missing_log_leads_to_no_configuration(
    registry: Registry, lived: list[Configuration]
) -> None:
    log = registry.folder / "audit.jsonl"
    log.write_bytes(log.read_bytes().splitlines(keepends=True)[-1])  # not sound from its first record on
    assert _refusal(registry, lived[0].digest).startswith("no change recorded")
    log.unlink()
    assert _refusal(registry, lived[0].digest).startswith("no change recorded")


# A log across changes.


@pytest.fixture
def log(registry: Registry, write: Author, tmp_path: Path) -> Path:
    """Of a session in which what was in force changed twice; nothing of it is installed any more."""
    registry.install(write())
    registry.configure("tidy")
    registry.activate("tidy")
    configuration, path = _now(registry), tmp_path / "audit.jsonl"
    plant = FakePlant(initial_values(configuration.site, {}))
    with (
        RegistryGovernor(registry) as governing,
        AuditLog(path) as audit,
        Executor(
            configuration, CompiledGate(configuration), plant, audit, run_in_process, governing
        ) as executor,
    ):
        for change in (
            lambda: registry.add_block(OperatorBlock("worn", "a finger is worn", None, None, "grip")),
            lambda: registry.install(write("newer", version="1.1.0")),
            lambda: registry.deactivate("tidy"),
        ):
            executor.run_step(StepRequest("tidy", "rest", {}))
            change()
    registry.remove("tidy")
    return path


def _replayed(registry: Registry, log: Path, change: Change = lambda records: None) -> LogReplay:
    replay = LogReplay(PastConfigurations(registry))
    records: list[Record] = []
    assert verify_log(log, lambda record, _: records.append(record)).is_sound
    change(records)
    for record in records:
        replay.replay_record(record)
    return replay


def _decisions(records: list[Record]) -> list[Record]:
    return [record for record in records if record["event"] == "decision"]


def test_a_log_is_decided_again_under_all_that_was_in_force(registry: Registry, log: Path) -> None:
    seen: list[Record] = []
    replay = _replayed(registry, log, seen.extend)
    assert (replay.mismatches, replay.matching_count) == ([], 3)
    assert len({record["details"]["configuration"] for record in _decisions(seen)}) == 3


def _another_of_them(records: list[Record]) -> None:
    first, second, _ = _decisions(records)
    second["details"]["configuration"] = first["details"]["configuration"]


def _a_change_left_out(records: list[Record]) -> None:
    records.remove(next(one for one in records if one["event"] == "configuration-changed"))


def _a_change_to_another_of_them(records: list[Record]) -> None:
    first, second = (one for one in records if one["event"] == "configuration-changed")
    second["details"] = first["details"]


def _a_change_edited(records: list[Record]) -> None:
    change = next(one for one in records if one["event"] == "configuration-changed")
    change["details"]["modules"]["tidy"]["version"] = "1.0.1"


@pytest.mark.parametrize(
    "change", [_another_of_them, _a_change_left_out, _a_change_to_another_of_them, _a_change_edited]
)
def test_a_log_that_says_otherwise_is_found(change: Change, registry: Registry, log: Path) -> None:
    replay = _replayed(registry, log, change)
    assert len(replay.mismatches) == 1
    assert replay.matching_count == (3 if change is _a_change_edited else 2)


def test_configurations_of_a_folder_are_found_under_every_state_of_the_registry(
    registry: Registry, write: Author
) -> None:
    folder = write()
    block = OperatorBlock("old", "drops cups", "tidy", None, None, "<2")
    changes: tuple[Callable[[], object], ...] = (
        lambda: registry.add_block(block),
        lambda: registry.add_block(OperatorBlock("bad", "odd", None, None, None, None, "0" * 64)),
        lambda: registry.remove_block("old"),
    )
    was = []
    for change in changes:
        change()
        modules = FolderModules([folder], None, registry, needs_certificates=False)
        was.append(modules.load(registry.snapshot()).configuration)
    known = FolderConfigurations([folder], None, registry)
    assert [known(one.digest).digest for one in was] == [one.digest for one in was]
    assert len({one.digest for one in was}) == 2
    with pytest.raises(UnknownConfigurationError, match="never led to it on this robot"):
        known("0" * 64)


def test_without_a_registry_an_error_in_the_folder_is_reported(tmp_path: Path, write: Author) -> None:
    registry = Registry(tmp_path / "none")
    with pytest.raises(UserError, match="AE130"):
        FolderConfigurations([tmp_path / "absent"], BASE / "site.yaml", registry)
    folder = write()
    known = FolderConfigurations([folder], BASE / "site.yaml", registry)
    with pytest.raises(UnknownConfigurationError):
        known("0" * 64)
