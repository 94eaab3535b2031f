"""Robot files of the iiwa on a base whose own joints are part of its chain: a linear axis, a base that
turns."""

from __future__ import annotations

import json
import re
from functools import cache
from itertools import product
from math import cos, pi, sin
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final, NamedTuple

import yaml

import aeros
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.robot_file import read_robot

ROBOTS: Final = Path(aeros.__file__).parent / "robots"
LIFT: Final = 0.1
"""Height of the arm's foot over the base frame, m: what moves it is below."""

Numbers = dict[str, float]


class BaseJoint(NamedTuple):
    """A joint under the arm, with the plate that it moves.

    Attributes:
        row: its row of the chain.
        centre: of the plate, in the joint's frame, m.
        edges: of the plate, along the axes of that frame, m.
        limits: value of each column of limits and servos.
    """

    row: dict[str, Any]
    centre: tuple[float, float, float]
    edges: tuple[float, float, float]
    limits: Numbers


_SLIDE: Final = {
    "lowest": -0.4, "highest": 0.4, "speed": 1.0, "acceleration": 4.0, "jerk": 2000.0, "torque": 800.0,
    "torque_rate": 20000.0, "ready": 0.0, "correction": 100.0, "stiffness": 40000.0, "damping": 4000.0,
    "felt_torque": 15.0,
}  # fmt: skip
_TURN: Final = {
    "lowest": -170.0, "highest": 170.0, "speed": 60.0, "acceleration": 4.0, "jerk": 2000.0, "torque": 300.0,
    "torque_rate": 5000.0, "ready": 0.0, "correction": 40.0, "stiffness": 9000.0, "damping": 900.0,
    "felt_torque": 4.0,
}  # fmt: skip
PRISMATIC_UNITS: Final = {
    "lowest": "m", "highest": "m", "speed": "m/s", "acceleration": "m/s^2", "jerk": "m/s^3", "torque": "N",
    "torque_rate": "N/s", "ready": "m", "correction": "N", "stiffness": "N/m", "damping": "N*s/m",
    "felt_torque": "N",
}  # fmt: skip

ALONG_Y: Final = BaseJoint(
    {"length": 0, "twist": -pi / 2, "offset": 0, "joint": "prismatic"},
    (0.0, -0.08, 0.0),
    (0.2, 0.02, 0.2),
    _SLIDE,
)
"""A sledge that slides along y of the base; z of its frame is that y."""

LINEAR_AXIS: Final = (ALONG_Y,)
"""Seven joints that turn on one that slides."""

TURNING_BASE: Final = (
    BaseJoint({"length": 0, "twist": pi / 2, "offset": 0, "zero": pi / 2, "joint": "prismatic"},
              (0.04, 0.0, 0.0), (0.02, 0.2, 0.2), _SLIDE),
    BaseJoint({"length": 0, "twist": pi / 2, "offset": 0, "zero": pi / 2, "joint": "prismatic"},
              (0.0, -0.06, 0.0), (0.2, 0.02, 0.2), _SLIDE),
    BaseJoint({"length": 0, "twist": pi / 2, "offset": 0.03, "zero": pi / 2}, (0.0, 0.0, 0.055),
              (0.36, 0.3, 0.02), _TURN),
)  # fmt: skip
"""A base that goes along y and along x and turns about z, under the arm."""


def iiwa_parts() -> tuple[dict[str, Any], dict[str, Any]]:
    """Read the iiwa's robot file and its hulls, as plain data."""
    text = (ROBOTS / "kuka_iiwa14.yaml").read_text(encoding="utf-8")
    hulls = json.loads((ROBOTS / "kuka_iiwa14_hulls.json").read_text(encoding="utf-8"))
    return yaml.safe_load(text), hulls


def on_a_base(name: str, joints: tuple[BaseJoint, ...], to_arm: dict[str, Any]) -> tuple[Any, Any]:
    """Put joints under the iiwa.

    Args:
        name: id of the robot.
        joints: the joints, from the floor up.
        to_arm: twist, zero and so on of the arm's first row, from the frame of the last of them; the arm
            stands upright `LIFT` above the base's frame.

    Returns:
        The robot file and its hulls, as plain data.
    """
    file, hulls = iiwa_parts()
    count = len(joints)
    slides = any("joint" in one.row for one in joints)
    file["id"] = name
    del file["meshes"]
    file["chain"] = [*(one.row for one in joints), {**file["chain"][0], **to_arm}, *file["chain"][1:]]
    columns = {**file["limits"], **file["servos"], "ready": file["postures"]["ready"]}
    for key, column in columns.items():
        column["values"] = [*(one.limits[key] for one in joints), *column["values"]]
        if slides:
            column["prismatic_unit"] = PRISMATIC_UNITS[key]
    postures = file["postures"]
    postures["lean"] = [*[10] * count, *postures["lean"]]
    postures["search"] = [[*[0] * count, *row] for row in postures["search"]]
    ways = [one.limits["highest"] * 0.7 if "joint" in one.row else 0 for one in joints]
    postures["search"] += [
        [side * way if place == number else 0 for place in range(count)] + [0] * 7
        for number, way in enumerate(ways)
        if way
        for side in (1, -1)
    ]
    plate = {"mass": 12.0, "centre": [0.0, 0.0, 0.0], "inertia": [0.3, 0.3, 0.5, 0.0, 0.0, 0.0]}
    file["dynamics"]["links"] = [*[plate] * count, *file["dynamics"]["links"]]
    for one in (*file["capsules"], *hulls["hulls"]):
        one["link"], one["joint"] = _renamed(one["link"], count), one["joint"] + count
    for pair in hulls["exempt_pairs"]:
        pair["links"] = [_renamed(link, count) for link in pair["links"]]
    # What was the arm's foot is the top of the last plate; it stands on a slab.
    (foot,) = (one for one in hulls["hulls"] if one["link"] == f"link{count}")
    twist = to_arm["twist"]
    c, s = cos(twist), sin(twist)
    lift = LIFT - to_arm.get("lift", 0.0)
    foot["corners"] = [[x, c * y - s * (z + lift), s * y + c * (z + lift)] for x, y, z in foot["corners"]]
    foot["corners"] += _plate("", 0, joints[-1].centre, joints[-1].edges)["corners"]
    file["capsules"] = [one for one in file["capsules"] if one["link"] != f"link{count}"]
    file["capsules"].append(_capsule(foot))
    slab = _plate("foot", 0, (0.0, 0.0, 0.01), (0.3, 0.3, 0.01))
    below = [slab, *(_plate(f"link{n}", n, one.centre, one.edges) for n, one in enumerate(joints[:-1], 1))]
    hulls["hulls"] += below
    file["capsules"] += [_capsule(one) for one in below]
    bases = ["foot", *(f"link{n}" for n in range(1, count + 1))]
    hulls["exempt_pairs"] += [
        {"links": [a, b], "reason": "plates above each other"}
        for i, a in enumerate(bases)
        for b in bases[i + 1 :]
    ]
    first = f"link{count + 1}"
    hulls["exempt_pairs"] += [{"links": [one, first], "reason": "never meet"} for one in bases[:-1]]
    file["hulls"] = f"{name}_hulls.json"
    del file["chain"][count]["lift"]
    file["chain"][count]["offset"] += lift
    return file, hulls


def _renamed(link: str, count: int) -> str:
    if link == "foot":
        return f"link{count}"
    return f"link{int(link[4:]) + count}" if link.startswith("link") else link


def _plate(
    link: str, joint: int, centre: tuple[float, float, float], edges: tuple[float, float, float]
) -> dict[str, Any]:
    ranges = [(c - e / 2.0, c + e / 2.0) for c, e in zip(centre, edges, strict=True)]
    corners = [list(corner) for corner in product(*ranges)]
    return {"link": link, "joint": joint, "radius": 0.001, "corners": corners}


def _capsule(hull: dict[str, Any]) -> dict[str, Any]:
    """A ball around the corners of a hull, as a capsule without a length."""
    middle = [(min(column) + max(column)) / 2.0 for column in zip(*hull["corners"], strict=True)]
    reach = (
        max(sum((a - b) ** 2 for a, b in zip(corner, middle, strict=True)) for corner in hull["corners"])
        ** 0.5
    )
    radius = reach + hull["radius"] + 1e-4
    return {"link": hull["link"], "joint": hull["joint"], "a": middle, "b": middle, "radius": radius}


def write_robot(folder: Path, file: Any, hulls: Any) -> Path:
    """Write a robot file with its hulls; returns its path."""
    (folder / file["hulls"]).write_text(json.dumps(hulls), encoding="utf-8")
    path = folder / f"{file['id']}.yaml"
    # JSON is YAML, and has no aliases.
    path.write_text(json.dumps(file, indent=2), encoding="utf-8")
    return path


def linear_axis_parts() -> tuple[Any, Any]:
    """The file of the iiwa on a linear axis along y."""
    return on_a_base("iiwa_on_rail", LINEAR_AXIS, {"twist": pi / 2, "lift": 0.0})


def turning_base_parts() -> tuple[Any, Any]:
    """The file of the iiwa on a base that slides along y and x and turns."""
    return on_a_base("iiwa_on_base", TURNING_BASE, {"twist": 0.0, "lift": 0.03})


@cache
def linear_axis() -> RobotModel:
    """The iiwa on a linear axis."""
    with TemporaryDirectory() as folder:
        return read_robot(str(write_robot(Path(folder), *linear_axis_parts())))


@cache
def turning_base() -> RobotModel:
    """The iiwa on a base that turns."""
    with TemporaryDirectory() as folder:
        return read_robot(str(write_robot(Path(folder), *turning_base_parts())))


def linear_axis_site(robot: str, lever: float = 1.0) -> str:
    """The text of the iiwa's cell for the iiwa on a linear axis, with its joints in jpos.

    Args:
        robot: the site's `robot`.
        lever: the site's lever of the prismatic joint, m/jpos.
    """
    text = (ROBOTS.parent / "sites" / "iiwa_cell.yaml").read_text(encoding="utf-8")
    values = iter([-0.4, 0.4, 1.0, 4.0, 2000.0, 800.0, 20000.0, lever])

    def column(found: re.Match[str]) -> str:
        return f"{found[1]}{_in_jpos(found[2])}{found[3]}{next(values)}, "

    text = re.sub(r"(index: joints\n    unit: )(\S+)(\n    values: \[)", column, text)
    text = re.sub(r"(index: joints, unit: )([\w/]+)", lambda found: found[1] + _in_jpos(found[2]), text)
    for old, new in (
        ("robot: kuka_iiwa14", f"robot: {robot}"),
        ("joints: [j1,", "joints: [j0, j1,"),
        ("      q7: {type: real, unit: rad, range: [-4, 4], description: of joint 7}\n",
         "      q7: {type: real, unit: jpos, range: [-4, 4], description: of joint 7}\n"
         "      q8: {type: real, unit: jpos, range: [-4, 4], description: of joint 8}\n"),
        ("q6, q7], peak", "q6, q7, q8], peak"),
        ("starts_within: 0.0019 rad", "starts_within: 0.0015 jpos"),
        ("[link1, link2, link3", "[link2, link3"),
        ("link7, hand, held]", "link7, link8, hand, held]"),
        ("links: [link5, link6, link7, hand, fingers", "links: [link6, link7, link8, hand, fingers"),
        ("[link4, link5, link6, link7, hand, fingers", "[link5, link6, link7, link8, hand, fingers"),
        ("noise: 0.00002 rad,", "noise: 0.00002 jpos,"),
        ("joint_velocity: {noise: 0.001 rad/s", "joint_velocity: {noise: 0.001 jpos/s"),
        ("noise: 50 mN*m, bias: 0.1 N*m,", "noise: 50 mN*m/jpos, bias: 0.1 N*m/jpos,"),
        ("noise: 20 N*m/s,", "noise: 20 N*m/s/jpos,"),
    ):  # fmt: skip
        assert old in text, old
        text = text.replace(old, new)
    text = re.sub(r"(q\d: \{type: real, unit: )rad", r"\1jpos", text)
    for number in range(7, 0, -1):
        text = re.sub(rf"q_min\[j{number}\] <= q{number} <= q_max\[j{number}\]",
                      f"q_min[j{number}] <= q{number + 1} <= q_max[j{number}]", text)  # fmt: skip
    return text.replace("q_min[j1] <= q2", "q_min[j0] <= q1 <= q_max[j0] and q_min[j1] <= q2")


def _in_jpos(unit: str) -> str:
    """Rename a unit of revolute joints to the same of joints of both kinds."""
    return unit.replace("rad", "jpos") if "rad" in unit else f"{unit}/jpos"
