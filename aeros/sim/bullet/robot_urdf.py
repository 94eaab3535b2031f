"""Load a robot into PyBullet: from a URDF that comes with it, or from one made of hulls and masses.

The hand is that of PyBullet's panda.urdf, or made of its hull and the boxes of its fingers. The file's soft
finger pads (30 kN/m) stay: force control through rigid pads bounces. What the file glues to the fingers
(`friction_anchor`) does not.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

from aeros.files import make_folder, temporary_folder
from aeros.kinematic_chain import is_prismatic, mounting_of, roll_pitch_yaw
from aeros.runtime.ports import Hull
from aeros.sim.bullet.body_factory import load_model
from aeros.sim.bullet.client import DATA, bullet
from aeros.sim.robot.model import LinkMass, RobotModel, StandingArm, StockUrdf, TwoFingers
from aeros.sim.robot.robot import CARRIAGE_EDGES, RobotOptions
from aeros.sim.robot.standing_arms.standing_arm import fixed_in_posture
from aeros.spec.text.files import read_source

_HAND_FOLDER: Final = "franka_panda"
_HAND_JOINT: Final = "panda_hand_joint"
_FINGERS: Final = ("panda_finger_joint1", "panda_finger_joint2")
_TOOL_JOINT: Final = "panda_grasptarget_hand"

_STANDING: Final = "standing/"
"""Prefix of the names of all links and joints of standing arms, which no other link has."""

_PAD: Final = {
    "stiffness": "30000.0",
    "damping": "1000.0",
    "spinning_friction": "0.1",
    "lateral_friction": "1.0",
}
"""Contact of the fingers, as of PyBullet's panda.urdf."""


@dataclass(frozen=True)
class LoadedRobot:
    """Numbers of a robot in PyBullet, and of its joints.

    Attributes:
        number: of the robot.
        arm: of the arm's joints, from the base outwards.
        fingers: of the finger joints.
        tool: of the joint that carries the tool centre point.
        wrist: of the joint that carries the hand.
        carriage: of the carriage's joints; none of an arm that stands fixed.
        links: of the joints that carry each link of the robot's hulls, by the link's name.
    """

    number: int
    arm: tuple[int, ...]
    fingers: tuple[int, int]
    tool: int
    wrist: int
    carriage: tuple[int, ...]
    links: dict[str, tuple[int, ...]]


def load_robot_body(options: RobotOptions, client: int) -> LoadedRobot:
    """Load a robot, at rest at its base position, all joints at 0.

    Args:
        options: the robot, its carriage and its base position.
        client: PyBullet's client.

    Returns:
        Its numbers.
    """
    model = options.model
    with temporary_folder() as scratch:
        if model.stock_urdf is None:
            root = ElementTree.Element("robot", name=model.name)
            root.extend([*_made_urdf(model, str(scratch))])
            base, joints = "foot", tuple(f"joint{number}" for number in range(1, model.joint_count + 1))
        else:
            # PyBullet ships the file; nobody who could harm us writes it.
            root = ElementTree.fromstring(_stock_urdf(model.stock_urdf, model))  # noqa: S314
            base, joints = model.stock_urdf.base, model.stock_urdf.joints
        if options.carriage:
            edges = " ".join(map(str, CARRIAGE_EDGES))
            frame = _CARRIAGE.format(edges=edges, middle=-CARRIAGE_EDGES[2] / 2.0, base=base)
            root.extend(ElementTree.fromstring(f"<robot>{frame}</robot>"))  # noqa: S314  our own text
        carriers = {joint.get("name", ""): _child(joint) for joint in root.iter("joint")}
        for one in model.standing_arms:
            parent = carriers[joints[one.mount.joint - 1]] if one.mount.joint else base
            root.extend([*_standing(one, parent, _STANDING, str(scratch))])
        ElementTree.indent(root)  # PyBullet breaks lines of more than 8191 characters, in words, too
        text = ElementTree.tostring(root, encoding="unicode")
        path = os.path.join(scratch, "robot.urdf")
        with open(path, "w", encoding="utf-8") as edited:
            edited.write(text)
        number = load_model(path, options.base, fixed=True, client=client, collides_with_itself=True)
    index = _joint_indices(number, client)
    arm = tuple(index[name] for name in joints)
    left, right = (index[name] for name in _FINGERS)
    links = {
        "foot": (index.get("carriage_top", -1),),
        **{f"link{place}": (joint,) for place, joint in enumerate(arm, 1)},
        "hand": (index[_HAND_JOINT],),
        "fingers": (left, right),
        **_standing_links(model, index),
    }
    carriage = (index["carriage_x"], index["carriage_y"]) if options.carriage else ()
    return LoadedRobot(number, arm, (left, right), index[_TOOL_JOINT], index[_HAND_JOINT], carriage, links)


def _standing(arm: StandingArm, parent: str, prefix: str, folder: str) -> Iterator[ElementTree.Element]:
    """Yield links and joints of a standing arm: all fixed, made of hulls, fingers closed.

    parent: name of the link that carries it. prefix: of the names of that link's arm in the URDF.
    """
    mount, prefix = arm.mount, f"{prefix}{arm.mount.prefix}"
    own = os.path.join(folder, prefix)
    make_folder(Path(own))
    model = fixed_in_posture(arm)
    for element in [*_made_urdf(model, own)]:
        if element.get("name") == "foot":  # its mass is not known, and a moving link may carry it
            for mass in element.iter("mass"):
                mass.set("value", "0.0")
        element.set("name", f"{prefix}{element.get('name')}")
        if element.tag == "joint":
            element.set("type", "fixed")
            for end in (*element.iter("parent"), *element.iter("child")):
                end.set("link", f"{prefix}{end.get('link')}")
        yield element
    foot = f"{prefix}foot"
    yield _joint(f"{foot}_mount", "fixed", parent, foot, mount.at, mount.roll_pitch_yaw)
    for one in model.standing_arms:
        carrier = f"{prefix}link{one.mount.joint}" if one.mount.joint else foot
        yield from _standing(one, carrier, prefix, folder)


def _standing_links(
    model: RobotModel, index: Mapping[str, int], prefix: str = ""
) -> dict[str, tuple[int, ...]]:
    """Return the joints that carry the links of standing arms, by the links' names."""
    found: dict[str, tuple[int, ...]] = {}
    for arm in model.standing_arms:
        own = f"{prefix}{arm.mount.prefix}"
        names = {"foot": ("foot_mount",), "hand": (_HAND_JOINT,), "fingers": _FINGERS}
        names |= {f"link{number}": (f"joint{number}",) for number in range(1, arm.model.joint_count + 1)}
        for link, joints in names.items():
            found[f"{own}{link}"] = tuple(index[f"{_STANDING}{own}{joint}"] for joint in joints)
        found |= _standing_links(arm.model, index, own)
    return found


def _child(joint: ElementTree.Element) -> str:
    child = joint.find("child")
    assert child is not None  # noqa: S101  each joint of a URDF has one
    return child.get("link", "")


def _stock_urdf(stock: StockUrdf, model: RobotModel) -> str:
    """Return a URDF of PyBullet with two edits: no friction anchors, and the tool centre point.

    The stock file glues what the fingers touch (`friction_anchor`) and puts the tool centre at 0.105 m.
    """
    path = os.path.join(DATA, stock.path)
    text = read_source(path).text
    text = text.replace("package://", os.path.dirname(path) + "/").replace("<friction_anchor/>", "")
    return text.replace('xyz="0 0 0.105"', f'xyz="0 0 {model.hand.tool}"')


_CARRIAGE: Final = """
  <link name="rail"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>
  </inertial></link>
  <link name="slider"><inertial><mass value="5"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>
  </inertial></link>
  <link name="carriage"><inertial><mass value="55"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>
  </inertial><visual><origin xyz="0 0 {middle}"/><geometry><box size="{edges}"/></geometry></visual>
  <collision><origin xyz="0 0 {middle}"/><geometry><box size="{edges}"/></geometry></collision>
  </link>
  <joint name="carriage_x" type="prismatic"><parent link="rail"/><child link="slider"/><axis xyz="1 0 0"/>
  <limit lower="-10" upper="10" effort="600" velocity="2"/></joint>
  <joint name="carriage_y" type="prismatic"><parent link="slider"/><child link="carriage"/><axis xyz="0 1 0"/>
  <limit lower="-10" upper="10" effort="600" velocity="2"/></joint>
  <joint name="carriage_top" type="fixed"><parent link="carriage"/><child link="{base}"/></joint>
"""


def _made_urdf(model: RobotModel, folder: str) -> Iterator[ElementTree.Element]:
    """Yield links and joints made of hulls and masses, with the hand; write the hulls into `folder`."""
    hulls = {hull.link: hull for hull in model.body.hulls}
    yield _link("foot", hulls["foot"], None, folder)
    parent = "foot"
    rows = zip(model.body.dh_rows, model.dynamics.links, strict=True)
    for number, (row, mass) in enumerate(rows, 1):
        name = f"link{number}"
        yield _link(name, hulls[name], mass, folder)
        kind = "prismatic" if is_prismatic(row) else "revolute"
        joint = _joint(f"joint{number}", kind, parent, name, mounting_of(row)[:3], roll_pitch_yaw(row))
        ElementTree.SubElement(joint, "axis", xyz="0 0 1")
        limits = model.limits
        ElementTree.SubElement(
            joint,
            "limit",
            lower=repr(float(limits.lowest[number - 1])),
            upper=repr(float(limits.highest[number - 1])),
            effort=repr(float(limits.torque[number - 1])),
            velocity=repr(float(limits.speed[number - 1])),
        )
        yield joint
        parent = name
    gripper = model.hand.gripper
    yield from _hand(model, parent) if gripper is None else _made_hand(model, gripper, parent, folder)


def _hand(model: RobotModel, parent: str) -> Iterator[ElementTree.Element]:
    """Yield links and joints of the hand, mounted on the link `parent`."""
    stock = StockUrdf(f"{_HAND_FOLDER}/panda.urdf", "", ())
    # PyBullet ships the file; nobody who could harm us writes it.
    tree = ElementTree.fromstring(_stock_urdf(stock, model))  # noqa: S314
    joints = {joint.get("name", ""): joint for joint in tree.iter("joint")}
    links = {link.get("name", ""): link for link in tree.findall("link")}
    for name in (_HAND_JOINT, *_FINGERS, _TOOL_JOINT):
        joint = joints[name]
        if name == _HAND_JOINT:
            place, turn = (0.0, 0.0, model.hand.flange), (0.0, 0.0, model.hand.turn)
            joint = _joint(name, "fixed", parent, _child(joint), place, turn)
        yield joint
        yield links[_child(joint)]


def _made_hand(
    model: RobotModel, gripper: TwoFingers, parent: str, folder: str
) -> Iterator[ElementTree.Element]:
    """Yield links and joints of a hand made of its hull, the boxes of its fingers and their masses.

    Links and joints have the names of PyBullet's hand, and its soft pads.
    """
    mount = model.hand
    (hull,) = (one for one in model.body.hulls if one.link == "hand")
    corners = tuple(mount.from_last_joint(corner) for corner in hull.corners)
    yield _link("panda_hand", hull._replace(corners=corners), gripper.palm, folder)
    place, turn = (0.0, 0.0, mount.flange), (0.0, 0.0, mount.turn)
    yield _joint(_HAND_JOINT, "fixed", parent, "panda_hand", place, turn)
    for name, side in zip(_FINGERS, (1.0, -1.0), strict=True):
        yield _made_finger(f"{name}_link", gripper, side)
        joint = _joint(name, "prismatic", "panda_hand", f"{name}_link", (0.0,) * 3, (0.0,) * 3)
        ElementTree.SubElement(joint, "axis", xyz=_numbers((0.0, side, 0.0)))
        limits = {"lower": 0.0, "upper": mount.widest_gap / 2.0, "effort": mount.greatest_force}
        texts = {key: repr(value) for key, value in (limits | {"velocity": mount.finger_speed}).items()}
        ElementTree.SubElement(joint, "limit", texts)
        yield joint
    target = ElementTree.Element("link", name="panda_grasptarget")
    _add_mass(target, "0.0")
    yield target
    yield _joint(_TOOL_JOINT, "fixed", "panda_hand", "panda_grasptarget", (0.0, 0.0, mount.tool), (0.0,) * 3)


def _made_finger(name: str, gripper: TwoFingers, side: float) -> ElementTree.Element:
    """Return a finger made of boxes; the one on the side -1 is turned by 180 degrees about z."""
    link = ElementTree.Element("link", name=name)
    contact = ElementTree.SubElement(link, "contact")
    for key, value in _PAD.items():
        ElementTree.SubElement(contact, key, value=value)
    _add_mass(link, repr(gripper.finger_mass))
    for edges, (x, y, z) in gripper.boxes:
        for kind in ("visual", "collision"):
            shape = ElementTree.SubElement(link, kind)
            ElementTree.SubElement(shape, "origin", xyz=_numbers((side * x, side * y, z)))
            geometry = ElementTree.SubElement(shape, "geometry")
            ElementTree.SubElement(geometry, "box", size=_numbers(edges))
    return link


def _add_mass(link: ElementTree.Element, mass: str) -> None:
    """Give a link a mass and the inertia that panda.urdf has: such a link does not turn in the hand."""
    inertial = ElementTree.SubElement(link, "inertial")
    ElementTree.SubElement(inertial, "mass", value=mass)
    inertia = {"ixx": "0.1", "iyy": "0.1", "izz": "0.1", "ixy": "0", "ixz": "0", "iyz": "0"}
    ElementTree.SubElement(inertial, "inertia", inertia)


def _joint(
    name: str, kind: str, parent: str, child: str, place: tuple[float, ...], turn: tuple[float, ...]
) -> ElementTree.Element:
    joint = ElementTree.Element("joint", name=name, type=kind)
    ElementTree.SubElement(joint, "parent", link=parent)
    ElementTree.SubElement(joint, "child", link=child)
    ElementTree.SubElement(joint, "origin", xyz=_numbers(place), rpy=_numbers(turn))
    return joint


def _link(name: str, hull: Hull, mass: LinkMass | None, folder: str) -> ElementTree.Element:
    """Return a link whose shape is its hull; a link without `mass` weighs 1 kg, as it stands fixed."""
    path = os.path.join(folder, f"{name}.obj")
    with open(path, "w", encoding="utf-8") as mesh:
        mesh.write(_obj_of(hull))
    link = ElementTree.Element("link", name=name)
    inertial = ElementTree.SubElement(link, "inertial")
    ElementTree.SubElement(inertial, "origin", xyz=_numbers((0.0,) * 3 if mass is None else mass.centre))
    ElementTree.SubElement(inertial, "mass", value=repr(1.0 if mass is None else mass.mass))
    inertia = (1.0, 1.0, 1.0, 0.0, 0.0, 0.0) if mass is None else mass.inertia
    names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    ElementTree.SubElement(inertial, "inertia", dict(zip(names, map(repr, inertia), strict=True)))
    for kind in ("visual", "collision"):
        geometry = ElementTree.SubElement(ElementTree.SubElement(link, kind), "geometry")
        ElementTree.SubElement(geometry, "mesh", filename=path)
    return link


def _obj_of(hull: Hull) -> str:
    """Return a mesh with the corners of a hull; PyBullet takes the convex hull of its vertices."""
    corners = [f"v {_numbers(corner)}" for corner in hull.corners]
    faces = [f"f 1 {number} {number + 1}" for number in range(2, len(corners))]
    return "\n".join((*corners, *faces, ""))


def _numbers(values: tuple[float, ...]) -> str:
    return " ".join(map(repr, values))


def _joint_indices(body: int, client: int) -> dict[str, int]:
    count = bullet.getNumJoints(body, physicsClientId=client)
    names = (bullet.getJointInfo(body, joint, physicsClientId=client)[1] for joint in range(count))
    return {name.decode(): joint for joint, name in enumerate(names)}
