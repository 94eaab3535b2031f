"""The cell of several tasks: each scene file once, under the id of its module."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.spec.diagnostics.errors import UserError
from aeros.spec.scenes.cells import load_cell

WHOLE = """schema: aeros/scene/2
description: A bed.
robot: {mount: bench}
view: {eye: [1 m, 0 m, 1 m], target: [0 m, 0 m, 0 m]}
bodies: {bed: {sphere: 2 cm, at: [0 m, PLACE m, 1 m]}}
"""


@pytest.fixture
def folders(tmp_path: Path) -> dict[str, list[Path]]:
    """Two modules with a scene of one name, and the first with another one."""
    for number, (module, name) in enumerate((("garden", "bed"), ("garden", "patch"), ("yard", "bed"))):
        (scenes := tmp_path / module / "scenes").mkdir(parents=True, exist_ok=True)
        (scenes / f"{name}.yaml").write_text(WHOLE.replace("PLACE", str(number)))
    garden, yard = tmp_path / "garden", tmp_path / "yard"
    return {"garden": [garden, yard], "yard": [yard, garden]}


def test_a_scene_is_looked_for_in_its_own_module_first(folders: dict[str, list[Path]]) -> None:
    whole = load_cell([("garden", "bed"), ("yard", "bed")], folders)
    assert [(name, one.placement.position[1]) for name, one in whole.bodies.items()] == [
        ("garden_bed", 0.0),
        ("yard_bed", 2.0),
    ]


def test_two_scenes_of_one_module_have_two_labels_and_a_file_counts_once(
    folders: dict[str, list[Path]],
) -> None:
    twice = [("garden", "bed"), ("yard", "patch"), ("garden", "patch"), ("garden", "bed")]
    assert list(load_cell(twice[:1] + twice[3:], folders).bodies) == ["bed"]
    assert list(load_cell(twice, folders).bodies) == ["garden_bed", "yard_bed"]
    own = [("garden", "bed"), ("garden", "patch")]
    assert list(load_cell(own, folders).bodies) == ["garden_bed", "garden_patch_bed"]


def test_a_scene_that_is_not_there_is_refused(folders: dict[str, list[Path]]) -> None:
    with pytest.raises(UserError, match="no file `cellar`"):
        load_cell([("garden", "cellar")], folders)
