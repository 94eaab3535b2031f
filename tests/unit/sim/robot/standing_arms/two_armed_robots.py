"""A Panda with a second one that stands beside it on the same base, and a site for both."""

from __future__ import annotations

import re
import shutil
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import aeros
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.robot_file import read_robot
from tests.repo.tree import ROOT

SHIPPED: Final = Path(aeros.__file__).parent
PAGE: Final = ROOT / "docs" / "how-to" / "bring-your-robot.md"
SECTION: Final = PAGE.read_text(encoding="utf-8").split("```yaml\nstanding_arms:", 1)[1].split("```", 1)[0]
"""The text after `standing_arms:` in the page's example."""


def write_two_arms(folder: Path, section: str | None = None, name: str = "two_pandas") -> Path:
    """Write the Panda's robot file with standing arms, and its hulls beside it.

    Args:
        folder: folder of the files.
        section: section `standing_arms` of the file; that of the page if None.
        name: id of the robot.

    Returns:
        The robot file.
    """
    shutil.copy(SHIPPED / "robots" / "panda_hulls.json", folder)
    text = (SHIPPED / "robots" / "panda.yaml").read_text(encoding="utf-8")
    arms = f"standing_arms:{SECTION}" if section is None else section
    path = folder / f"{name}.yaml"
    path.write_text(text.replace("id: panda\n", f"id: {name}\n") + "\n" + arms, encoding="utf-8")
    return path


def write_two_armed_site(folder: Path) -> Path:
    """Write robot file and site of two arms: the reference site's barriers hold for both.

    Args:
        folder: folder of the files.

    Returns:
        The site file.
    """
    robot = write_two_arms(folder)
    text = (SHIPPED / "sites" / "panda_cell.yaml").read_text(encoding="utf-8")
    text = text.replace("\nrobot: panda\n", f"\nrobot: {robot.name}\n")

    def with_both(found: re.Match[str]) -> str:
        links = [one for one in found[1].split(", ") if one != "held"]
        return f"links: [{found[1]}, {', '.join(f'left_{one}' for one in links)}]"

    path = folder / "two_pandas_cell.yaml"
    path.write_text(re.sub(r"links: \[([^]]*)\]", with_both, text), encoding="utf-8")
    return path


@cache
def two_pandas() -> RobotModel:
    """Read the robot with two arms."""
    with TemporaryDirectory() as folder:
        return read_robot(str(write_two_arms(Path(folder))))
