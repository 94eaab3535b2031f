"""While the robot brakes for a person, too, no link near them is faster than the site allows.

The referee hooks PyBullet's steps: it takes link velocities and the distance of the person's body from it.
"""

from __future__ import annotations

from math import hypot, inf
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.gate.compiled.rules import MonitorRules
from aeros.runtime.gate.joint_rules import ActiveAction
from aeros.runtime.monitor.history import HistoryTracker
from aeros.runtime.monitor.monitor import RuntimeMonitor
from aeros.runtime.ports import MotionCompletion
from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.people import Person, Waypoint
from aeros.sim.physics import make_plant
from aeros.skill import act
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.referee import of_the_site

pytestmark = pytest.mark.physics

DRIVE = act("move_base", x=1.0, y=0.0, speed=0.6)

TOWARDS = Person("walks", (Waypoint((5.0, 0.0)), Waypoint((0.0, 0.0), speed=1.6)))


def seen(site: Site, monkeypatch: pytest.MonkeyPatch) -> tuple[str | None, float, float]:
    """Drive towards a walking person: reason of the end, and fastest link in all and near them, m/s."""
    plant = make_plant(shipped_scene("fetch"), 0, people=(TOWARDS,))
    robot, client = plant._people._robot, plant._world.client
    links = range(bullet.getNumJoints(robot, physicsClientId=client))
    (person,) = (one._body for one in plant._people._walkers)
    fastest: list[tuple[float, bool]] = []
    step = bullet.stepSimulation

    def stepped(**named: Any) -> None:
        step(**named)
        states = [bullet.getLinkState(robot, link, computeLinkVelocity=1, **named) for link in links]
        near = bullet.getClosestPoints(robot, person, of_the_site("warning_distance"), **named)
        fastest.append((max(hypot(*state[6]) for state in states), bool(near)))

    monkeypatch.setattr(bullet, "stepSimulation", stepped)
    monitor = RuntimeMonitor(MonitorRules(site), HistoryTracker(site))
    monitor.add(ActiveAction(DRIVE, plant.observe(), plant.now(), 0))
    try:
        motion = plant.begin(DRIVE)
        assert not isinstance(motion, MotionCompletion)
        reason = plant.advance(monitor, inf)[motion].reason
        plant.advance(lambda now, values: None, plant.now() + 0.5)
    finally:
        plant.close()
    return reason, max(speed for speed, _ in fastest), max(speed for speed, near in fastest if near)


@pytest.mark.parametrize("distance", ["2300 mm", "1200 mm"])
def test_a_carriage_that_brakes_for_a_person_is_slow_where_they_are_near(
    distance: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the shipped distance; and with that at which the rule applied before, it is too fast."""
    text = reference_site_path().read_text()
    assert text.count("value: 2300 mm") == 1
    path = tmp_path / "site.yaml"
    path.write_text(text.replace("value: 2300 mm", f"value: {distance}"))
    site = load_site(path, Diagnostics())
    assert site is not None
    reason, fastest, near = seen(site, monkeypatch)
    assert fastest > 0.4
    assert reason is not None
    assert reason.startswith("monitor:"), (reason, fastest, near)
    assert (near > 1.01 * of_the_site("reduced_speed")) is (distance == "1200 mm"), near


def test_the_slowing_distance_is_what_person_and_robot_need() -> None:
    """S = S_0 + (v_h + v_r)·T + Z_d + Z_r, with T until the slower of arm and carriage has slowed down."""
    slowed = of_the_site("driving_speed_max") - of_the_site("reduced_speed")
    slowing = max(of_the_site("arm_stopping_time"), slowed / of_the_site("drive_deceleration"))
    assert of_the_site("slowing_time") >= of_the_site("reaction_time") + slowing + 2.0 / 240.0
    met = (of_the_site("walking_speed") + of_the_site("driving_speed_max")) * of_the_site("slowing_time")
    zones = of_the_site("person_uncertainty") + of_the_site("robot_uncertainty")
    assert of_the_site("slowing_distance") >= of_the_site("warning_distance") + met + zones
