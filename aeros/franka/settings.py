"""Settings of the plant `franka`: where the robot is, from the environment; its thresholds, from the site."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from aeros.franka.arm import JOINTS
from aeros.spec.expr.doubles import to_doubles
from aeros.spec.expr.semantics import evaluate
from aeros.spec.model.site import Site
from aeros.wired_arm.settings import SettingsError, watch_bounds

ADDRESS: Final = "AEROS_FRANKA"
"""Environment variable with the robot's address."""

REAL_TIME: Final = "AEROS_FRANKA_REALTIME"
"""Environment variable: `enforce`, or `ignore` on a kernel without real time, for simulators of the
protocol."""

HAND: Final = "AEROS_FRANKA_HAND"
"""Environment variable: `yes`, or `no` for an arm without the Franka Hand."""

_FORCE, _HAND_TORQUE, _TORQUE = "collision_force", "collision_moment", "collision_torque"


@dataclass(frozen=True)
class FrankaSettings:
    """Settings of one robot.

    Attributes:
        address: in the network.
        is_real_time: True to require a real-time kernel.
        has_hand: True if the Franka Hand is mounted.
        torques: thresholds of the joints' external torques, N·m.
        forces: thresholds of the force, N, and the moment, N·m, at the hand, along each axis.
        patience: longest time without a judgement of the monitor, s.
        start_tolerance: greatest distance of a motion's start from the joints, rad, as the site bounds it.
    """

    address: str
    is_real_time: bool
    has_hand: bool
    torques: tuple[float, ...]
    forces: tuple[float, ...]
    patience: float
    start_tolerance: float


def read_settings(environment: Mapping[str, str], site: Site) -> FrankaSettings:
    """Read the settings.

    Args:
        environment: of this process.
        site: the site.

    Returns:
        The settings.

    Raises:
        SettingsError: one is missing or wrong.
    """
    address = environment.get(ADDRESS, "").strip()
    if not address:
        raise SettingsError(f"no robot is named: set {ADDRESS} to its address, as in {ADDRESS}=172.16.0.2")
    bounds = watch_bounds(site)
    force, hand_torque = _constant(site, _FORCE, "N", 1)[0], _constant(site, _HAND_TORQUE, "Nm", 1)[0]
    return FrankaSettings(
        address,
        _choice(environment, REAL_TIME, "enforce", "ignore"),
        _choice(environment, HAND, "yes", "no"),
        _constant(site, _TORQUE, "Nm", JOINTS),
        (force, force, force, hand_torque, hand_torque, hand_torque),
        bounds.patience,
        bounds.start_tolerance,
    )


def _choice(environment: Mapping[str, str], name: str, true: str, false: str) -> bool:
    word = environment.get(name, true)
    if word not in (true, false):
        raise SettingsError(f"{name} is `{word}`: it is `{true}` or `{false}`")
    return word == true


def _constant(site: Site, name: str, unit: str, count: int) -> tuple[float, ...]:
    """Return a constant of the site, SI.

    Raises:
        SettingsError: there is none, or it has not as many values as that.
    """
    declared = site.constants.get(name)
    values: Any = None if declared is None else to_doubles({name: evaluate(declared, {})})[name]
    numbers = values if isinstance(values, tuple) else (values,)
    if (
        declared is None
        or len(numbers) != count
        or not all(type(one) is float and one > 0.0 for one in numbers)
    ):
        values_of = "one value" if count == 1 else f"{count} values, one for each joint"
        raise SettingsError(
            f"the robot's collision detection is set from the site `{site.id}`, which does not state it: add "
            f"the constant `{name}` ({unit}, {values_of} above 0), as in aeros/sites/fr3_cell.yaml"
        )
    return tuple(numbers)
