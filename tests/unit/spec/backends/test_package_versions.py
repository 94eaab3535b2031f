"""Versions are those of the distribution whose package would be imported."""

from __future__ import annotations

import importlib.metadata
from pathlib import Path

import pytest

from aeros.spec.backends.package_versions import package_version, z3_version


def _install(folder: Path, package: str, *versions: str) -> None:
    (folder / package).mkdir()
    (folder / package / "__init__.py").write_text("raise RuntimeError('nobody imports it')")
    for version in versions:
        (folder / f"Made_Up-{version}.dist-info").mkdir()
        text = f"Metadata-Version: 2.1\nName: made-up\nVersion: {version}\n"
        (folder / f"Made_Up-{version}.dist-info" / "METADATA").write_text(text)


def test_the_version_is_in_the_name_of_the_folder_next_to_the_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _install(tmp_path, "made_up_once", "1.2.3")
    (tmp_path / "made_up-9.9.egg-info").mkdir()
    (tmp_path / "made_upper-9.9.dist-info").mkdir()
    monkeypatch.syspath_prepend(tmp_path)
    # The metadata says so too, but it is not read.
    (tmp_path / "Made_Up-1.2.3.dist-info" / "METADATA").unlink()
    assert package_version("Made-Up", "made_up_once") == "1.2.3"


def test_of_several_folders_the_metadata_decides(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _install(tmp_path, "made_up_twice", "4.5.6")
    (tmp_path / "made_up-0.0.1.dist-info").mkdir()
    (tmp_path / "made_up-0.0.1.dist-info" / "METADATA").write_text(
        "Metadata-Version: 2.1\nName: other\nVersion: 4.5.6\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    assert package_version("made-up", "made_up_twice") == "4.5.6"


def test_a_package_that_is_not_installed_has_no_version() -> None:
    with pytest.raises(importlib.metadata.PackageNotFoundError):
        package_version("made-up", "made_up_nowhere")


def test_the_version_of_z3_is_that_of_its_distribution_and_is_read_without_the_metadata(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    expected = importlib.metadata.version("z3-solver")
    monkeypatch.setattr(importlib.metadata, "version", lambda name: pytest.fail(f"the metadata of {name}"))
    package_version.cache_clear()
    assert z3_version() == expected
