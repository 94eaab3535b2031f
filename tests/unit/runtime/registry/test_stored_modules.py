"""Content of a registry is read without a proof: capabilities, settings, and identities for blocks."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest
import yaml

from aeros.runtime.registry.operator_block import ModuleIdentity, OperatorBlock
from aeros.runtime.registry.registry import Registry
from aeros.runtime.registry.stored_modules import StoredModules, read_policy
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.policy import OperatorOverride
from tests.unit.runtime.registry.conftest import Author


def test_a_database_that_is_none_is_refused(registry: Registry) -> None:
    (registry.folder / "registry.sqlite3").write_bytes(
        b"not a database at all, but long enough to be one" * 40
    )
    with pytest.raises(UserError, match="AE965"):
        registry.snapshot()


def test_a_policy_is_read_from_a_regular_file_alone(tmp_path: Path) -> None:
    (tmp_path / "site.yaml").write_bytes(b"schema: aeros/site/1\n")
    assert read_policy(tmp_path / "site.yaml") == b"schema: aeros/site/1\n"
    os.mkfifo(tmp_path / "pipe")  # which would be waited for
    for path, why in (("pipe", "it is not a regular file"), ("none", "No such file"), ("", "regular file")):
        with pytest.raises(UserError, match=why):
            read_policy(tmp_path / path)


def test_capabilities_say_who_can_do_what(registry: Registry, write: Author) -> None:
    registry.install(write())
    assert registry.capabilities(registry.snapshot()) == {"tidy": ("tidying",)}


def test_the_identity_of_a_lost_module_has_unknown_devices(registry: Registry, write: Author) -> None:
    one = registry.install(write())
    registry.add_block(OperatorBlock("hot", "too hot", "tidy", None, None))
    stored = StoredModules(registry.folder.parent)
    snapshot = stored.snapshot()
    assert stored.identities(snapshot) == {"tidy": ModuleIdentity("1.0.0", one.digest, frozenset())}
    assert stored.blocks(snapshot) == (OperatorOverride("hot", "too hot", "tidy", None, None),)
    shutil.rmtree(registry.folder / one.folder)
    assert stored.identities(snapshot)["tidy"].devices is None


def test_skills_are_listed_in_order_and_a_module_that_is_not_there_has_none(
    registry: Registry, write: Author
) -> None:
    source = write()
    registry.install(source)
    stored = StoredModules(registry.folder.parent)
    declared = yaml.safe_load((source / "ecm.yaml").read_text("utf-8"))["skills"]
    assert stored.skills("tidy") == tuple(sorted(declared))
    assert stored.skills("untidy") == ()
