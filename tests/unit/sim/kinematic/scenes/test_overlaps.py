"""Bodies that overlap are refused without physics, as they are with it."""

from __future__ import annotations

from math import hypot
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.sim.kinematic.plant import make_plant
from aeros.sim.kinematic.scenes.overlaps import check_overlaps
from aeros.sim.layouts.placement import place_things
from aeros.sim.randomness import RandomSource
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.scenes.load import add_scene, load_scene
from tests.shipped_scenes import SHIPPED, shipped_scene

CRATE = "  crate: {box: [10 cm, 10 cm, 10 cm], at: [0 m, 2 m, 5 cm]}\n"

MODEL = """<robot name="it"><link name="a">
<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual>
<collision><origin xyz="0 0 0.1"/><geometry><box size="0.1 0.1 0.1"/></geometry></collision>
</link></robot>"""


def faults(folder: Path, bodies: str) -> tuple[Diagnostic, ...]:
    """Faults of the layout of these bodies."""
    path = folder / "scene.yaml"
    path.write_text(f"schema: aeros/scene/2\ndescription: Things.\nbodies:\n{bodies}")
    scene = load_scene(str(path))
    try:
        check_overlaps(scene, place_things(scene, RandomSource(0)))
    except UserError as error:
        return tuple(error.diagnostics)
    return ()


def depths(folder: Path, bodies: str) -> list[float]:
    """Depth of each overlap, mm, from the message."""
    return [float(one.headline.split()[-2]) for one in faults(folder, bodies)]


@pytest.mark.parametrize(
    ("body", "depth"),
    [
        ("{box: [10 cm, 10 cm, 10 cm], at: [9 cm, 2 m, 5 cm]}", 10.0),
        ("{box: [10 cm, 10 cm, 10 cm], at: [98.5 mm, 2 m, 5 cm]}", None),
        ("{box: [10 cm, 10 cm, 10 cm], at: [97 mm, 2 m, 5 cm]}", 3.0),
        ("{box: [10 cm, 10 cm, 10 cm], at: [11 cm, 2 m, 5 cm], yaw: 45 deg}", 10.7),
        ("{cylinder: [5 cm, 20 cm], at: [9 cm, 2 m, 10 cm], mass: 1 kg}", 10.0),
        ("{cylinder: [5 cm, 20 cm], at: [9 cm, 2.09 m, 10 cm], mass: 1 kg}", None),
        ("{sphere: 5 cm, at: [0 m, 2 m, 14 cm]}", 10.0),
        ("{sphere: 5 cm, at: [84 mm, 2.084 m, 5 cm]}", 1.9),
        ("{sphere: 5 cm, at: [82 mm, 2.082 m, 5 cm]}", 4.7),
        # The crate stands in a basin that is wide enough, and in one that is not.
        ("{basin: [11 cm, 11 cm, 4 cm], at: [0 m, 2 m, 0 m]}", None),
        ("{basin: [9 cm, 11 cm, 4 cm], at: [0 m, 2 m, 0 m]}", 5.0),
        (
            "{compound: [{sphere: 1 cm, at: [0 m, 0 m, 20 cm]},"
            " {box: [2 cm, 2 cm, 2 cm], at: [0 m, 0 m, 0 m]}], at: [5 cm, 2 m, 5 cm], mass: 1 kg}",
            10.0,
        ),
    ],
)
def test_the_depth_is_that_of_the_shortest_way_apart(body: str, depth: float | None, tmp_path: Path) -> None:
    found = depths(tmp_path, f"{CRATE}  other: {body}\n")
    if depth is None or depth <= 2.0:
        assert found == []
    else:
        assert found == [pytest.approx(depth, abs=0.4)]


def test_both_places_are_shown_and_every_pair_is_listed(tmp_path: Path) -> None:
    bodies = f"{CRATE}  one: {{box: [1 cm, 1 cm, 1 cm], at: [0 m, 2 m, 5 cm]}}\n"
    first, second = faults(tmp_path, f"{bodies}  two: {{sphere: 1 cm, at: [5 cm, 2 m, 5 cm]}}\n")
    assert (first.code, first.headline) == ("AE140", "`crate` and `one` overlap by 55.0 mm")
    assert second.headline.startswith("`crate` and `two` overlap by ")
    assert first.primary is not None
    assert (first.primary.span.line, first.secondary[0].span.line) == (4, 5)


@pytest.mark.parametrize(("height", "overlaps"), [("0 m", False), ("-10 cm", True)])
def test_a_model_has_the_shape_that_others_touch(height: str, overlaps: bool, tmp_path: Path) -> None:
    (tmp_path / "it.urdf").write_text(MODEL)
    ball = f"  ball: {{sphere: 3 cm, at: [0 m, 0 m, {height}]}}\n"
    found = faults(tmp_path, f"  it: {{urdf: it.urdf, at: [0 m, 0 m, -10 cm]}}\n{ball}")
    assert bool(found) is not overlaps


@given(x=st.integers(-200, 200), y=st.integers(-200, 200), turn=st.integers(0, 180))
def test_bodies_farther_apart_than_their_radii_never_overlap(
    x: int, y: int, turn: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    other = f"  other: {{box: [6 cm, 4 cm, 10 cm], at: [{x} mm, {2000 + y} mm, 5 cm], yaw: {turn} deg}}\n"
    found = faults(tmp_path_factory.mktemp("scene"), CRATE + other)
    middle = hypot(x, y) / 1000.0
    # Circles inside and around both rectangles.
    assert not (found and middle > 0.0708 + 0.0361)
    assert not (not found and middle < 0.05 + 0.02 - 0.002)


@pytest.mark.parametrize("name", SHIPPED)
@pytest.mark.parametrize("seed", range(3))
def test_shipped_scenes_do_not_overlap(name: str, seed: int) -> None:
    scene = shipped_scene(name)
    check_overlaps(scene, place_things(scene, RandomSource(seed)))


def test_the_kinematic_plant_refuses_them(tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text(
        f"schema: aeros/scene/2\ndescription: Things.\nbodies:\n{CRATE}{CRATE.replace('crate', 'chest')}"
    )
    with pytest.raises(UserError, match=r"`crate` and `chest` overlap by 100\.0 mm"):
        make_plant(add_scene(shipped_scene("bare"), str(path)), 0)
