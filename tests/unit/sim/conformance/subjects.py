"""Our own plants as subjects of the conformance suite, with what each states of itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from typing import Final

from aeros.runtime.bus.feed import BusFeed
from aeros.runtime.bus.in_process import InProcessBus
from aeros.runtime.bus.listened_plant import ListenedPlant
from aeros.runtime.ports import Plant
from aeros.sim.conformance.suite import PlantUnderTest
from aeros.sim.kinematic.plant import make_plant as make_kinematic
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.robot import BASE_ACCELERATION_MAX
from aeros.sim.symbolic.plant import SymbolicPlant
from aeros.skill import act
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path
from tests.repo.tree import ROOT
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.hosting.hosted import Hosted
from tests.unit.sim.robot.moving_bases import linear_axis, turning_base
from tests.unit.sim.robot.panda import QDD_MAX
from tests.unit.sim.robot.standing_arms.two_armed_robots import two_pandas

REACH: Final = act("move_tool", target=(0.5, -0.35, 0.25), yaw=0.5, speed=0.5)
"""From where the arm begins, about a second; two joints then move at about 1 rad/s."""

JOINTS: Final = act("move_joints", q1=0.5, q2=-0.3, q3=0.2, q4=-1.9, q5=0.3, q6=1.9, q7=0.2, speed=0.5)
"""From where the arm begins, about two seconds."""

DRIVE: Final = act("move_base", x=-0.5, y=0.3, speed=0.5)
"""Two seconds."""

PRESSING: Final = (
    act("grip", width=0.0, force=10.0),
    act("move_tool", target=(0.5, 0.0, 0.013), yaw=0.0, speed=0.5),
    act("slide", target=(0.5, 0.05, 0.0), force=6.0, speed=0.1),
)
"""Closed fingers on the table top, and along it."""

TOGETHER: Final = (DRIVE, act("move_tool", target=(-0.1, 0.2, 0.55), yaw=0.3, speed=0.6))
"""The tool comes to its target as the base comes to rest."""

LOOK_AND_WAIT: Final = act("wait", duration=2.5)
"""Longer than any `motion_action`."""


@cache
def _site() -> Site:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    return site


@cache
def _modules() -> dict[str, Ecm]:
    loaded = load_ecm(ROOT / "ecms" / "make_dumplings", _site(), Diagnostics())
    assert loaded is not None
    return {loaded.ecm.id: loaded.ecm}


def _physics(scene: str, robot: Callable[[], RobotModel | None] = lambda: None) -> Callable[[], Plant]:
    def make() -> Plant:
        # PyBullet is imported only where it is asked for.
        from aeros.sim.physics import make_plant

        return make_plant(shipped_scene(scene), 0, robot=robot())

    return make


def _mujoco(scene: str, robot: Callable[[], RobotModel | None] = lambda: None) -> Callable[[], Plant]:
    def make() -> Plant:
        # MuJoCo is imported only where it is asked for.
        from aeros.sim.physics import make_mujoco_engine, make_plant

        return make_plant(shipped_scene(scene), 0, robot=robot(), engine=make_mujoco_engine())

    return make


def _watched() -> Plant:
    return ListenedPlant(make_kinematic(shipped_scene("bare"), 0), BusFeed(InProcessBus(), _site()))


KINEMATIC: Final = PlantUnderTest(
    make_plant=lambda: make_kinematic(shipped_scene("bare"), 0),
    motion_action=REACH,
    parallel_action=LOOK_AND_WAIT,
    tracking_tolerance=1e-9,
    max_overshoot=1e-6,
    deceleration=tuple(QDD_MAX.tolist()),
    # The greatest speed that a profile has, half of 2.175 rad/s, over 0.9 of 7.5 rad/s².
    max_stop_time=0.17,
    noise=1e-9,
    skill="make_dumplings.boil",
    contact_actions=PRESSING,
)

SUBJECTS: Final = {
    "symbolic": replace(
        KINEMATIC,
        make_plant=lambda: SymbolicPlant(_site(), _modules(), 0),
        period=None,
        deceleration=(),
        max_stop_time=0.0,
        contact_actions=(),
    ),
    "kinematic": KINEMATIC,
    "kinematic on its carriage": replace(
        KINEMATIC,
        make_plant=lambda: make_kinematic(shipped_scene("fetch"), 0),
        motion_action=DRIVE,
        # 0.5 m/s over 1 m/s²; the joints do not move.
        max_stop_time=0.5,
        deceleration=(),
        base_deceleration=BASE_ACCELERATION_MAX,
        contact_actions=(),
        parallel_actions=TOGETHER,
    ),
    "kinematic, joint by joint": replace(KINEMATIC, motion_action=JOINTS),
    "watched": replace(KINEMATIC, make_plant=_watched),
    "hosted": replace(KINEMATIC, make_plant=lambda: Hosted(lambda: make_kinematic(shipped_scene("bare"), 0))),
}

SUBJECTS["symbolic, joint by joint"] = replace(SUBJECTS["symbolic"], motion_action=JOINTS)


def _on_a_moving_base(robot: Callable[[], RobotModel]) -> Plant:
    return make_kinematic(shipped_scene("bare"), 0, robot=robot())


_MOTORS: Final = replace(
    KINEMATIC,
    make_plant=_physics("bare"),
    tracking_tolerance=0.006,
    max_overshoot=0.02,
    # Until the joints are at rest and not the set points alone: `robot.SETTLE_TICKS`.
    max_stop_time=0.17 + 0.25,
    noise=1e-3,
)

WITH_TWO_ARMS: Final = "with a second arm"

MOVING_BASES: Final = {"on a linear axis": linear_axis, "on a base that turns": turning_base}
"""Arms on a base whose own joints, some of them prismatic, are part of the chain."""

_BASES_MOVE: Final = {
    "on a linear axis": act(
        "move_joints", q1=0.3, q2=0.4, q3=0.3, q4=0.2, q5=-1.6, q6=0.2, q7=1.3, q8=0.2, speed=0.5
    ),
    "on a base that turns": act(
        "move_joints",
        q1=0.2,
        q2=-0.15,
        q3=0.5,
        q4=0.3,
        q5=0.3,
        q6=0.2,
        q7=-1.6,
        q8=0.2,
        q9=1.3,
        q10=0.2,
        speed=0.5,
    ),
}
"""From where these arms begin, about a second; each joint moves."""

for _name, _robot in MOVING_BASES.items():
    SUBJECTS[f"kinematic {_name}"] = replace(
        KINEMATIC,
        make_plant=partial(_on_a_moving_base, _robot),
        motion_action=_BASES_MOVE[_name],
        deceleration=tuple(_robot().limits.acceleration.tolist()),
        contact_actions=(),  # no slide with prismatic joints
        # A metre per second over 0.9 of 4 m/s².
        max_stop_time=0.3,
    )

SUBJECTS[f"kinematic {WITH_TWO_ARMS}"] = replace(
    KINEMATIC, make_plant=partial(_on_a_moving_base, two_pandas), motion_action=REACH
)

PHYSICAL: Final = {
    "physics": _MOTORS,
    "physics, joint by joint": replace(_MOTORS, motion_action=JOINTS),
    "physics on its carriage": replace(
        _MOTORS,
        make_plant=_physics("fetch"),
        motion_action=DRIVE,
        max_stop_time=0.5 + 0.25,
        deceleration=(),
        base_deceleration=BASE_ACCELERATION_MAX,
        contact_actions=(),
        parallel_actions=TOGETHER,
        look_action=act("look", camera="hand"),
    ),
    f"physics {WITH_TWO_ARMS}": replace(_MOTORS, make_plant=_physics("bare", two_pandas)),
    **{
        f"physics {name}": replace(
            _MOTORS,
            make_plant=_physics("bare", robot),
            motion_action=_BASES_MOVE[name],
            deceleration=tuple(robot().limits.acceleration.tolist()),
            contact_actions=(),
            max_stop_time=0.3 + 0.25,
        )
        for name, robot in MOVING_BASES.items()
    },
}

ON_MUJOCO: Final = {
    name.replace("physics", "mujoco"): replace(
        subject,
        make_plant=_mujoco(
            "fetch" if name == "physics on its carriage" else "bare",
            {**MOVING_BASES, WITH_TWO_ARMS: two_pandas}.get(name.removeprefix("physics "), lambda: None),
        ),
    )
    for name, subject in PHYSICAL.items()
}
