"""Checks of the plant's own log after kills: no repeated skill, and no motion without an agent."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from math import dist
from pathlib import Path
from typing import Any, Final

from aeros.spec.closed_loop.loop_variables import recoveries_of
from aeros.spec.expr.effects import state_after
from aeros.spec.model.ecm import Ecm

_REST_SPEEDS: Final = {"symbolic": 0.0, "kinematic": 0.0, "physics": 0.02}
"""Joint speed, rad/s, below which an arm is at rest: physics holds it with motors against gravity."""

PLANTS: Final = tuple(_REST_SPEEDS)

_REST_TOLERANCES: Final = {"symbolic": 0.0, "kinematic": 0.0, "physics": 1e-9}
"""Largest motion of a joint without an agent, rad."""


def repeated_skills(plant_log: Iterable[Mapping[str, Any]], modules: Mapping[str, Ecm]) -> list[str]:
    """List skills that began while the effects of an earlier success were still measured.

    Of a count, the effect is the number that it had after that success.

    Args:
        plant_log: lines of the plant's log.
        modules: modules by id.

    Returns:
        One text for each repetition.
    """
    broken: list[str] = []
    achieved: dict[str, list[Mapping[str, Any]]] = {}
    before: dict[str, Mapping[str, Any]] = {}
    helpers = {
        f"{ecm.id}.{name}"
        for ecm in modules.values()
        for task in ecm.tasks.values()
        for rule in task.rules
        for name in recoveries_of(rule)
    }
    for one in plant_log:
        if one["event"] == "skill-began":
            still = [was for was in achieved.get(one["skill"], ()) if _holds(was, one["measured"])]
            broken += [
                f"once: {one['skill']} at {one['time']:.2f} s, though {_values_of(was, one['measured'])}"
                for was in still
            ]
            before[one["skill"]] = one["measured"]
        elif one["event"] == "skill-ended":
            module, name = one["skill"].split(".")
            successes = modules[module].skills[name].success_outcomes if one["finished"] else ()
            left = [state_after(each.effects, before.get(one["skill"], {})) for each in successes]
            found = [each for each in left if _holds(each, one["measured"])]
            achieved.setdefault(one["skill"], []).extend(found)
            if not found:
                for helper in helpers:
                    achieved.pop(helper, None)
    return broken


def _holds(effects: Mapping[str, Any], measured: Mapping[str, Any]) -> bool:
    return bool(effects) and all(
        value is not None and measured.get(name) == value for name, value in effects.items()
    )


def _values_of(names: Iterable[str], measured: Mapping[str, Any]) -> dict[str, Any]:
    return {name: measured[name] for name in names}


def motion_without_agent(plant_log: Sequence[Mapping[str, Any]], plant: str) -> list[str]:
    """List where the plant was not at rest after its agent had gone, or moved before the next came.

    Args:
        plant_log: lines of the plant's log.
        plant: one of `PLANTS`.

    Returns:
        One text for each motion.
    """
    broken: list[str] = []
    for one, then in zip(plant_log, [*plant_log[1:], None], strict=False):
        if one["event"] != "agent-disconnected":
            continue
        speed = max(map(abs, one["measured"]["joint_velocity"]))
        if speed > _REST_SPEEDS[plant]:
            broken.append(f"stopped: at {one['time']:.2f} s a joint moved at {speed:.4f} rad/s")
        if then is None:
            continue
        if then["event"] != "agent-connected" or then["time"] != one["time"]:
            broken.append(f"stopped: after {one['time']:.2f} s time went on without an agent")
        way = dist(one["measured"]["joint_position"], then["measured"]["joint_position"])
        if way > _REST_TOLERANCES[plant]:
            broken.append(f"stopped: a joint moved by {way:g} rad without an agent")
    return broken


def read_whole_lines(path: Path) -> list[dict[str, Any]]:
    """Read a log without a torn last line: one that no line break ends.

    Args:
        path: of a log of JSON lines.

    Returns:
        The lines; none where the log does not exist.
    """
    if not path.exists():
        return []
    content = path.read_bytes()
    return [json.loads(line) for line in content[: content.rfind(b"\n") + 1].splitlines()]
