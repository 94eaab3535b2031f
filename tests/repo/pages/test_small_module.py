"""The module on docs/small-module.md has 60 lines, is proved, and runs without and with physics."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.sim.physics import PhysicsPlant
from aeros.sim.scenes.physics_scene import PhysicsScene
from aeros.spec.model.scene import BodyPart
from tests.repo.tree import ROOT

PAGE = (ROOT / "docs" / "small-module.md").read_text(encoding="utf-8")
INSTRUCTION = "push the sponge to the left edge"
EDGE = -0.77
"""The sponge's middle at the left edge of the table, along y, m."""


@pytest.fixture
def modules(tmp_path: Path) -> Path:
    """The page's module beside `clean_table`, proved."""
    folder = tmp_path / "modules"
    shutil.copytree(ROOT / "ecms" / "clean_table", folder / "clean_table")
    files = dict(re.findall(r"^```(yaml|python)\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL))
    (folder / "push_sponge").mkdir()
    (folder / "push_sponge" / "ecm.yaml").write_text(files["yaml"], encoding="utf-8")
    (folder / "push_sponge" / "skills.py").write_text(files["python"], encoding="utf-8")
    assert sum(len(text.splitlines()) for text in files.values()) <= 60
    assert main(["verify", str(folder)]) == Exit.SUCCESS
    return folder


def run(modules: Path, *options: str) -> int:
    where = ["--out", str(modules.parent / "out"), "--state", str(modules.parent / "state")]
    return main(["run", INSTRUCTION, "--ecms", str(modules), "--seed", "7602", *options, *where])


def test_the_module_runs_on_the_symbolic_plant(modules: Path) -> None:
    assert run(modules, "--plant", "symbolic") == Exit.SUCCESS


@pytest.mark.physics
@pytest.mark.deep
def test_the_sponge_is_at_the_edge_in_truth(modules: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    places: list[float] = []
    truth = PhysicsPlant.truth

    def watched(plant: PhysicsPlant) -> object:
        assert isinstance(plant._scene, PhysicsScene)
        places.append(plant._scene.pose_of(BodyPart("sponge")).position[1])
        return truth(plant)

    monkeypatch.setattr(PhysicsPlant, "truth", watched)
    assert run(modules, "--no-film") == Exit.SUCCESS
    assert places[-1] >= EDGE
