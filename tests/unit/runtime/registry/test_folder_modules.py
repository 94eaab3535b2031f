"""Modules of a folder, proved under the registry of the robot; test_operator_reach runs them."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.runtime.registry import folder_modules
from aeros.runtime.registry.bundle_store import bundle_digest, module_files
from aeros.runtime.registry.folder_modules import FolderModules, default_modules, uses_installed_modules
from aeros.runtime.registry.operator_block import UNKNOWN_DIGEST, ModuleIdentity, OperatorBlock
from aeros.runtime.registry.registry import Registry
from aeros.runtime.registry.store import RegistrySnapshot
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.configured import ModuleConfiguration
from tests.repo.tree import ROOT
from tests.unit.runtime.registry.conftest import BASE, Author

CORPUS = ROOT / "tests" / "corpus"


@pytest.fixture
def folder(write: Author) -> Path:
    """The module with its certificate under the site of docs/codes."""
    written = write()
    assert main(["verify", str(written), "--site", str(BASE / "site.yaml")]) == 0
    return written


def test_a_folder_is_loaded_with_version_and_digest(registry: Registry, folder: Path) -> None:
    loaded = FolderModules([folder], None, registry).load(registry.snapshot())
    assert list(loaded.configuration.modules) == ["tidy"]
    digest = bundle_digest(module_files(folder))
    assert loaded.identities["tidy"] == ModuleIdentity("1.0.0", digest, devices=frozenset())
    assert (loaded.withheld, loaded.is_installed, loaded.policy) == ({}, False, registry.snapshot().site)


def test_files_that_cannot_be_one_bundle_have_an_unknown_digest(registry: Registry, folder: Path) -> None:
    (folder / "data").symlink_to(folder / "ecm.yaml")
    loaded = FolderModules([folder], None, registry).load(registry.snapshot())
    assert loaded.identities["tidy"].digest == UNKNOWN_DIGEST


def test_certificates_are_needed_at_first_and_the_contents_stay(registry: Registry, folder: Path) -> None:
    modules = FolderModules([folder], None, registry)
    modules.load(registry.snapshot())
    (folder / "ecm.lock").unlink()
    modules.load(registry.snapshot())
    with pytest.raises(UserError, match="AE901") as refused:
        FolderModules([folder], None, registry).load(registry.snapshot())
    site = registry.site_file(registry.snapshot())
    assert f"`aeros verify {folder} --site {site}`" in refused.value.diagnostics[0].help[-1]
    manifest = folder / "ecm.yaml"
    manifest.write_text(manifest.read_text() + "# edited\n")
    with pytest.raises(UserError, match="changed since the run began"):
        modules.load(registry.snapshot())


def test_blocks_are_proved_with_the_modules(registry: Registry, folder: Path) -> None:
    registry.add_block(OperatorBlock("old", "drops cups", "tidy", None, None, "<2"))
    loaded = FolderModules([folder], None, registry).load(registry.snapshot())
    (override,) = loaded.configuration.site.blocks
    assert (override.id, override.module) == ("old", "tidy")


def test_a_site_of_its_own_is_refused_once_the_operator_set_another(
    registry: Registry, folder: Path, tmp_path: Path
) -> None:
    other = tmp_path / "other.yaml"
    other.write_text((BASE / "site.yaml").read_text() + "# another\n")
    with pytest.raises(UserError, match="is not the policy that is in force on this robot"):
        FolderModules([folder], other, registry).load(registry.snapshot())
    FolderModules([folder], BASE / "site.yaml", registry).load(registry.snapshot())
    FolderModules([folder], BASE / "site.yaml", registry).load(RegistrySnapshot())
    with pytest.raises(UserError, match="cannot be read"):
        FolderModules([folder], tmp_path / "none.yaml", registry).load(registry.snapshot())


def test_a_needed_module_that_was_withdrawn_is_missed(
    registry: Registry, folder: Path, tmp_path: Path
) -> None:
    both = tmp_path / "both"
    shutil.copytree(folder, both / "tidy")
    shutil.copytree(folder, both / "needy")
    manifest = both / "needy" / "ecm.yaml"
    text = manifest.read_text().replace("id: tidy\n", "id: needy\n").replace("tidying", "needing")
    text = text.replace("words: [clean, wipe]", "words: [need]")
    manifest.write_text(text.replace("dependencies:\n", 'dependencies:\n  modules: {tidy: ">=1"}\n'))
    assert main(["verify", str(both), "--site", str(BASE / "site.yaml")]) == 0
    snapshot = registry.snapshot()
    loaded = FolderModules([both], None, registry).load(snapshot)
    assert loaded.configuration.modules.keys() == {"needy", "tidy"}
    withdrawn = RegistrySnapshot(
        snapshot.generation, snapshot.site, is_policy_set=True, withdrawn=frozenset({"tidy"})
    )
    with pytest.raises(UserError, match="AE964"):
        FolderModules([both], None, registry).load(withdrawn)


def test_the_folder_ecms_is_used_until_a_module_is_installed(
    tmp_path: Path, write: Author, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    registry = Registry(tmp_path / "fresh")
    assert not uses_installed_modules(registry)
    registry.set_policy(BASE / "site.yaml")
    assert uses_installed_modules(registry)
    (tmp_path / "ecms").mkdir()
    assert not uses_installed_modules(registry)
    registry.install(write())
    assert uses_installed_modules(registry)
    registry.remove("tidy")
    assert uses_installed_modules(registry)


def test_without_a_folder_ecms_the_modules_that_come_with_aeros_are_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert default_modules() == (ROOT / "ecms",)
    monkeypatch.setattr(folder_modules, "reference_modules_path", lambda: tmp_path / "absent")
    assert default_modules() == (Path("ecms"),)
    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ecms").mkdir()
    assert default_modules() == (Path("ecms"),)


def test_settings_of_an_absent_module_are_refused_without_a_proof(registry: Registry, folder: Path) -> None:
    settings = {"tidi": ModuleConfiguration({"surface": "bench"})}
    modules = FolderModules([folder], None, registry, configurations=settings)
    for load in (modules.load, modules.load_unproved):
        with pytest.raises(UserError, match="settings are given for `tidi`") as refused:
            load(registry.snapshot())
        assert [one.code for one in refused.value.diagnostics] == ["AE886"]


def test_a_run_finds_a_required_module_next_to_its_folder(tmp_path: Path) -> None:
    shutil.copytree(CORPUS / "accepted" / "steps_of_a_required_module", tmp_path / "all")
    asker, helper = tmp_path / "all" / "asker", tmp_path / "all" / "helper"
    registry, site = Registry(tmp_path / "robot"), CORPUS / "site" / "table.yaml"
    modules = FolderModules([asker], site, registry, needs_certificates=False)
    assert modules.load(registry.snapshot()).configuration.modules.keys() == {"asker", "helper"}
    assert modules.load_unproved(registry.snapshot())[1].keys() == {"asker", "helper"}
    with pytest.raises(UserError, match="AE901") as refused:
        FolderModules([asker], site, registry).load(registry.snapshot())
    assert f"`aeros verify {asker} --site {site}`" in refused.value.diagnostics[0].help[-1]
    shutil.move(helper, tmp_path / "elsewhere")
    helper.symlink_to(tmp_path / "elsewhere", target_is_directory=True)
    linked = FolderModules([asker], site, registry, needs_certificates=False)
    assert linked.load(registry.snapshot()).configuration.modules.keys() == {"asker", "helper"}
    helper.unlink()
    alone = FolderModules([asker], site, registry, needs_certificates=False)
    with pytest.raises(UserError, match="AE301") as missing:
        alone.load(registry.snapshot())
    assert "put the folder of `helper` next to that of `asker`" in missing.value.diagnostics[0].help[0]
    both = FolderModules([asker, tmp_path / "elsewhere"], site, registry, needs_certificates=False)
    assert both.load(registry.snapshot()).configuration.modules.keys() == {"asker", "helper"}
    assert both.load_unproved(registry.snapshot())[1].keys() == {"asker", "helper"}


def test_a_folder_without_modules_is_refused(registry: Registry, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="AE130"):
        FolderModules([tmp_path / "robot"], None, registry).load(registry.snapshot())


def test_an_overlay_governs_a_run_without_a_registry_and_with_one_where_it_is_in_force(
    registry: Registry, folder: Path, tmp_path: Path
) -> None:
    cell = tmp_path / "cell.yaml"
    cell.write_text(
        f"schema: aeros/overlay/1\nbase: {BASE / 'site.yaml'}\ngrants: {{tidy: {{sensors: [camera]}}}}\n"
    )
    assert main(["verify", str(folder), "--site", str(cell)]) == 0
    with pytest.raises(UserError, match="is not the policy that is in force"):
        FolderModules([folder], cell, registry).load(registry.snapshot())
    alone = FolderModules([folder], cell, registry).load(RegistrySnapshot())
    registry.set_policy(cell)
    loaded = FolderModules([folder], cell, registry).load(registry.snapshot())
    assert loaded.policy == registry.snapshot().site == alone.policy
    assert loaded.configuration.digest == alone.configuration.digest
    assert FolderModules([folder], None, registry).load(registry.snapshot()).policy == loaded.policy
