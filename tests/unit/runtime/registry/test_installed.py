"""A registry's folder is read whole, and edited files are noticed."""

from __future__ import annotations

import pytest

from aeros.runtime.registry.installed import InstalledModules
from aeros.runtime.registry.registry import Registry
from aeros.spec.diagnostics.errors import UserError
from tests.unit.runtime.registry.conftest import Author


def test_a_reader_sees_what_an_operator_installed(registry: Registry, write: Author) -> None:
    registry.install(write())
    reader = InstalledModules(registry.folder.parent)
    assert reader.snapshot() == registry.snapshot()
    assert reader.configuration()[0].digest == registry.configuration()[0].digest
    assert list(reader.inactive_modules()) == ["tidy"]


@pytest.mark.parametrize("name", ["skills.py", "ecm.yaml"])
def test_kept_files_that_were_edited_are_noticed(registry: Registry, write: Author, name: str) -> None:
    registry.install(write())
    (kept,) = registry.folder.rglob(name)
    kept.write_text(kept.read_text() + "\n")
    with pytest.raises(UserError, match="AE965"):
        registry.configuration()
