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
from aeros.sim.engine.people import Person, Waypoint
from aeros.sim.physics import make_plant
from aeros.skill import act
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.expr.terms import ConstantTable
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.bullet.bullet_parts import as_bullet
from tests.unit.sim.referee import of_the_site

pytestmark = pytest.mark.physics

DRIVE = act("move_base", x=0.0, y=1.0, speed=0.6)

TOWARDS = Person("walks", (Waypoint((0.0, 5.0)), Waypoint((0.0, 0.0), speed=1.6)), floor=-0.3)


def seen(site: Site, monkeypatch: pytest.MonkeyPatch) -> tuple[str | None, float, float]:
    """Drive towards a walking person: reason of the end, and fastest link in all and near them, m/s."""
    plant = make_plant(shipped_scene("fetch"), 0, people=(TOWARDS,))
    robot, client = plant._people._robot, as_bullet(plant._world).client
    links = range(bullet.getNumJoints(robot, physicsClientId=client))
    (person,) = (one.body for one in plant._people.walkers)
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


@pytest.mark.parametrize("distance", ["2600 mm", "1200 mm"])
def test_a_carriage_that_brakes_for_a_person_is_slow_where_they_are_near(
    distance: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the shipped distance it is; with rules that begin only where contact does, it is too fast."""
    text = reference_site_path().read_text()
    assert text.count("value: 2600 mm") == text.count("value: 2300 mm") == 1
    path = tmp_path / "site.yaml"
    if distance != "2600 mm":
        text = text.replace("value: 2300 mm", f"value: {distance}")
    path.write_text(text.replace("value: 2600 mm", f"value: {distance}"))
    site = load_site(path, Diagnostics())
    assert site is not None
    reason, fastest, near = seen(site, monkeypatch)
    assert fastest > 0.4
    assert reason is not None
    assert reason.startswith("monitor:"), (reason, fastest, near)
    assert (near > 1.01 * of_the_site("driving_contact_speed")) is (distance == "1200 mm"), near


@pytest.mark.parametrize(
    ("slow", "time", "distance"),
    [
        ("reduced_speed", "slowing_time", "slowing_distance"),
        ("driving_contact_speed", "driving_slowing_time", "driving_slowing_distance"),
    ],
)
def test_the_slowing_distance_is_what_person_and_robot_need(slow: str, time: str, distance: str) -> None:
    """S = S_0 + (v_h + v_r)·T + Z_d + Z_r, with T until the slower of arm and carriage has slowed down."""
    slowed = of_the_site("driving_speed_max") - of_the_site(slow)
    slowing = max(of_the_site("arm_stopping_time"), slowed / of_the_site("drive_deceleration"))
    assert of_the_site(time) >= of_the_site("reaction_time") + slowing + 2.0 / 240.0
    met = (of_the_site("walking_speed") + of_the_site("driving_speed_max")) * of_the_site(time)
    zones = of_the_site("person_uncertainty") + of_the_site("robot_uncertainty")
    assert of_the_site(distance) >= of_the_site("warning_distance") + met + zones


@pytest.mark.parametrize("region", ["hands", "lower_legs"])
def test_a_carriage_that_hits_somebody_as_fast_as_it_may_keeps_the_transient_limit(region: str) -> None:
    """An obstacle as stiff as the region, and held fast; its force is read beneath AEROS."""
    peak, held = hit(region, of_the_site("reduced_driving_speed"))
    assert 0.5 * limit_of("transient_force", region) < peak <= limit_of("transient_force", region)
    assert held <= limit_of("quasi_static_force", region)


def test_a_carriage_that_were_faster_would_break_the_transient_limit() -> None:
    """At the speed of the tool near people, 200 mm/s, which the carriage was once allowed."""
    peak, _ = hit("hands", of_the_site("reduced_tool_speed"))
    assert peak > limit_of("transient_force", "hands")


def limit_of(table: str, region: str) -> float:
    """A region's value of a table of the reference site, SI."""
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    found = site.constants[table]
    assert isinstance(found, ConstantTable)
    return float(found.values[found.type.index.members.index(region)])


def hit(region: str, speed: float) -> tuple[float, float]:
    """Drive into an obstacle under the site's monitor: greatest force in the first 0.5 s, and later, N."""
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    plant = make_plant(shipped_scene("fetch"), 0)
    robot, client = plant._people._robot, as_bullet(plant._world).client
    stiffness = limit_of("region_stiffness", region)
    x, y, z = plant.observe()["base_position"].value
    # Half-way, where the carriage, 0.25 m from its middle to its end, is fastest. A ball has one contact.
    shape = bullet.createCollisionShape(bullet.GEOM_SPHERE, radius=0.05, physicsClientId=client)
    post = bullet.createMultiBody(0, shape, -1, (x - 0.525, y, z - 0.15), physicsClientId=client)
    damping = 0.02 * (stiffness * of_the_site("driven_mass")) ** 0.5
    bullet.changeDynamics(
        post, -1, contactStiffness=stiffness, contactDamping=damping, physicsClientId=client
    )
    action = act("move_base", x=x - 0.45, y=y, speed=speed)
    monitor = RuntimeMonitor(MonitorRules(site), HistoryTracker(site))
    plan = plant.plan(action)
    monitor.add(ActiveAction(action, plant.observe(), plant.now(), 0), plan)
    forces: list[float] = []

    def note(_: float = 0.0, __: object = None) -> None:
        points = bullet.getContactPoints(robot, post, physicsClientId=client) or ()
        forces.append(sum(point[9] for point in points))

    def watched(now: float, values: Any) -> str | None:
        note()
        return monitor(now, values)

    try:
        motion = plant.begin(action, plan)
        assert not isinstance(motion, MotionCompletion)
        assert plant.advance(watched, inf)[motion].reason is not None
        plant.advance(note, plant.now() + 1.0)
    finally:
        plant.close()
    touch = next(number for number, force in enumerate(forces) if force > 0.0)
    return max(forces[touch : touch + 120]), max(forces[touch + 120 :], default=0.0)
