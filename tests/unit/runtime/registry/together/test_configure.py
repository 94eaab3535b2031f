"""Modules that are configured on a robot: bound, set, proved as bound, kept and recorded."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from aeros.runtime.registry.lifecycle import ModuleState
from aeros.runtime.registry.registry import Registry
from aeros.runtime.registry.store import InstalledModule
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.configured import UNCONFIGURED, ModuleConfiguration
from tests.unit.runtime.registry.conftest import BASE, Author

NEEDS = """\
needs:
  surface: {is: volume, description: the surface to wipe}
  glide: {is: action, parameters: [target, speed]}

parameters:
  pace: {type: real, unit: m/s, range: [0.01, 1], default: 200 mm/s}

capabilities:
"""
BENCH = ModuleConfiguration({"surface": "bench_top"})


@pytest.fixture
def folder(write: Author) -> Path:
    """The module `tidy`, for any site with a surface and an action that glides."""
    return portable(write())


def portable(made: Path) -> Path:
    manifest, code = made / "ecm.yaml", made / "skills.py"
    text = manifest.read_text().replace("capabilities:\n", NEEDS, 1)
    old = "move: target in bench_top and speed <= 250 mm/s"
    assert old in text
    text = text.replace(old, "glide: target in surface and speed <= pace")
    manifest.write_text(text.replace("    move: target in bench_top", "    glide: target in surface"))
    assert 'act("move"' in code.read_text()
    text = code.read_text().replace('act("move"', 'act("glide"')
    assert "speed=0.2" in text
    code.write_text(text.replace("speed=0.2", "speed=0.02"))
    return made


def changes(registry: Registry) -> list[str]:
    records = [json.loads(line) for line in (registry.folder / "audit.jsonl").read_text().splitlines()]
    return [one["details"]["change"] for one in records if one["event"] == "registry-change"]


def refusal(change: object, *arguments: object, **options: object) -> list[str]:
    assert callable(change)
    with pytest.raises(UserError) as raised:
        change(*arguments, **options)
    return [one.code for one in raised.value.diagnostics]


def test_a_module_with_a_choice_is_activated_at_once_where_the_choice_is_given(
    registry: Registry, folder: Path
) -> None:
    with pytest.raises(UserError) as raised:
        registry.install(folder, active=UNCONFIGURED)
    assert raised.value.diagnostics[0].help[0] == "add `--bind surface=pillar`, or other choices"
    assert registry.snapshot().modules == {}
    assert registry.install(folder, active=BENCH).state is ModuleState.ACTIVE
    assert changes(registry)[-1].endswith(" surface=bench_top")
    assert registry.install(folder, active=UNCONFIGURED).state is ModuleState.ACTIVE  # its settings are kept
    assert registry.configuration()[0].modules.keys() == {"tidy"}
    assert refusal(registry.install, folder, active=BENCH) == ["AE960"]  # an active one cannot be configured


def test_a_module_with_a_choice_is_installed_and_waits_to_be_configured(
    registry: Registry, folder: Path
) -> None:
    assert registry.install(folder).state is ModuleState.INSTALLED
    assert {one.name: one.value for one in registry.settings("tidy")} == {
        "surface": "",
        "glide": "move",
        "pace": "200 mm/s",
    }
    assert registry.configuration()[0].modules == {}
    assert registry.inactive_modules() == {}
    assert registry.capabilities(registry.snapshot()) == {"tidy": ("tidying",)}
    assert registry.skills("tidy") == ("pick_cloth", "rest", "wipe")
    assert refusal(registry.configure, "tidy") == ["AE136"]
    assert refusal(registry.activate, "tidy") == ["AE960"]
    assert registry.snapshot().modules["tidy"].state is ModuleState.INSTALLED


def test_it_is_proved_as_bound_and_its_certificate_names_that(registry: Registry, folder: Path) -> None:
    registry.install(folder)
    registry.configure("tidy", BENCH)
    registry.activate("tidy")
    configuration, _ = registry.configuration()
    assert configuration.certificates["tidy"].configuration == {
        "surface": "bench_top",
        "glide": "move",
        "pace": "200 mm/s",
    }
    assert list(configuration.modules["tidy"].skills["wipe"].envelope) == ["move", "wait"]
    assert changes(registry)[-2:] == ["configure tidy surface=bench_top", "activate tidy"]


def test_settings_hold_until_the_next_and_are_forgotten_on_demand(registry: Registry, folder: Path) -> None:
    registry.install(folder)
    registry.configure("tidy", BENCH)
    slow = registry.configure("tidy", ModuleConfiguration(parameters={"pace": "100 mm/s"}))
    assert slow.configuration == BENCH.updated(ModuleConfiguration(parameters={"pace": "100 mm/s"}))
    digest = registry.configuration()[0].digest
    assert Registry(registry.folder.parent).snapshot().modules["tidy"] == slow
    again = registry.configure("tidy", BENCH, resets=True)
    assert again.configuration == BENCH
    assert registry.configuration()[0].digest == digest  # it is not active
    reset = registry.configure("tidy", resets=True)
    assert (reset.state, reset.configuration) == (ModuleState.INSTALLED, ModuleConfiguration())
    assert changes(registry)[-1] == "reset tidy"
    assert [one.reason for one in registry.waiting().values()] == ["open: `surface`"]
    assert refusal(registry.activate, "tidy") == ["AE960"]


def test_a_reset_that_leaves_nothing_open_configures(registry: Registry, folder: Path) -> None:
    manifest = folder / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace("surface", "bench_top"))
    registry.install(folder)
    registry.configure("tidy", ModuleConfiguration(parameters={"pace": "100 mm/s"}))
    assert registry.configure("tidy", resets=True).state is ModuleState.CONFIGURED
    assert registry.settings("tidy")[-1].value == "200 mm/s"


def test_a_reset_with_settings_must_leave_nothing_open(registry: Registry, folder: Path) -> None:
    registry.install(folder)
    before = registry.configure("tidy", BENCH)
    slow = ModuleConfiguration(parameters={"pace": "100 mm/s"})
    assert refusal(registry.configure, "tidy", slow, resets=True) == ["AE136"]
    assert registry.snapshot().modules["tidy"] == before


@pytest.mark.parametrize(
    ("settings", "codes"),
    [
        (ModuleConfiguration({"surface": "largest_cloth"}), ["AE501"]),  # it is not above the bench
        (ModuleConfiguration({"surface": "nowhere"}), ["AE136"]),
        (BENCH.updated(ModuleConfiguration(parameters={"pace": "300 mm/s"})), ["AE501"]),
        (BENCH.updated(ModuleConfiguration(parameters={"pace": "2 m/s"})), ["AE111"]),
        (BENCH.updated(ModuleConfiguration(parameters={"place": "1 m/s"})), ["AE122"]),
    ],
)
def test_settings_that_cannot_be_proved_are_refused(
    registry: Registry, folder: Path, settings: ModuleConfiguration, codes: list[str]
) -> None:
    registry.install(folder)
    before = registry.snapshot()
    assert set(codes) <= set(refusal(registry.configure, "tidy", settings))
    assert registry.snapshot() == before


def test_an_active_module_is_not_configured_under_the_hand_of_a_run(registry: Registry, folder: Path) -> None:
    registry.install(folder)
    registry.configure("tidy", BENCH)
    registry.activate("tidy")
    for resets in (False, True):
        with pytest.raises(UserError) as raised:
            registry.configure("tidy", resets=resets)
        (problem,) = raised.value.diagnostics
        assert problem.code == "AE960"
        assert "`aeros deactivate tidy` first, and `aeros activate tidy` afterwards" in problem.help


def test_an_upgrade_keeps_the_settings_that_it_still_declares(
    registry: Registry, folder: Path, write: Author
) -> None:
    registry.install(folder)
    registry.configure("tidy", BENCH.updated(ModuleConfiguration(parameters={"pace": "100 mm/s"})))
    registry.activate("tidy")
    newer = portable(write("newer", version="1.1.0"))
    manifest = newer / "ecm.yaml"
    manifest.write_text(
        manifest.read_text()
        .replace("  pace: {type: real, unit: m/s, range: [0.01, 1], default: 200 mm/s}\n", "")
        .replace("parameters:\n\n", "")
        .replace("speed <= pace", "speed <= 250 mm/s")
    )
    assert registry.install(newer).configuration == BENCH
    assert registry.snapshot().modules["tidy"].state is ModuleState.ACTIVE


@pytest.mark.parametrize("active", [None, UNCONFIGURED])
def test_an_upgrade_of_an_active_module_leaves_nothing_open(
    active: ModuleConfiguration | None, registry: Registry, folder: Path, write: Author
) -> None:
    registry.install(folder)
    registry.configure("tidy", BENCH)
    registry.activate("tidy")
    newer = portable(write("newer", version="1.1.0"))
    manifest = newer / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace("surface", "area"))
    with pytest.raises(UserError) as raised:
        registry.install(newer, active=active)
    (problem,) = raised.value.diagnostics
    assert problem.code == "AE960"
    assert problem.help[1:] == (
        "`aeros deactivate tidy`",
        f"`aeros install {newer}`",
        "`aeros configure tidy --bind area=pillar`",  # the first volume of the site
        "`aeros activate tidy`",
    )
    assert registry.snapshot().modules["tidy"].version == "1.0.0"
    registry.deactivate("tidy")
    assert registry.install(newer).state is ModuleState.INSTALLED
    registry.configure("tidy", ModuleConfiguration({"area": "bench_top"}))
    registry.activate("tidy")


@pytest.fixture
def other(tmp_path: Path) -> Path:
    """The site with other words, and settings for the module."""
    other = tmp_path / "other.yaml"
    text = (BASE / "site.yaml").read_text()
    for old, new in (
        ("bench_top", "counter"),
        ("  move:", "  travel:"),
        ("[move", "[travel"),
        ("{move:", "{travel:"),
    ):
        assert old in text
        text = text.replace(old, new)
    other.write_text(text.replace("\npolicy:", "\nmodules:\n  tidy: {bind: {surface: counter}}\n\npolicy:"))
    return other


def test_a_configured_module_waits_at_a_site_to_which_its_settings_do_not_belong(
    registry: Registry, folder: Path, other: Path
) -> None:
    registry.install(folder)
    first = registry.configure("tidy", BENCH)
    registry.set_policy(other)
    assert registry.snapshot().modules["tidy"] == replace(first, state=ModuleState.INSTALLED)
    (waiting,) = registry.waiting().values()
    assert waiting.reason == "open: `surface`"
    assert waiting.command == "aeros configure tidy --bind surface=counter"  # as the site file says
    assert refusal(registry.configure, "tidy") == ["AE136"]
    assert registry.configure("tidy", resets=True).state is ModuleState.CONFIGURED
    registry.activate("tidy")
    found = registry.configuration()[0].certificates["tidy"].configuration
    assert (found["surface"], found["glide"]) == ("counter", "travel")


def test_an_active_module_is_not_left_without_what_it_needs(
    registry: Registry, folder: Path, other: Path
) -> None:
    registry.install(folder)
    registry.configure("tidy", BENCH)
    registry.activate("tidy")
    before = registry.snapshot()
    with pytest.raises(UserError) as raised:
        registry.set_policy(other)
    (problem,) = raised.value.diagnostics
    assert problem.code == "AE960"
    assert problem.help[1:] == (
        "`aeros deactivate tidy`",
        f"`aeros policy {other}`",
        "`aeros configure tidy --bind surface=counter`",
        "`aeros activate tidy`",
    )
    assert registry.snapshot() == before
    registry.deactivate("tidy")
    registry.set_policy(other)
    registry.configure("tidy", ModuleConfiguration({"surface": "counter"}))
    registry.activate("tidy")


def needed(withdraw: Callable[[str], InstalledModule]) -> tuple[str, ...]:
    with pytest.raises(UserError) as refused:
        withdraw("tidy")
    (problem,) = refused.value.diagnostics
    return problem.code, problem.headline, *problem.help


def test_a_module_waits_for_one_that_it_needs(
    registry: Registry, folder: Path, write: Author, other: Path
) -> None:
    registry.install(folder)
    needy = write("needy", id="needy")
    manifest = portable(needy) / "ecm.yaml"
    text = manifest.read_text().replace("tidying", "polishing").replace("[clean, wipe]", "[polish]")
    manifest.write_text(text + '  modules: {tidy: ">=1.0"}\n')
    assert registry.install(needy).state is ModuleState.INSTALLED
    assert list(registry.waiting()) == ["tidy", "needy"]
    assert refusal(registry.configure, "needy", BENCH) == ["AE964"]
    registry.configure("tidy", BENCH)
    registry.configure("needy", BENCH)
    assert refusal(registry.configure, "tidy", resets=True) == ["AE964"]
    registry.activate("tidy")
    registry.activate("needy")
    assert needed(registry.deactivate) == ("AE964", "`needy` needs `tidy`", "`aeros deactivate needy` first")
    registry.deactivate("needy")
    registry.deactivate("tidy")
    assert needed(registry.remove) == ("AE964", "`needy` needs `tidy`", "`aeros remove needy` first")
    registry.activate("tidy")
    registry.activate("needy")
    with pytest.raises(UserError) as raised:
        registry.set_policy(other)
    assert [one for one in raised.value.diagnostics[0].help if "activate" in one] == [
        "`aeros deactivate needy`",
        "`aeros deactivate tidy`",
        "`aeros activate tidy`",
        "`aeros activate needy`",
    ]


def test_a_module_with_nothing_open_is_installed_after_what_it_needs_is_configured(
    registry: Registry, folder: Path, write: Author
) -> None:
    needy = write("needy", id="needy")
    text = (
        (needy / "ecm.yaml").read_text().replace("tidying", "polishing").replace("[clean, wipe]", "[polish]")
    )
    (needy / "ecm.yaml").write_text(text + '  modules: {tidy: ">=1.0"}\n')
    assert refusal(registry.install, needy) == ["AE301"]
    registry.install(folder)
    with pytest.raises(UserError) as refused:
        registry.install(needy)
    (problem,) = refused.value.diagnostics
    assert problem.code == "AE964"
    assert problem.headline == "`needy` needs a module that waits to be configured; these wait: `tidy`"
    assert problem.help[0].startswith("`aeros configure tidy --bind surface=")
    registry.configure("tidy", BENCH)
    registry.install(needy)
    assert registry.configure("needy").state is ModuleState.CONFIGURED


def test_a_repair_puts_the_settings_in_force_again(registry: Registry, folder: Path) -> None:
    registry.install(folder)
    configured = registry.configure("tidy", BENCH)
    (registry.folder / "registry.sqlite3").unlink()
    repaired = registry.repair()
    assert repaired is not None
    assert repaired.modules["tidy"] == configured
