"""A plant's statement of a motion as a record holds it, and read back so that it can be decided again.

The points of a path are packed: a slide is made of 6,000 numbers, which as text take twice the room.
A body, which many motions have in common, is held once, and named by its digest.  What is not of the form
of a motion is held as it is, as far as a record can.
"""

from __future__ import annotations

import struct
from base64 import b64decode, b64encode
from collections.abc import Mapping
from dataclasses import fields
from itertools import chain, pairwise
from typing import Any

from aeros.runtime.canonical import restored
from aeros.runtime.ports import Ball, Body, Completion, Joints, Motionless, Path, Servo, Trajectory


def told_motion(plan: object, body: str) -> dict[str, Any]:
    """What a plant said that it would do; `body`: the digest of the body of a trajectory."""
    if type(plan) is Trajectory:
        paths, servo = plan.paths, plan.servo
        return {
            "body": body,
            "base": plan.base,
            "way": plan.way,
            "duration": plan.duration,
            "servo": _fields(servo) if type(servo) is Servo else servo,
            "paths": [_told_path(one) for one in paths] if type(paths) is tuple else paths,
        }
    if type(plan) is Motionless:
        return {"motionless": plan.why}
    if type(plan) is Completion:
        return {"completed": plan.completed, "reason": plan.reason}
    return {"unheard_of": plan}


def told_body(body: object) -> Any:
    """The body of a trajectory."""
    if type(body) is not Body:
        return body
    balls = body.balls
    listed = [list(one) if type(one) is Ball else one for one in balls] if type(balls) is tuple else balls
    return {**_fields(body), "balls": listed}


def read_motion(told: Any, bodies: Mapping[str, Any]) -> Any:
    """What was told, from what was read back of it; `bodies`: what was told of each, by digest.

    Raises KeyError, TypeError or ValueError for what nobody tells.
    """
    match told:
        case {"motionless": why}:
            return Motionless(why)
        case {"completed": completed, "reason": reason}:
            return Completion(completed, reason)
        case {"body": body, "base": base, "way": way, "duration": duration, "servo": servo, "paths": paths}:
            return Trajectory(
                _read_body(bodies[body]),
                tuple(map(_read_path, paths)) if type(paths) is list else restored(paths),
                _tuples(base),
                _tuples(way),
                restored(duration),
                Servo(**_read_fields(servo)) if _has_fields(servo, Servo) else restored(servo),
            )
        case {"unheard_of": plan}:
            return restored(plan)
    raise ValueError("it is no motion")


# Parts.


def _told_path(path: Any) -> Any:
    """Its points, each that two pieces share once, as doubles in base64; as it is where it is no path."""
    if not _is_path(path):
        return path
    numbers = [*chain(path[0][0], *(point for piece in path for point in piece[1:]))]
    packed = b64encode(struct.pack(f"<{len(numbers)}d", *numbers)).decode("ascii")
    return {"joints": len(path[0][0]), "points": packed}


def _is_path(path: Any) -> bool:
    """Whether it is all doubles, as many in each point, and each piece begins where the one before ends."""
    if type(path) is not tuple or not path or any(type(piece) is not tuple for piece in path):
        return False
    points = [*chain.from_iterable(path)]
    return (
        all(len(piece) == 4 for piece in path)
        and all(type(point) is tuple and len(point) == len(points[0]) > 0 for point in points)
        and all(type(number) is float for number in chain.from_iterable(points))
        and all(left[3] == right[0] for left, right in pairwise(path))
    )


def _read_path(told: Any) -> Path:
    match told:
        case {"joints": int(joints), "points": str(packed)}:
            raw = b64decode(packed, validate=True)
            if len(raw) % 8:
                raise ValueError("its points are no doubles")
            numbers = struct.unpack(f"<{len(raw) // 8}d", raw)
            points: list[Joints] = [*zip(*[iter(numbers)] * joints, strict=True)]
            return tuple([_piece(points[at : at + 4]) for at in range(0, len(points) - 1, 3)])
    path: Path = _tuples(told)
    return path


def _piece(points: list[Joints]) -> tuple[Joints, Joints, Joints, Joints]:
    a, b, c, d = points
    return a, b, c, d


def _read_body(told: Any) -> Any:
    if not _has_fields(told, Body):
        return _tuples(told)
    read = _read_fields(told)
    balls = read["balls"]
    if type(balls) is tuple:
        read["balls"] = tuple([Ball(*one) if type(one) is tuple else one for one in balls])
    return Body(**read)


def _fields(value: Body | Servo) -> dict[str, Any]:
    return {one.name: getattr(value, one.name) for one in fields(value)}


def _has_fields(told: Any, kind: type[Body | Servo]) -> bool:
    return type(told) is dict and told.keys() == {one.name for one in fields(kind)}


def _read_fields(told: Mapping[str, Any]) -> dict[str, Any]:
    return {name: _tuples(value) for name, value in told.items()}


def _tuples(plain: Any) -> Any:
    """What was read back, with tuples in place of lists."""
    if type(plain) is list:
        return tuple([_tuples(one) for one in plain])
    return restored(plain)
