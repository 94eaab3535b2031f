"""`prove_configuration` uses exactly the files that were proved, now or in an earlier run."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from aeros.experiments.trials.synthetic import write_modules
from aeros.runtime import proving
from aeros.runtime.proving import prove_configuration
from aeros.runtime.registry.registry import Registry
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.operator_settings import OperatorSettings
from aeros.spec.model.policy import OperatorOverride
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.verification.verify import verify
from tests.unit.spec.examining import note_examined


@pytest.fixture
def examined(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Record the names of the folders that are proved, with a proof cache of the test's own."""
    monkeypatch.setenv("AEROS_CACHE", str(tmp_path / "cache"))
    return note_examined(monkeypatch)


def _append(path: Path) -> None:
    path.write_text(path.read_text(encoding="utf-8") + "\n# changed\n", encoding="utf-8")


@pytest.mark.parametrize(
    "changed",
    [lambda module, _: module / "ecm.yaml", lambda module, _: module / "skills.py", lambda _, site: site],
)
def test_files_that_change_while_being_proved_are_refused(
    changed: Callable[[Path, Path], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (module,) = write_modules(tmp_path / "modules", 1)
    site = Path(shutil.copy(reference_site_path(), tmp_path / "site.yaml"))

    def edited_then(*args: Any, **options: Any) -> Any:
        report = verify(*args, **options)
        _append(changed(module, site))
        return report

    monkeypatch.setattr(proving, "verify", edited_then)
    with pytest.raises(UserError) as refused:
        prove_configuration([module], site, certified=False)
    (diagnostic,) = refused.value.diagnostics
    assert diagnostic.code == "AE961"
    assert "changed while it was being proved" in diagnostic.headline


def test_earlier_proofs_give_the_same_configuration(examined: list[str], tmp_path: Path) -> None:
    modules = write_modules(tmp_path / "modules", 2)
    settings = OperatorSettings(
        (OperatorOverride("no_welder", "it is being repaired", "welder", None, None),)
    )
    cold, _ = prove_configuration(modules, reference_site_path(), certified=False, settings=settings)
    assert examined == ["module_0000", "module_0001"]
    warm, _ = prove_configuration(modules, reference_site_path(), certified=False, settings=settings)
    assert examined == ["module_0000", "module_0001"]
    assert warm.digest == cold.digest
    assert warm.certificates == cold.certificates
    assert warm.site.blocks == cold.site.blocks
    bare, _ = prove_configuration(modules, reference_site_path(), certified=False)
    assert bare.digest != cold.digest


def test_a_registry_proves_only_new_modules(examined: list[str], tmp_path: Path) -> None:
    registry = Registry(tmp_path / "state")
    first, second = write_modules(tmp_path / "modules", 2)
    registry.install(first)
    registry.configure(first.name)
    registry.activate(first.name)
    assert examined == [first.name]
    registry.install(second)
    assert examined == [first.name, second.name]
    assert set(registry.configuration()[0].modules) == {first.name}
    assert examined == [first.name, second.name]
