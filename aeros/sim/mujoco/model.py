"""A MuJoCo model that grows: bodies are added to its description, and it is compiled when it is next used.

What moves keeps its state when the model is compiled again. Bodies, links and joints have numbers: of a body
in the order in which it was added; of a link as `plans.names_of_links` says, and a joint that of the link it
moves.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.sim.clock import TICK
from aeros.sim.engine.world import GRAVITY
from aeros.sim.geometry import Pose, Quaternion, Vector3
from aeros.sim.mujoco.client import mujoco
from aeros.sim.mujoco.plans import AT_ORIGIN, Friction, JointPlan, LinkPlan, ShapePlan
from aeros.sim.pictures.solids import Array, Solid

SUBSTEPS: Final = 4
"""Steps of the engine in a tick: 960 Hz. At 240 Hz contacts must be softer than a grasp allows."""

_CONTACT_TIME: Final = 0.004
"""Time constant of contacts, s: the least that is stable is two steps, 0.0021 s; chosen."""

_CONTACT_IMPEDANCE: Final = (0.95, 0.99, 0.001, 0.5, 2.0)
"""Impedance of contacts at the surface and deeper, as of MuJoCo's stiffer examples (default 0.9, 0.95)."""

_FRICTION_IMPEDANCE_RATIO: Final = 10.0
"""Impedance of friction over that of normal forces: held things slip less; 10 as MuJoCo's manual advises."""

PEOPLE_GROUP: Final = 4
"""Group of the shapes of people, which touch nothing and which no ray of a survey meets."""

_KINDS: Final = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
    "hull": mujoco.mjtGeom.mjGEOM_MESH,
}


class Geom(NamedTuple):
    """A shape in the model.

    Attributes:
        body: number of its body.
        link: number of its link.
        shape: the shape.
        friction: of its surface.
    """

    body: int
    link: int
    shape: ShapePlan
    friction: Friction


class BuiltModel(NamedTuple):
    """A compiled model.

    Attributes:
        model: the `MjModel`.
        data: its state, the `MjData`.
        links: MuJoCo's numbers of bodies by our numbers of body and link.
        positions: places in `qpos` of joints by our numbers of body and joint.
        speeds: places in `qvel` likewise.
        owners: of each shape in the model its body and link by our numbers (n, 2).
    """

    model: Any
    data: Any
    links: Mapping[tuple[int, int], int]
    positions: Mapping[tuple[int, int], int]
    speeds: Mapping[tuple[int, int], int]
    owners: NDArray[np.intp]


class GrowingModel:
    """A description of bodies, and the model compiled from it.

    Attributes:
        bodies: links of each body, by its number.
        geoms: the shapes in the order of the compiled model, once it is compiled.
        frictions: Coulomb, spinning and rolling friction of each of them (n, 3).
    """

    def __init__(self) -> None:
        self._spec = _empty_description()
        self.bodies: list[tuple[LinkPlan, ...]] = []
        self._added: dict[str, Geom] = {}
        self.geoms: tuple[Geom, ...] = ()
        self.frictions: Array = np.zeros((0, 3))
        self._joint_frictions: dict[tuple[int, int], float] = {}
        self._places: dict[int, Vector3] = {}
        self._built: BuiltModel | None = None
        self._is_stale = True

    def add(self, links: Sequence[LinkPlan], pose: Pose, *, moves: bool) -> int:
        """Add a body.

        Args:
            links: its links, the base first.
            pose: of the base's frame in W.
            moves: True if its base moves freely, else it is fixed to W.

        Returns:
            Its number.
        """
        number = len(self.bodies)
        self.bodies.append(tuple(links))
        added: dict[str | None, Any] = {}
        for index, link in enumerate(links, -1):
            parent = self._spec.worldbody if link.parent is None else added[link.parent]
            place = pose if link.parent is None else link.place
            added[link.name] = self._add_link(parent, place, (number, index), link)
        if moves:
            added[links[0].name].add_freejoint()
        self._is_stale = True
        return number

    def add_moved(self, shape: ShapePlan, visuals: tuple[Solid, ...]) -> int:
        """Add a body that is put from place to place and touches nothing.

        Args:
            shape: its shape.
            visuals: what cameras see of it.

        Returns:
            Its number; it is at the origin of W.
        """
        number = len(self.bodies)
        link = LinkPlan("", None, AT_ORIGIN, None, None, (shape,), Friction(0.0), visuals)
        self.bodies.append((link,))
        body = self._add_link(self._spec.worldbody, link.place, (number, -1), link)
        body.mocap = True
        for geom in body.geoms:
            geom.contype = geom.conaffinity = 0
            geom.group = PEOPLE_GROUP
        self._is_stale = True
        return number

    def move(self, number: int, position: Vector3) -> None:
        """Put a body of `add_moved` to a place.

        Args:
            number: of the body.
            position: of its middle in W, m.
        """
        self._places[number] = position
        if self._built is not None and not self._is_stale:
            self._place_moved(self._built, number)

    def set_contact(self, body: int, first: int, second: int, *, touch: bool) -> None:
        """Let two links of a body touch each other, or never; else those that one joint joins never do.

        Args:
            body: its number.
            first: number of one link.
            second: number of the other.
            touch: True if they touch.
        """
        if touch:
            _add_pairs(self._spec, self._added, (body, first), (body, second))
        else:
            self._spec.add_exclude(bodyname1=_name(body, first), bodyname2=_name(body, second))
        self._is_stale = True

    def couple(self, body: int, first: int, second: int) -> None:
        """Let one motor drive two joints: their positions stay equal.

        Args:
            body: its number.
            first: number of one joint.
            second: number of the other.
        """
        coupling = self._spec.add_equality(
            name1=_name(body, first), name2=_name(body, second), type=mujoco.mjtEq.mjEQ_JOINT
        )
        coupling.data[:5] = (0.0, 1.0, 0.0, 0.0, 0.0)
        coupling.solref[:2] = (_CONTACT_TIME, 1.0)
        self._is_stale = True

    def add_servo(self, body: int, joint: int, stiffness: float, damping: float) -> None:
        """Add a motor that draws a joint to a position, with a force that is set as its range.

        The force is stiffness · (set point − position) − damping · speed. Servos are in the order in which
        they are added.

        Args:
            body: number of its body.
            joint: number of the joint.
            stiffness: N·m/rad or N/m.
            damping: N·m·s/rad or N·s/m.
        """
        servo = self._spec.add_actuator(
            target=_name(body, joint),
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
            gaintype=mujoco.mjtGain.mjGAIN_FIXED,
            biastype=mujoco.mjtBias.mjBIAS_AFFINE,
            forcelimited=True,
            forcerange=(-1.0, 1.0),
        )
        servo.gainprm[0] = stiffness
        servo.biasprm[:3] = (0.0, -stiffness, -damping)
        self._is_stale = True

    def set_link_friction(self, body: int, link: int, lateral: float) -> None:
        """Set the Coulomb coefficient of a link.

        Args:
            body: number of its body.
            link: number of the link.
            lateral: dimensionless.
        """
        for name, geom in self._added.items():
            if (geom.body, geom.link) == (body, link):
                self._added[name] = geom._replace(friction=geom.friction._replace(lateral=lateral))
        if not self._is_stale:
            self._index_shapes()

    def set_joint_friction(self, body: int, joint: int, friction: float) -> None:
        """Set the dry friction of a joint.

        Args:
            body: number of its body.
            joint: number of the joint.
            friction: N·m or N.
        """
        self._joint_frictions[body, joint] = friction
        if self._built is not None and not self._is_stale:
            self._built.model.dof_frictionloss[self._built.speeds[body, joint]] = friction

    def built(self) -> BuiltModel:
        """Compile what was added since it was last compiled.

        Returns:
            The model, with what moves where it was.
        """
        if self._built is None or self._is_stale:
            self._compile()
        assert self._built is not None  # noqa: S101  for the type checker
        return self._built

    # Internals.

    def _compile(self) -> None:
        if self._built is None:
            model = self._spec.compile()
            data = mujoco.MjData(model)
        else:
            model, data = self._spec.recompile(self._built.model, self._built.data)
        self._is_stale = False
        links = {
            (number, index): model.body(_name(number, index)).id
            for number, body in enumerate(self.bodies)
            for index in range(-1, len(body) - 1)
        }
        joints = {
            key: model.joint(_name(*key)).id
            for key in links
            if self.bodies[key[0]][key[1] + 1].joint is not None
        }
        positions = {key: int(model.jnt_qposadr[joint]) for key, joint in joints.items()}
        speeds = {key: int(model.jnt_dofadr[joint]) for key, joint in joints.items()}
        self.geoms = tuple(self._added[model.geom(number).name] for number in range(model.ngeom))
        owners = np.array([(geom.body, geom.link) for geom in self.geoms], dtype=np.intp).reshape(-1, 2)
        self._built = BuiltModel(model, data, links, positions, speeds, owners)
        self._index_shapes()
        for (number, joint), friction in self._joint_frictions.items():
            model.dof_frictionloss[speeds[number, joint]] = friction
        for number in self._places:
            self._place_moved(self._built, number)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)

    def _index_shapes(self) -> None:
        assert self._built is not None  # noqa: S101  for the type checker
        model = self._built.model
        self.geoms = tuple(self._added[model.geom(number).name] for number in range(model.ngeom))
        self.frictions = np.array([geom.friction for geom in self.geoms]).reshape(-1, 3)

    def _place_moved(self, built: BuiltModel, number: int) -> None:
        mocap = built.model.body_mocapid[built.links[number, -1]]
        built.data.mocap_pos[mocap] = self._places[number]

    def _add_link(self, parent: Any, place: Pose, key: tuple[int, int], link: LinkPlan) -> Any:
        body = parent.add_body(name=_name(*key), pos=place.position, quat=wxyz(place.orientation))
        if link.inertia is not None:
            matrix = link.inertia.matrix
            body.explicitinertial = True
            body.mass = link.inertia.mass
            body.ipos = link.inertia.centre
            body.fullinertia = [float(matrix[row, column]) for row, column in _INERTIA_ORDER]
        if link.joint is not None:
            _add_joint(body, _name(*key), link.joint)
        for index, shape in enumerate(link.shapes):
            self._add_shape(body, (*key, index), Geom(*key, shape, link.friction))
        return body

    def _add_shape(self, body: Any, key: tuple[int, int, int], geom: Geom) -> None:
        name, shape = "/".join(map(str, key)), geom.shape
        a, b, c = shape.size
        half = {
            "box": (a / 2.0, b / 2.0, c / 2.0),
            "cylinder": (a, b / 2.0, 0.0),
            "capsule": (a, b / 2.0, 0.0),
        }
        named: dict[str, Any] = {"size": half.get(shape.kind, shape.size)}
        if shape.kind == "hull":
            corners = [part for corner in shape.corners for part in corner]
            self._spec.add_mesh(name=name, uservert=corners)
            named = {"meshname": name}
        body.add_geom(
            name=name,
            type=_KINDS[shape.kind],
            pos=shape.place.position,
            quat=wxyz(shape.place.orientation),
            mass=0.0,
            condim=_dimensions(geom.friction),
            solref=(_CONTACT_TIME, 1.0),
            solimp=_CONTACT_IMPEDANCE,
            **named,
        )
        self._added[name] = geom


def _add_pairs(spec: Any, added: Mapping[str, Geom], first: tuple[int, int], second: tuple[int, int]) -> None:
    """Add contacts of the shapes of two links, each given by the numbers of its body and of itself."""
    for (name, one), (other_name, other) in product(added.items(), repeat=2):
        if (one.body, one.link) == first and (other.body, other.link) == second:
            pair = spec.add_pair(geomname1=name, geomname2=other_name)
            pair.condim = max(_dimensions(one.friction), _dimensions(other.friction))
            pair.solref = (_CONTACT_TIME, 1.0)
            pair.solimp = _CONTACT_IMPEDANCE


def _dimensions(friction: Friction) -> int:
    """Return the dimensions of a contact: with friction about the normal, and rolling friction if any."""
    return 6 if friction.rolling > 0.0 else 4


def _empty_description() -> Any:
    """Return the description of an empty world, with the settings of the engine."""
    spec = mujoco.MjSpec()
    option = spec.option
    option.timestep = TICK / SUBSTEPS
    option.gravity = (0.0, 0.0, -GRAVITY)
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = _FRICTION_IMPEDANCE_RATIO
    option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ISLAND)
    spec.compiler.balanceinertia = True
    spec.compiler.degree = False
    return spec


def _add_joint(body: Any, name: str, plan: JointPlan) -> None:
    joint = body.add_joint(name=name, axis=plan.axis)
    joint.type = mujoco.mjtJoint.mjJNT_SLIDE if plan.slides else mujoco.mjtJoint.mjJNT_HINGE
    joint.armature = plan.armature
    joint.damping[0] = plan.damping
    joint.frictionloss = plan.friction
    joint.solref_friction[:2] = joint.solref_limit[:2] = (_CONTACT_TIME, 1.0)
    if plan.limits is not None:
        joint.limited = True
        joint.range = plan.limits


_INERTIA_ORDER: Final = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""Order of the moments of inertia in MuJoCo: xx, yy, zz, xy, xz, yz."""


def wxyz(orientation: Quaternion) -> tuple[float, float, float, float]:
    """Convert a quaternion to MuJoCo's order.

    Args:
        orientation: (x, y, z, w).

    Returns:
        (w, x, y, z).
    """
    x, y, z, w = orientation
    return (w, x, y, z)


def pose_of(position: Array, orientation: Array) -> Pose:
    """Convert a pose from MuJoCo's form.

    Args:
        position: (3,), m.
        orientation: (4,), in the order w, x, y, z.

    Returns:
        The pose.
    """
    x, y, z = position.tolist()
    w, a, b, c = orientation.tolist()
    return Pose((x, y, z), (a, b, c, w))


def _name(body: int, link: int) -> str:
    return f"{body}/{link}"
