"""Describe the bodies of a scene: shapes, and the links of URDF files, with their masses."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np

from aeros.sim.geometry import UPRIGHT, Pose, Vector3
from aeros.sim.mujoco.plans import (
    AT_ORIGIN,
    Friction,
    Inertia,
    JointPlan,
    LinkPlan,
    ShapePlan,
    inertia_of_shapes,
)
from aeros.sim.pictures.ray_caster import axes_of
from aeros.sim.pictures.solids import basin_boxes, solids_of_shape
from aeros.sim.pictures.urdf_model import UrdfVisuals, origin_of, vector_of
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.scene import Basin, Box, Compound, Cylinder, SceneBody, Sphere, UrdfModel


def plan_body(body: SceneBody) -> tuple[LinkPlan, ...]:
    """Describe a body of a scene.

    Args:
        body: the body.

    Returns:
        Its links, the base first.

    Raises:
        UserError: its URDF file is missing, or has a mesh.
    """
    if isinstance(body.shape, UrdfModel):
        return tuple(_plan_model(body, body.shape))
    shapes = tuple(_shapes(body.shape))
    inertia = inertia_of_shapes(body.mass, shapes) if body.is_movable else None
    friction = Friction(body.friction, body.spinning, body.rolling_resistance)
    visuals = tuple(solids_of_shape(body.shape, body.colour))
    return (LinkPlan(body.name, None, AT_ORIGIN, None, inertia, shapes, friction, visuals),)


def _shapes(shape: Box | Cylinder | Sphere | Basin | Compound) -> Iterator[ShapePlan]:
    match shape:
        case Box(edges):
            yield ShapePlan("box", edges)
        case Cylinder(radius, height):
            yield ShapePlan("cylinder", (radius, height, 0.0))
        case Sphere(radius):
            yield ShapePlan("sphere", (radius, 0.0, 0.0))
        case Basin(inner):
            for edges, middle in basin_boxes(inner):
                yield ShapePlan("box", edges, Pose(middle, UPRIGHT))
        case Compound(parts):
            for part in parts:
                for one in _shapes(part.shape):
                    yield one._replace(place=Pose(part.position, UPRIGHT))


def _plan_model(body: SceneBody, model: UrdfModel) -> Iterator[LinkPlan]:
    """Yield the links of a URDF file, each after its parent.

    Raises:
        UserError: it is missing, or has a mesh.
    """
    if not Path(model.path).is_file():
        missing = f"model file not found: `{model.path}`"
        raise UserError([Diagnostic("AE002", missing, help=("install AEROS again if it came with it",))])
    root = Xml.fromstring(Path(model.path).read_bytes())  # noqa: S314  it has been checked
    joints = {
        child.get("link", ""): joint for joint in root.iter("joint") for child in joint.findall("child")
    }
    visuals = UrdfVisuals(model.path).solids
    waiting = {link.get("name", ""): link for link in root.iter("link")}
    known: set[str | None] = {None}
    while waiting:
        name = next(name for name in waiting if _parent(joints.get(name)) in known)
        link, joint = waiting.pop(name), joints.get(name)
        known.add(name)
        shapes = tuple(_shape(one, model.path) for one in link.findall("collision"))
        yield LinkPlan(
            name,
            _parent(joint),
            AT_ORIGIN if joint is None else origin_of(joint),
            None if joint is None else _joint(joint, model),
            _inertia(link, shapes) if body.is_movable or joint is not None else None,
            shapes,
            Friction(model.link_friction.get(name, body.friction), body.spinning, body.rolling_resistance),
            tuple(solid for owner, solid in visuals if owner == name),
        )


def _parent(joint: Xml.Element | None) -> str | None:
    parent = None if joint is None else joint.find("parent")
    return None if parent is None else parent.get("link", "")


def _joint(joint: Xml.Element, model: UrdfModel) -> JointPlan | None:
    name, kind = joint.get("name", ""), joint.get("type")
    if name not in model.joints:
        return None
    axis, limit, dynamics = joint.find("axis"), joint.find("limit"), joint.find("dynamics")
    settings = model.joint_settings.get(name)
    limits = None
    if kind != "continuous" and limit is not None:
        limits = (float(limit.get("lower", 0)), float(limit.get("upper", 0)))
    if settings is not None and settings.range is not None:
        limits = settings.range
    return JointPlan(
        name,
        kind == "prismatic",
        (1.0, 0.0, 0.0) if axis is None else vector_of(axis, "xyz"),
        limits,
        0.0 if settings is None else settings.friction,
        0.0 if dynamics is None else float(dynamics.get("damping", 0)),
    )


def _inertia(link: Xml.Element, shapes: tuple[ShapePlan, ...]) -> Inertia:
    """Return the mass that the file declares; its inertia if there is one, else of the shapes."""
    inertial = link.find("inertial")
    if inertial is None:
        return inertia_of_shapes(0.0, shapes)
    mass, tensor = inertial.find("mass"), inertial.find("inertia")
    weight = 0.0 if mass is None else float(mass.get("value", 0))
    place = origin_of(inertial)
    if tensor is None:
        return inertia_of_shapes(weight, shapes)._replace(centre=place.position)
    xx, yy, zz, xy, xz, yz = (
        float(tensor.get(f"i{axes}", 0)) for axes in ("xx", "yy", "zz", "xy", "xz", "yz")
    )
    turn = axes_of(place.orientation)
    matrix = turn @ np.array(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))) @ turn.T
    return Inertia(weight, place.position, matrix)


def _shape(collision: Xml.Element, path: str) -> ShapePlan:
    place = origin_of(collision)
    for shape in collision.findall("geometry/*"):
        radius, length = float(shape.get("radius", 0)), float(shape.get("length", 0))
        match shape.tag:
            case "box":
                size: Vector3 = vector_of(shape, "size")
                return ShapePlan("box", size, place)
            case "cylinder":
                return ShapePlan("cylinder", (radius, length, 0.0), place)
            case "capsule":
                return ShapePlan("capsule", (radius, length, 0.0), place)
            case "sphere":
                return ShapePlan("sphere", (radius, 0.0, 0.0), place)
    problem = f"MuJoCo cannot load `{path}`: a link collides by a mesh"
    cure = "describe it by boxes, cylinders, capsules and spheres, or use `--plant physics`"
    raise UserError([Diagnostic("AE141", problem, help=(cure,))])
