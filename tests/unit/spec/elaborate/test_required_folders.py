"""The modules next to others that these require, by name or by capability."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from aeros.spec.elaborate.required_folders import with_required_folders

ACCEPTED = Path(__file__).parents[3] / "corpus" / "accepted"


@pytest.fixture
def asker(tmp_path: Path) -> Path:
    """A module that requires `helper`, which lies next to it, as does a module that it does not require."""
    shutil.copytree(ACCEPTED / "steps_of_a_required_module", tmp_path / "all")
    shutil.copytree(ACCEPTED / "always_slow", tmp_path / "all" / "always_slow")
    return tmp_path / "all" / "asker"


def test_a_required_module_is_found_next_to_the_one_that_requires_it(asker: Path) -> None:
    assert with_required_folders([asker]) == [asker, asker.parent / "helper"]


def test_a_link_to_a_folder_counts_as_the_folder(asker: Path, tmp_path: Path) -> None:
    shutil.move(asker.parent / "helper", tmp_path / "elsewhere")
    (asker.parent / "helper").symlink_to(tmp_path / "elsewhere", target_is_directory=True)
    assert with_required_folders([asker]) == [asker, asker.parent / "helper"]
    assert with_required_folders([asker, tmp_path / "elsewhere"]) == [asker, tmp_path / "elsewhere"]


def test_modules_are_found_at_any_depth(asker: Path) -> None:
    manifest = asker.parent / "helper" / "ecm.yaml"
    required = 'dependencies:\n  modules: {always_slow: ">=1"}\n'
    manifest.write_text(manifest.read_text().replace("dependencies:\n", required))
    assert with_required_folders([asker]) == [
        asker,
        asker.parent / "helper",
        asker.parent / "always_slow",
    ]


def test_every_module_provides_a_capability_that_no_given_one_provides() -> None:
    two = ACCEPTED / "capability_that_two_modules_provide"
    assert with_required_folders([two / "asker"]) == [two / "asker", two / "one", two / "two"]
    assert with_required_folders([two / "two", two / "asker"]) == [two / "two", two / "asker"]


def test_a_module_that_requires_none_is_alone(asker: Path) -> None:
    assert with_required_folders([asker.parent / "helper"]) == [asker.parent / "helper"]


def test_a_manifest_with_a_fault_adds_none(asker: Path) -> None:
    (asker.parent / "helper" / "ecm.yaml").write_text("id: [")
    assert with_required_folders([asker]) == [asker]
    (asker / "ecm.yaml").write_text("id: [")
    assert with_required_folders([asker]) == [asker]
