"""The modules that a proof depends on are found by what their manifests name, at any depth."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.spec.text.discovery import MANIFEST, NEIGHBOURS, Surroundings
from aeros.spec.text.files import read_source
from aeros.spec.verification.required_modules import RequiredModules
from tests.repo.tree import ROOT


def _write(folder: Path, name: str, provides: str, dependencies: str = "") -> Path:
    """Write a module whose one skill waits."""
    case = (ROOT / "tests/corpus/accepted/waits_less_than_allowed/ecm.yaml").read_text(encoding="utf-8")
    case = case.replace("id: waits_less_than_allowed", f"id: {name}").replace("  tidying:", f"  {provides}:")
    module = folder / name.strip('"').replace("\\", "_")
    module.mkdir()
    (module / MANIFEST).write_text(f"{case.rstrip()}\n{dependencies}", encoding="utf-8")
    (module / "skills.py").write_text("", encoding="utf-8")
    return module


@pytest.fixture
def asker(tmp_path: Path) -> Path:
    """A module that requires a capability; whoever provides it requires a module, which requires another."""
    _write(tmp_path, "far", "sweeping", "  modules: {farther: '*'}\n")
    _write(tmp_path, "farther", "dusting")
    _write(tmp_path, "near", "polishing", "  modules: {far: '*'}\n")
    _write(tmp_path, "other", "cooking", "  modules: {other_still: '*'}\n")
    return _write(tmp_path, "asker", "tidying", "  capabilities: {polishing: '*'}\n")


def _names(asker: Path, surroundings: Surroundings = NEIGHBOURS) -> frozenset[str] | None:
    return RequiredModules(surroundings).names(asker, read_source(asker / MANIFEST))


def _digest(asker: Path) -> str | None:
    return RequiredModules(NEIGHBOURS).digest(asker, _names(asker) or ())


def test_requirements_of_a_provider_are_required_too(asker: Path) -> None:
    assert _names(asker) == frozenset({"polishing", "far", "farther"})


def test_only_the_given_modules_provide_where_they_are_given(asker: Path) -> None:
    given = Surroundings((asker, asker.parent / "far"))
    assert _names(asker, given) == frozenset({"polishing"})


def test_two_modules_that_require_each_other_end_the_search(tmp_path: Path) -> None:
    _write(tmp_path, "one", "cooking", "  modules: {two: '*'}\n")
    two = _write(tmp_path, "two", "sweeping", "  modules: {one: '*'}\n")
    assert _names(two) == frozenset({"one", "two"})


@pytest.mark.parametrize("changed", ["near", "far", "farther"])
def test_a_change_at_any_depth_changes_the_digest(changed: str, asker: Path) -> None:
    before = _digest(asker)
    (asker.parent / changed / "skills.py").write_text("CHANGED = True\n", encoding="utf-8")
    assert None not in {before, _digest(asker)}
    assert _digest(asker) != before


def test_a_change_of_a_module_that_is_not_required_leaves_the_digest(asker: Path) -> None:
    before = _digest(asker)
    (asker.parent / "other" / "skills.py").write_text("CHANGED = True\n", encoding="utf-8")
    assert _digest(asker) == before is not None


def test_a_name_that_is_spelt_with_an_escape_is_found(asker: Path) -> None:
    before = _digest(asker)
    _write(asker.parent, '"fa\\x72"', "cleaning")
    assert _digest(asker) not in {before, None}


def test_a_module_that_cannot_be_read_has_no_digest(asker: Path) -> None:
    (asker.parent / "far" / MANIFEST).write_bytes(b"\xff")
    assert _names(asker) is None
    assert _digest(asker) is None
