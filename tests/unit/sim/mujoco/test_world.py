"""A MuJoCo world: its clock, net forces, and the same steps bit for bit."""

from __future__ import annotations

import pytest

from aeros.sim.engine.world import GRAVITY
from aeros.sim.geometry import UPRIGHT, Pose
from aeros.sim.mujoco.engine import MujocoEngine
from aeros.sim.mujoco.model import SUBSTEPS
from aeros.sim.mujoco.plans import ShapePlan
from aeros.spec.model.scene import Sphere
from tests.unit.sim.engine.declared_bodies import body
from tests.unit.sim.engine.engines import GREY

pytestmark = pytest.mark.physics


def stacked() -> tuple[MujocoEngine, int, int]:
    engine = MujocoEngine()
    engine.add_box((2.0, 2.0, 0.1), (0.0, 0.0, -0.05), mass=0.0, colour=GREY)
    low = engine.add_box((0.2, 0.2, 0.1), (0.0, 0.0, 0.05), mass=3.0, colour=GREY)
    high = engine.add_box((0.1, 0.1, 0.1), (0.01, 0.0, 0.15), mass=1.0, colour=GREY)
    return engine, low, high


def test_callbacks_come_once_a_tick_or_once_a_step_until_the_world_is_closed() -> None:
    engine, _, _ = stacked()
    world, seen = engine.world, list[str]()
    world.before_step.append(lambda: seen.append("before"))
    world.before_substep.append(lambda share: seen.append(f"{share:.2f}"))
    world.after_substep.append(lambda: seen.append("step"))
    world.after_step.append(lambda: seen.append("after"))
    world.step()
    shares = [f"{(number + 1) / SUBSTEPS:.2f}" for number in range(SUBSTEPS)]
    assert seen == ["before", *(part for share in shares for part in (share, "step")), "after"]
    assert world.time == 1 / 240
    world.close()
    world.close()
    world.step()
    assert len(seen) == 2 + 2 * SUBSTEPS


def test_the_net_force_of_all_contacts_holds_the_weight() -> None:
    engine, low, high = stacked()
    for _ in range(240):
        engine.world.step()
    assert engine.world.net_contact_force(high) == pytest.approx(GRAVITY, rel=0.01)
    assert engine.world.net_contact_force(low) == pytest.approx(3.0 * GRAVITY, rel=0.01)


def test_the_same_bodies_move_the_same_bit_for_bit() -> None:
    places = []
    for _ in range(2):
        engine, low, high = stacked()
        for tick in range(120):
            engine.world.push(high, (4.0 if tick < 60 else 0.0, 1.0, 0.0))
            engine.world.step()
        places.append((engine.world.pose(low), engine.world.pose(high), engine.world.contacts(high)))
    assert places[0] == places[1]


def test_a_ball_rolls_until_its_resistance_stops_it() -> None:
    ways = []
    for resistance in (0.0, 0.002):
        engine = MujocoEngine()
        engine.add_box((4.0, 4.0, 0.1), (0.0, 0.0, -0.05), mass=0.0, colour=GREY)
        declared = body(
            shape=Sphere(0.05), mass=0.5, friction=1.0, spinning=0.0, rolling_resistance=resistance
        )
        number = engine.add_body(declared, Pose((0.0, 0.0, 0.05), UPRIGHT)).number
        for tick in range(360):
            engine.world.push(number, (2.0 if tick < 24 else 0.0, 0.0, 0.0))
            engine.world.step()
        ways.append(engine.world.pose(number).position[0])
    # 0.29 m/s; then v²/2a, with a = 5/7 · 9.81 m/s² · 0.6 · 0.002 m / 0.05 m.
    assert ways[0] > 0.4
    assert ways[1] == pytest.approx(0.24, abs=0.03)


def test_a_margin_counts_for_people_and_not_for_overlaps() -> None:
    engine = MujocoEngine()
    corners = tuple((x, y, z) for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (-0.1, 0.1))
    hull = ShapePlan("hull", (0.0, 0.0, 0.0), corners=corners, margin=0.01)
    one = engine.world.bodies.add_moved(hull, ())
    other = engine.add_box((0.2, 0.2, 0.2), (0.205, 0.0, 0.0), mass=0.0, colour=GREY)
    assert engine.world.distance(one, other, 1.0) == pytest.approx(-0.005, abs=1e-6)
    assert engine.world.distance(one, other, 1.0, with_margin=False) == pytest.approx(0.005, abs=1e-6)
    assert engine.world.overlaps(0.001) == []
