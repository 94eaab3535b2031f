"""The installation: extras by what is really there, layers by trying them."""

from __future__ import annotations

import tomllib
from importlib import metadata

import pytest

from aeros.apps.installation import (
    EXTRAS,
    InstalledPart,
    PartState,
    examine_installation,
)
from aeros.distribution import NAME, install_command
from tests.repo.tree import ROOT

FOR_DEVELOPERS = {"benchmark", "dev", "mutation", "test"}


def parts() -> dict[str, InstalledPart]:
    """The parts of this installation by name."""
    return {one.name: one for one in examine_installation({})}


def test_each_extra_for_users_is_known_and_each_part_that_does_not_work_has_a_cure() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert set(EXTRAS) == set(project["optional-dependencies"]) - FOR_DEVELOPERS
    assert project["name"] == NAME
    found = parts()
    usable = (PartState.WORKS, PartState.INSTALLED)
    assert all(bool(one.cure) is (one.state not in usable) for one in found.values())
    assert found["cvc5"].state is PartState.INSTALLED
    assert found["display"].state is PartState.MISSING
    assert f"z3-solver {metadata.version('z3-solver')}" in found["core"].found
    assert any(name.startswith("isolation") for name in found)


def test_a_missing_distribution_or_another_version_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    real = metadata.version

    def version(name: str) -> str:
        if name == "cvc5":
            raise metadata.PackageNotFoundError(name)
        return "1.0" if name == "z3-solver" else real(name)

    monkeypatch.setattr(metadata, "version", version)
    found = parts()
    assert found["cvc5"] == InstalledPart(
        "cvc5", PartState.MISSING, "lacks cvc5", EXTRAS["cvc5"], install_command("cvc5")
    )
    assert found["core"].state is PartState.BROKEN
    assert found["core"].found == "lacks z3-solver 1.0 (==5.4.0.0 is needed)"
