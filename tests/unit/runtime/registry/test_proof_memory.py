"""A remembered proof counts only while everything that it depends on is as it was."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import pytest

from aeros.runtime.proving import prove_configuration
from aeros.runtime.registry import installed
from aeros.runtime.registry.bundle_store import bundle_digest, module_files
from aeros.runtime.registry.proof_memory import ModuleSet, ProofMemory
from aeros.runtime.registry.registry import Registry
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.configured import ModuleConfiguration
from aeros.spec.model.operator_settings import NO_SETTINGS, OperatorSettings
from tests.unit.runtime.registry.conftest import BASE, Author


class _CountingProver:
    """Proves as `prove_configuration` does; counts, and first does `before` with the folders."""

    def __init__(self, before: Callable[[list[Path]], None] = lambda _: None) -> None:
        self.calls = 0
        self._before = before

    def __call__(self, paths: list[Path], site: Path, **options: Any) -> Any:
        self.calls += 1
        self._before(paths)
        return prove_configuration(paths, site, **options)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return Path(shutil.copytree(BASE / "tidy", tmp_path / "modules" / "tidy"))


@pytest.fixture
def site(tmp_path: Path) -> Path:
    return Path(shutil.copy(BASE / "site.yaml", tmp_path / "site.yaml"))


def _set(
    folder: Path, site: Path, *, active: bool = True, settings: OperatorSettings = NO_SETTINGS
) -> ModuleSet:
    digest = bundle_digest(module_files(folder))
    return ModuleSet({folder: digest}, site, settings, [folder] if active else [])


def _memory(prover: _CountingProver) -> ProofMemory:
    return ProofMemory(cast(Any, prover))


def test_the_same_modules_are_proved_once(folder: Path, site: Path) -> None:
    memory = _memory(prover := _CountingProver())
    first = memory.prove(_set(folder, site))
    again = memory.prove(_set(folder, site))
    assert again == first
    assert prover.calls == 1
    assert [*first[0].modules] == ["tidy"]


def _change_manifest(folder: Path, site: Path) -> ModuleSet:
    manifest = folder / "ecm.yaml"
    manifest.write_text(manifest.read_text() + "# more\n")
    return _set(folder, site)


def _add_hidden_code(folder: Path, site: Path) -> ModuleSet:
    (folder / ".hidden").mkdir()
    (folder / ".hidden" / "more.py").write_text("x = 1\n")
    return _set(folder, site)


def _change_site(folder: Path, site: Path) -> ModuleSet:
    site.write_text(site.read_text() + "# more\n")
    return _set(folder, site)


def _deactivate(folder: Path, site: Path) -> ModuleSet:
    return _set(folder, site, active=False)


def _configure(folder: Path, site: Path) -> ModuleSet:
    settings = OperatorSettings((), {"another": ModuleConfiguration({"need": "thing"}, {})})
    return _set(folder, site, settings=settings)


@pytest.mark.parametrize(
    "change", [_change_manifest, _add_hidden_code, _change_site, _deactivate, _configure]
)
def test_modules_are_proved_again_when_anything_changed(
    folder: Path, site: Path, change: Callable[[Path, Path], ModuleSet]
) -> None:
    memory = _memory(prover := _CountingProver())
    memory.prove(_set(folder, site))
    try:
        memory.prove(change(folder, site))
    except UserError:
        assert change is _configure  # there is no such module
    assert prover.calls == 2


def test_a_refusal_is_not_remembered(folder: Path, site: Path) -> None:
    memory = _memory(prover := _CountingProver())
    manifest = folder / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace("speed <= 250 mm/s", "speed <= 900 mm/s", 1))
    for _ in range(2):
        with pytest.raises(UserError):
            memory.prove(_set(folder, site))
    assert prover.calls == 2


def _add_code(folder: Path) -> None:
    (folder / "more.py").write_text("x = 1\n")


def _alter_manifest(folder: Path) -> None:
    manifest = folder / "ecm.yaml"
    manifest.write_text(manifest.read_text() + "# altered\n")


@pytest.mark.parametrize("alter", [_add_code, _alter_manifest])
def test_files_that_change_while_they_are_proved_are_not_remembered(
    folder: Path, site: Path, tmp_path: Path, alter: Callable[[Path], None]
) -> None:
    shutil.copytree(folder, tmp_path / "kept")
    memory = _memory(prover := _CountingProver(lambda paths: alter(paths[0])))
    modules = _set(folder, site)
    memory.prove(modules)
    shutil.rmtree(folder)
    shutil.copytree(tmp_path / "kept", folder)
    memory.prove(modules)
    assert prover.calls == 2


def test_files_that_changed_since_their_bundle_was_read_are_not_remembered_as_it(
    folder: Path, site: Path, tmp_path: Path
) -> None:
    shutil.copytree(folder, tmp_path / "kept")
    memory = _memory(prover := _CountingProver())
    modules = _set(folder, site)
    _alter_manifest(folder)
    memory.prove(modules)
    shutil.rmtree(folder)
    shutil.copytree(tmp_path / "kept", folder)
    memory.prove(modules)
    assert prover.calls == 2


def test_a_swap_back_is_not_proved_again_and_altered_files_are_refused(
    registry: Registry, write: Author, monkeypatch: pytest.MonkeyPatch
) -> None:
    prover = _CountingProver()
    monkeypatch.setattr(installed, "prove_configuration", prover)
    registry = Registry(registry.folder.parent)

    def swap() -> None:
        registry.install(source)
        registry.configure("tidy")
        registry.activate("tidy")
        registry.deactivate("tidy")
        registry.remove("tidy")

    source = write()
    swap()
    calls = prover.calls
    swap()
    assert prover.calls == calls
    registry.install(source)
    (stored,) = (registry.folder / "modules").glob("*/tidy/ecm.yaml")
    stored.write_text(stored.read_text() + "# altered\n")
    with pytest.raises(UserError, match="AE965"):
        registry.configure("tidy")
