"""Changes of what is installed: proved first, made whole, refused without a trace."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from aeros.runtime.audit.log import verify_log
from aeros.runtime.registry.folder_modules import FolderModules
from aeros.runtime.registry.lifecycle import ModuleState
from aeros.runtime.registry.operator_block import OperatorBlock
from aeros.runtime.registry.registry import Registry
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.configured import UNCONFIGURED, ModuleConfiguration
from tests.unit.runtime.registry.conftest import BASE, Author


def contents(registry: Registry) -> dict[str, str]:
    """The digest of every file of the registry, by path."""
    return {
        str(path.relative_to(registry.folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(registry.folder.rglob("*"))
        if path.is_file()
    }


def refused(registry: Registry, change: Callable[[], object]) -> list[str]:
    """The codes of the refusal of `change`, which has changed no byte."""
    before = contents(registry)
    with pytest.raises(UserError) as raised:
        change()
    assert contents(registry) == before
    return [found.code for found in raised.value.diagnostics]


def bring_up(registry: Registry, folder: Path) -> str:
    name = registry.install(folder).name
    registry.configure(name)
    registry.activate(name)
    return name


def test_a_module_lives_and_is_forgotten(registry: Registry, write: Author) -> None:
    name = bring_up(registry, write())
    configuration, _ = registry.configuration()
    assert list(configuration.modules) == [name]
    assert registry.deactivate(name).state is ModuleState.CONFIGURED
    assert registry.configuration()[0].modules == {}
    registry.activate(name)
    registry.deactivate(name)
    registry.remove(name)
    assert registry.snapshot().modules == {}
    log = registry.folder / "audit.jsonl"
    assert verify_log(log).is_sound
    records = [json.loads(line) for line in log.read_text().splitlines()]
    details = [one["details"] for one in records if one["event"] == "registry-change"]
    assert [(one["from"], one["to"]) for one in details] == [(n, n + 1) for n in range(len(details))]
    assert details[3]["modules"]["tidy"]["state"] == "active"
    assert details[-1]["modules"] == {}
    assert [one["change"].split()[0] for one in details] == [
        "policy",
        "install",
        "configure",
        "activate",
        "deactivate",
        "activate",
        "deactivate",
        "remove",
    ]


def test_a_module_is_installed_and_activated_in_one_recorded_change(
    registry: Registry, write: Author
) -> None:
    before = registry.snapshot()
    source = write()
    one = registry.install(source, active=UNCONFIGURED)
    assert one.state is ModuleState.ACTIVE
    assert list(registry.configuration()[0].modules) == ["tidy"]
    assert registry.snapshot().generation == before.generation + 1
    records = map(json.loads, (registry.folder / "audit.jsonl").read_text().splitlines())
    changes = [record["details"]["change"] for record in records if record["event"] == "registry-change"]
    assert changes[1:] == [f"install and activate tidy 1.0.0 sha256:{one.digest}"]
    registry.deactivate("tidy")
    assert registry.snapshot().withdrawn == {"tidy"}
    registry.install(source, active=UNCONFIGURED)
    assert registry.snapshot().withdrawn == frozenset()


def test_a_module_that_cannot_be_activated_at_once_is_not_installed_either(
    registry: Registry, write: Author
) -> None:
    settings = ModuleConfiguration(bindings={"camera": "nowhere"})
    assert refused(registry, lambda: registry.install(write(), active=settings))
    assert registry.snapshot().modules == {}


def test_the_stored_copy_is_proved_and_not_the_source_folder(registry: Registry, write: Author) -> None:
    source = write()
    bring_up(registry, source)
    shutil.rmtree(source)
    assert list(registry.configuration()[0].modules) == ["tidy"]


def test_a_module_that_cannot_be_proved_is_not_installed(registry: Registry, write: Author) -> None:
    unsafe = write()
    manifest = unsafe / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace("speed <= 250 mm/s", "speed <= 400 mm/s", 1))
    assert "AE501" in refused(registry, lambda: registry.install(unsafe))


def test_a_policy_under_which_something_installed_is_unsafe_is_refused(
    registry: Registry, write: Author, tmp_path: Path
) -> None:
    bring_up(registry, write())
    stricter = tmp_path / "stricter.yaml"
    text = (BASE / "site.yaml").read_text()
    assert "force <= 30 N" in text
    stricter.write_text(text.replace("force <= 30 N", "force <= 9 N"))
    assert "AE501" in refused(registry, lambda: registry.set_policy(stricter))
    looser = tmp_path / "looser.yaml"
    looser.write_text(text.replace("force <= 30 N", "force <= 25 N"))
    registry.set_policy(looser)
    assert registry.configuration()[0].site.digest == hashlib.sha256(looser.read_bytes()).hexdigest()


def test_a_block_is_part_of_what_is_proved_and_of_what_is_in_force(registry: Registry, write: Author) -> None:
    bring_up(registry, write())
    before = registry.configuration()[0]
    registry.add_block(OperatorBlock("worn", "a finger is worn", None, None, "grip"))
    now = registry.configuration()[0]
    assert [block.id for block in now.site.blocks] == [*(b.id for b in before.site.blocks), "worn"]
    assert now.digest != before.digest
    registry.remove_block("worn")
    assert registry.configuration()[0].digest == before.digest


@pytest.mark.parametrize(
    ("block", "code"),
    [
        (OperatorBlock("all", "", None, None, "stop"), "AE602"),
        (OperatorBlock("typo", "", None, None, "gripp"), "AE960"),
        (OperatorBlock("typo", "", None, None, None, channel="internett"), "AE960"),
        (OperatorBlock("typo", "", None, None, None, device="chipp"), "AE960"),
        (OperatorBlock("worn", "again", "tidy", None, None), "AE960"),
    ],
)
def test_a_block_that_stops_the_stop_or_nothing_is_refused(
    registry: Registry, block: OperatorBlock, code: str
) -> None:
    registry.add_block(OperatorBlock("worn", "a finger is worn", None, None, "grip"))
    assert code in refused(registry, lambda: registry.add_block(block))


def test_channels_and_devices_are_switched_off_and_on_while_a_run_goes_on(
    tmp_path: Path, write: Author
) -> None:
    site, folder = tmp_path / "site.yaml", write()
    text = (BASE / "site.yaml").read_text()
    text = text.replace(
        "  grip:\n",
        "  ask:\n    description: ask how long to wipe\n    risk: low\n"
        '    tool: {http: "https://time.example/wiping", timeout: 2 s, answers: [], channel: internet}\n'
        "  grip:\n",
    )
    access = "    sensors: [scanner, panel, gripper, camera]\n"
    granted = "  grants: {tidy: {channels: [internet]}}\n"  # for one module alone
    text = text.replace(access, f"{access}    compute: [chip]\n{granted}")
    site.write_text(f"{text}compute: {{chip: /dev/null}}\n")
    manifest = folder / "ecm.yaml"
    asked = "  sensors: [scanner, gripper, camera]\n"
    manifest.write_text(manifest.read_text().replace(asked, f"{asked}  compute: [chip]\n"))
    registry = Registry(tmp_path / "robot")
    registry.set_policy(site)
    bring_up(registry, folder)
    loaded = registry.load(registry.snapshot())

    def revoked(kind: str) -> str | None:
        return loaded.revocation_reason(registry.snapshot(), "tidy", "rest", kind)

    for block, denied in (
        (OperatorBlock("one", "no line", None, None, None, channel="internet"), {"ask"}),
        (OperatorBlock("one", "too hot", None, None, None, device="chip"), {"ask", "wait"}),
    ):
        registry.add_block(block)
        assert {kind for kind in ("ask", "wait") if revoked(kind) is not None} == denied
        blocks = registry.configuration()[0].site.blocks
        matching = {
            kind for kind in ("ask", "wait") if any(one.matches("tidy", "rest", kind) for one in blocks)
        }
        assert matching == denied
        folder_modules = FolderModules([folder], site, registry, needs_certificates=False)
        assert folder_modules.load(registry.snapshot()).configuration.site.blocks == blocks
        registry.remove_block("one")
        assert revoked("ask") is None


def test_an_upgrade_keeps_the_state_and_a_downgrade_too(registry: Registry, write: Author) -> None:
    bring_up(registry, write())
    newer, older = write("newer", version="1.1.0"), write("older", version="0.9.0")
    registry.install(newer)
    assert refused(registry, lambda: registry.install(older)) == ["AE967"]
    for folder, version in ((newer, "1.1.0"), (older, "0.9.0")):
        one = registry.install(folder, allows_downgrade=True)
        assert (one.version, one.state) == (version, ModuleState.ACTIVE)
        assert registry.configuration()[0].modules["tidy"].version == version


def test_steps_out_of_turn_and_unknown_names_are_refused(registry: Registry, write: Author) -> None:
    folder = write()
    registry.install(folder)
    assert refused(registry, lambda: registry.activate("tidy")) == ["AE960"]
    assert refused(registry, lambda: registry.deactivate("tidy")) == ["AE960"]
    assert refused(registry, lambda: registry.configure("tidi")) == ["AE960"]
    assert refused(registry, lambda: registry.remove_block("worn")) == ["AE960"]
    assert refused(registry, lambda: registry.install(folder, "sha256:" + "0" * 64)) == ["AE963"]
    assert refused(registry, lambda: registry.install(folder / "nothing")) != []


def test_a_refused_first_change_leaves_no_folder(tmp_path: Path, write: Author) -> None:
    registry = Registry(tmp_path / "robot")
    with pytest.raises(UserError):
        registry.install(write(), "sha256:" + "0" * 64)
    assert not (tmp_path / "robot").exists()
