"""Places that no scanner sees: behind something, wide enough for a person, and seen at the survey."""

from __future__ import annotations

import numpy as np
import pytest

from aeros.sim.scanners.ray_fan import Array, ray_fan
from aeros.sim.scanners.robot_outline import RobotOutline
from aeros.sim.scanners.sections import Section, cast, rectangle
from aeros.sim.scanners.sight_grid import SPACING, SightGrid
from aeros.spec.model.sensor_errors import AreaScanners
from tests.unit.sim.robot.panda import PANDA
from tests.unit.sim.scanners.cells import READY, scanners_at
from tests.unit.sim.scanners.test_robot_outline import REACHING_DOWN

ONE = scanners_at((-1.0, 0.0, 0.0))
TWO = scanners_at((-1.0, 0.0, 0.0), (1.0, 0.0, 180.0))
NOBODY = RobotOutline(PANDA, READY, (9.0, 9.0, 0.0), carriage=False)
WALL = rectangle((0.0, -0.3), (0.1, 0.3))


def hidden(
    scanners: AreaScanners,
    *more: Section,
    survey: tuple[Section, ...] = (),
    own: RobotOutline = NOBODY,
    plane: float = -0.1,
) -> Array:
    fan = ray_fan(scanners)
    taught = cast(fan, np.full(len(fan.origins), scanners.range), survey)
    ranges = cast(fan, taught, more)
    shorter = np.flatnonzero(ranges < taught - 0.1)
    return SightGrid(scanners, taught).hidden_places(shorter, ranges[shorter], own, plane)


def test_places_behind_a_wall_are_hidden() -> None:
    places = hidden(ONE, WALL)
    assert places[:, 0].min() == pytest.approx(0.05, abs=SPACING)
    assert places[:, 0].max() == pytest.approx(1.6, abs=1.1 * SPACING)  # as far as anybody is heeded
    widths = places[:, 1] / (places[:, 0] + 1.0)
    assert np.abs(widths).max() == pytest.approx(0.3, abs=0.03)


def test_a_second_scanner_sees_behind_it() -> None:
    places = hidden(TWO, WALL)
    between = places[np.abs(places[:, 0]) < 0.9]
    assert (np.abs(between[:, 0] - 0.05) < 0.05).all()


def test_behind_something_narrow_there_is_no_room() -> None:
    assert len(hidden(ONE, rectangle((1.0, -0.01), (1.02, 0.01)))) == 0


def test_places_that_were_never_seen_do_not_count() -> None:
    assert len(hidden(ONE, rectangle((0.5, -0.1), (0.6, 0.1)), survey=(WALL,))) == 0


def test_inside_what_stood_there_at_the_survey_is_no_place() -> None:
    """As where the carriage stands 60 mm before a stand: nobody fits between them."""
    before_the_wall = rectangle((-0.1, -0.3), (-0.06, 0.3))
    assert len(hidden(ONE, before_the_wall, survey=(WALL,))) == 0
    farther = rectangle((-0.3, -0.15), (-0.26, 0.15))
    between = hidden(ONE, farther, survey=(WALL,))
    assert between[:, 0].min() < -0.2
    assert between[:, 0].max() < 0.0


def test_the_robot_itself_is_no_place_for_a_person() -> None:
    robot = RobotOutline(PANDA, READY, (0.25, 0.0, 0.0), carriage=True)
    carriage = rectangle((0.0, -0.225), (0.5, 0.225))
    assert not robot.covers(hidden(ONE, carriage, own=robot)).any()
    assert robot.covers(hidden(ONE, carriage)).any()


def test_a_hand_that_reaches_down_to_the_plane_is_no_place_for_a_person() -> None:
    """It hides what is inside it, as the carriage does."""
    low = RobotOutline(PANDA, REACHING_DOWN, (0.0, 0.0, 0.0), carriage=False)
    links = rectangle((0.4, -0.12), (0.6, 0.12))
    under = hidden(ONE, links)
    filled = low.covers_with_links(under, -0.1, 0.0)
    assert filled.any()
    assert not low.covers_with_links(hidden(ONE, links, own=low), -0.1, 0.0).any()
    # Over the plane it fills nothing.
    assert len(hidden(ONE, links, own=low, plane=-2.0)) == len(under)


@pytest.mark.parametrize("turn", np.linspace(0.0, np.pi / 2, 7))
def test_two_legs_cover_a_square_of_points_wherever_they_stand(turn: float) -> None:
    """200 mm by 110 mm, at 400 places."""
    across = np.array(((np.cos(turn), np.sin(turn)), (-np.sin(turn), np.cos(turn))))
    grid = np.stack(np.meshgrid(np.arange(-6, 7), np.arange(-6, 7), indexing="ij"), axis=-1) * SPACING
    for at in np.random.default_rng(0).uniform(-SPACING / 2, SPACING / 2, (400, 2)):
        local = (grid - at) @ across.T
        is_in = (np.abs(local[..., 0]) <= 0.1) & (np.abs(local[..., 1]) <= 0.055)
        assert (is_in[1:, 1:] & is_in[:-1, 1:] & is_in[1:, :-1] & is_in[:-1, :-1]).any()
