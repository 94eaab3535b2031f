"""A look is parts that films show; each fault of it is reported at its place."""

from __future__ import annotations

from math import radians
from pathlib import Path

import pytest

from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.scene import LookPart
from aeros.spec.scenes.load import load_scene
from tests.shipped_scenes import shipped_scene

SCENE = """\
schema: aeros/scene/2
description: a mug
robot: {{mount: bench}}
view: {{eye: [1 m, 1 m, 1 m], target: [0 m, 0 m, 0 m]}}
looks:
  mug: {{parts: [{part}]}}
bodies:
  cup: {{cylinder: [4 cm, 9 cm], at: [50 cm, 0 m, 45 mm], look: {look}}}
"""


def scene_with(folder: Path, part: str, look: str = "mug") -> tuple[LookPart, ...]:
    path = folder / "mug.yaml"
    path.write_text(SCENE.format(part=part, look=look))
    return load_scene(str(path)).bodies["cup"].look


def test_a_look_has_the_parts_of_its_declaration(tmp_path: Path) -> None:
    part = "{capsule: [5 mm, 3 cm], at: [5 cm, 0 m, 0 m], tilt: [90 deg, 0 deg, 0 deg], opacity: 0.5}"
    (handle,) = scene_with(tmp_path, part)
    assert (handle.kind, handle.size, handle.opacity) == ("capsule", (0.005, 0.03, 0.0), 0.5)
    assert handle.position == (0.05, 0.0, 0.0)
    assert handle.tilt == pytest.approx((radians(90), 0.0, 0.0))
    assert (handle.link, handle.joint) == (None, None)


def test_a_shipped_look_changes_with_a_joint() -> None:
    wrapper = shipped_scene("dumpling_bench").bodies["wrapper"]
    assert {part.link for part in wrapper.look} == {None, "plate_a", "plate_b"}
    assert {part.joint for part in wrapper.look} == {"fold"}
    opened, folded = sorted({part.range for part in wrapper.look})
    assert opened[1] == folded[0] == pytest.approx(radians(150))


@pytest.mark.parametrize(
    ("part", "look", "fault"),
    [
        ("{sphere: 1 cm}", "mag", "there is no look `mag` for this body"),
        ("{at: [0 m, 0 m, 0 m]}", "mug", "a part of a look has exactly one shape"),
        ("{sphere: 1 cm, box: [1 cm, 1 cm, 1 cm]}", "mug", "a part of a look has exactly one shape"),
        ("{sphere: 1 cm, link: lid}", "mug", "there is no link `lid` for this body"),
        ("{sphere: 1 cm, joint: hinge}", "mug", "`joint` needs a `range`"),
        ("{sphere: 1 cm, joint: hinge, range: [0 deg, 1 deg]}", "mug", "there is no movable joint `hinge`"),
        ("{sphere: 0.1 mm}", "mug", "is outside its bounds"),
    ],
)
def test_a_fault_is_reported(part: str, look: str, fault: str, tmp_path: Path) -> None:
    with pytest.raises(UserError) as refused:
        scene_with(tmp_path, part, look)
    assert fault in str(refused.value)
