"""Messages of viewers against the definitions that recordings contain, and through ROS 2's encoding."""

from __future__ import annotations

from typing import Any, get_type_hints

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from aeros.runtime.bus.cdr import CdrEncoder
from aeros.runtime.bus.messages import Message, Point, Time, Uint8
from aeros.runtime.bus.viewer import foxglove_messages as module
from aeros.runtime.bus.viewer.foxglove_messages import (
    Color,
    CubePrimitive,
    ModelPrimitive,
    PoseMessage,
    SceneEntity,
    SceneUpdate,
)
from tests.repo.tree import ROOT
from tests.unit.runtime.bus.test_messages import of_ros, spelt

FOLDER = ROOT / "aeros" / "runtime" / "bus" / "foxglove_msgs" / "msg"
SHAPES = {
    one.ros: one
    for one in vars(module).values()
    if isinstance(one, type) and issubclass(one, Message) and one.__module__ == module.__name__
}
UNUSED = {"arrows", "cylinders", "lines", "triangles", "deletions"}
"""Fields whose messages have no class, as they are always empty."""


def definitions() -> dict[str, list[tuple[str, str]]]:
    store = get_typestore(Stores.ROS2_HUMBLE)
    found: dict[str, Any] = {}
    for path in FOLDER.iterdir():
        found |= get_types_from_msg(path.read_text(), f"foxglove_msgs/msg/{path.stem}")
    store.register(found)
    return {name: [(field, of_ros(node)) for field, node in one[1]] for name, one in store.fielddefs.items()}


@pytest.mark.parametrize("name", sorted(SHAPES))
def test_fields_are_those_of_the_definition(name: str) -> None:
    shape = SHAPES[name]
    hints = get_type_hints(shape, include_extras=True)
    kinds = {
        field: tuple[Uint8, ...] if hints[field] is bytes else hints[field]
        for field in shape.__struct_fields__
    }
    ours = [(field, None if field in UNUSED else spelt(kind)) for field, kind in kinds.items()]
    theirs = [(field, None if field in UNUSED else kind) for field, kind in definitions()[name]]
    assert ours == theirs


def test_a_scene_goes_through_the_encoding_of_ros_unchanged() -> None:
    cube = CubePrimitive(PoseMessage(Point(1.0, 2.0, 3.0)), color=Color(0.5, 0.25, 0.0, 0.125))
    entity = SceneEntity(Time(1, 2), "world", "zone", cubes=(cube,), models=(ModelPrimitive(data=b"glTF"),))
    encoder = CdrEncoder()
    there: Any = encoder.store.deserialize_cdr(
        encoder.encode(SceneUpdate(entities=(entity,))), SceneUpdate.ros
    )
    (found,) = there.entities
    assert (found.id, found.timestamp.nanosec, found.cubes[0].color.g) == ("zone", 2, 0.25)
    assert found.cubes[0].pose.position.z == 3.0
    assert found.models[0].data.tobytes() == b"glTF"
    assert "foxglove_msgs/SceneEntity[] entities" in encoder.definition(SceneUpdate)
