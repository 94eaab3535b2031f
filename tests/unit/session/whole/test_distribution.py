"""One distribution of a third party brings a plant, a robot, a scene and a module, by its wheel alone."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from aeros.sim.robot.robot_file import known_robots
from tests.repo.tree import ROOT
from tests.unit.runtime.registry.conftest import BASE

_KIT = Path(__file__).parent / "kitchen_kit"
_PLANT = ROOT / "tests" / "unit" / "session" / "borrowed_plant" / "borrowed_plant.py"

_SHELF = """\
schema: aeros/scene/2
description: a robot before a shelf
robot: {mount: bench}
view: {eye: [1.5 m, 1 m, 1 m], target: [40 cm, 0 m, 20 cm]}
bodies:
  shelf: {box: [20 cm, 60 cm, 2 cm], at: [75 cm, 0 m, 30 cm]}
"""


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Interpreter of an environment of its own, into which pip has installed the wheel.

    AEROS and what it requires come from this environment, as a wheel of the checkout would need them anew.
    """
    folder = tmp_path_factory.mktemp("kit")
    source = folder / "source"
    package = source / "kitchen_kit"
    package.mkdir(parents=True)
    shutil.copy(_KIT / "pyproject.toml", source)
    manifest = Path(shutil.copytree(BASE / "tidy", package / "tidy")) / "ecm.yaml"
    text = manifest.read_text(encoding="utf-8")
    rules = text[text.index("      - {unless: cloth_held") : text.index("    initial:")]
    text = text.replace(rules, "      - {unless: bench_clean, do: rest}\n")
    manifest.write_text(
        text.replace("rested: {}", "rested: {effects: {bench_clean: true}}"), encoding="utf-8"
    )
    shutil.copy(_PLANT, package / "plant.py")
    (package / "shelf.yaml").write_text(_SHELF, encoding="utf-8")
    robot = known_robots()["panda"]
    (package / "arm.yaml").write_text(
        robot.read_text(encoding="utf-8").replace("id: panda", "id: kit_arm"), encoding="utf-8"
    )
    shutil.copy(robot.with_name("panda_hulls.json"), package)
    (package / "__init__.py").write_text(
        "from pathlib import Path\n\n"
        'ROBOT = Path(__file__).with_name("arm.yaml")\nSCENE = Path(__file__).with_name("shelf.yaml")\n'
    )
    pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]
    build = [*pip, "wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", str(folder), str(source)]
    subprocess.run(build, check=True, timeout=120)
    (wheel,) = folder.glob("*.whl")
    subprocess.run([sys.executable, "-m", "venv", folder / "venv"], check=True, timeout=120)
    python = folder / "venv" / "bin" / "python"
    install = [str(python), "-m", "pip", "--quiet", "install", "--no-deps", "--no-index", str(wheel)]
    subprocess.run(install, check=True, timeout=120)
    (site,) = (folder / "venv" / "lib").glob("python*/site-packages")
    (site / "aeros.pth").write_text(f"{ROOT}\n{sysconfig.get_path('purelib')}\n")
    return python


def _aeros(python: Path, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [python, "-m", "aeros", *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


@pytest.mark.deep
def test_a_run_uses_its_module_on_its_plant(environment: Path, tmp_path: Path) -> None:
    shutil.copy(BASE / "site.yaml", tmp_path)
    policy = _aeros(environment, tmp_path, "policy", "site.yaml")
    assert policy.returncode == 0, policy.stderr
    installed = _aeros(environment, tmp_path, "install", "tidy")
    assert installed.returncode == 0, installed.stderr
    for step in ("configure", "activate"):
        assert _aeros(environment, tmp_path, step, "tidy").returncode == 0
    ran = _aeros(
        environment, tmp_path, "run", "clean it", "--plant", "kit_bench", "--out", "out", "--unsigned"
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "measured   bench_clean = true (kit_bench plant)" in ran.stdout


@pytest.mark.deep
def test_its_robot_moves_in_its_scene(environment: Path) -> None:
    answer = subprocess.run(
        [environment, _KIT / "use.py"], capture_output=True, text=True, timeout=120, check=True
    )
    found = json.loads(answer.stdout)
    assert found["robot"] == "kit_arm"
    assert found["bodies"] == ["shelf"]
    assert found["completed"] == [True]
    assert found["reached"] == pytest.approx([0.5, 0.1, 0.4], abs=2e-3)
