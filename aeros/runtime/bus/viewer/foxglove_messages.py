"""Messages of the ROS 2 package `foxglove_msgs`, by which viewers draw scenes and annotate pictures.

Fields are those of its release 3.2, and `foxglove_msgs/msg` has the definitions that a recording contains.
Viewers find fields by their names, so later releases with further fields understand them.
"""

from __future__ import annotations

from aeros.runtime.bus.messages import Int32, Message, Nanoseconds, Point, Quaternion, Time, Uint8, Vector3


class Duration(Message, frozen=True):
    """Time span.

    Attributes:
        sec: whole seconds.
        nanosec: nanoseconds beyond these, below 10⁹.
    """

    ros = "builtin_interfaces/msg/Duration"
    sec: Int32 = 0
    nanosec: Nanoseconds = 0


class PoseMessage(Message, frozen=True):
    """Place and orientation.

    Attributes:
        position: m.
        orientation: unit quaternion.
    """

    ros = "geometry_msgs/msg/Pose"
    position: Point = Point()
    orientation: Quaternion = Quaternion()


class Color(Message, frozen=True):
    """Colour.

    Attributes:
        r, g, b: red, green and blue from 0 to 1.
        a: opacity from 0 to 1.
    """

    ros = "foxglove_msgs/msg/Color"
    r: float = 0.0
    g: float = 0.0
    b: float = 0.0
    a: float = 1.0


class Point2(Message, frozen=True):
    """Place in a picture, from the upper left corner of its upper left pixel.

    Attributes:
        x, y: to the right and downwards, pixels.
    """

    ros = "foxglove_msgs/msg/Point2"
    x: float = 0.0
    y: float = 0.0


class CircleAnnotation(Message, frozen=True):
    """Circle in a picture.

    Attributes:
        timestamp: time of the picture.
        position: middle.
        diameter: pixels.
        thickness: of its line, pixels.
        fill_color, outline_color: colours.
    """

    ros = "foxglove_msgs/msg/CircleAnnotation"
    timestamp: Time = Time()
    position: Point2 = Point2()
    diameter: float = 0.0
    thickness: float = 1.0
    fill_color: Color = Color(a=0.0)
    outline_color: Color = Color()


class PointsAnnotation(Message, frozen=True):
    """Points or lines in a picture.

    Attributes:
        timestamp: time of the picture.
        type: 4 for a list of lines, of which each has two points.
        points: the points.
        outline_color: colour.
        outline_colors: colour of each line; empty if all have one.
        fill_color: colour inside.
        thickness: of the lines, pixels.
    """

    ros = "foxglove_msgs/msg/PointsAnnotation"
    timestamp: Time = Time()
    type: Uint8 = 4
    points: tuple[Point2, ...] = ()
    outline_color: Color = Color()
    outline_colors: tuple[Color, ...] = ()
    fill_color: Color = Color(a=0.0)
    thickness: float = 1.0


class TextAnnotation(Message, frozen=True):
    """Text in a picture.

    Attributes:
        timestamp: time of the picture.
        position: lower left corner.
        text: the text.
        font_size: pixels.
        text_color, background_color: colours.
    """

    ros = "foxglove_msgs/msg/TextAnnotation"
    timestamp: Time = Time()
    position: Point2 = Point2()
    text: str = ""
    font_size: float = 12.0
    text_color: Color = Color()
    background_color: Color = Color()


class ImageAnnotations(Message, frozen=True):
    """Annotations of a picture.

    Attributes:
        circles, points, texts: annotations.
    """

    ros = "foxglove_msgs/msg/ImageAnnotations"
    circles: tuple[CircleAnnotation, ...] = ()
    points: tuple[PointsAnnotation, ...] = ()
    texts: tuple[TextAnnotation, ...] = ()


class KeyValuePair(Message, frozen=True):
    """Named text about an entity.

    Attributes:
        key: name.
        value: text.
    """

    ros = "foxglove_msgs/msg/KeyValuePair"
    key: str = ""
    value: str = ""


class CubePrimitive(Message, frozen=True):
    """Box.

    Attributes:
        pose: of its middle.
        size: edges, m.
        color: colour.
    """

    ros = "foxglove_msgs/msg/CubePrimitive"
    pose: PoseMessage = PoseMessage()
    size: Vector3 = Vector3()
    color: Color = Color()


class SpherePrimitive(Message, frozen=True):
    """Ball.

    Attributes:
        pose: of its middle.
        size: diameters, m.
        color: colour.
    """

    ros = "foxglove_msgs/msg/SpherePrimitive"
    pose: PoseMessage = PoseMessage()
    size: Vector3 = Vector3()
    color: Color = Color()


class CylinderPrimitive(Message, frozen=True):
    """Cylinder along z.

    Attributes:
        pose: of its middle.
        size: diameters and height, m.
        bottom_scale, top_scale: factors on the diameter at its ends.
        color: colour.
    """

    ros = "foxglove_msgs/msg/CylinderPrimitive"
    pose: PoseMessage = PoseMessage()
    size: Vector3 = Vector3()
    bottom_scale: float = 1.0
    top_scale: float = 1.0
    color: Color = Color()


class TextPrimitive(Message, frozen=True):
    """Text in space.

    Attributes:
        pose: of the middle of its box.
        billboard: True to face the viewer.
        font_size: height of a line, m.
        scale_invariant: True if the size is in pixels of the screen.
        color: colour.
        text: the text.
    """

    ros = "foxglove_msgs/msg/TextPrimitive"
    pose: PoseMessage = PoseMessage()
    billboard: bool = True
    font_size: float = 0.05
    scale_invariant: bool = False
    color: Color = Color()
    text: str = ""


class ModelPrimitive(Message, frozen=True):
    """Mesh.

    Attributes:
        pose: of its origin.
        scale: factor along each axis.
        color: colour, if `override_color` is True.
        override_color: True to use `color` for the whole mesh.
        url: empty, as the file is in `data`.
        media_type: of the file.
        data: the file.
    """

    ros = "foxglove_msgs/msg/ModelPrimitive"
    pose: PoseMessage = PoseMessage()
    scale: Vector3 = Vector3(1.0, 1.0, 1.0)
    color: Color = Color()
    override_color: bool = True
    url: str = ""
    media_type: str = "model/gltf-binary"
    data: bytes = b""


class SceneEntity(Message, frozen=True):
    """SceneThing in a scene; it replaces what had its `id` on the topic before.

    Attributes:
        timestamp: time at which it was so.
        frame_id: frame of its coordinates.
        id: name on the topic.
        lifetime: time after which it disappears; zero for never.
        frame_locked: True to follow the frame as that moves.
        metadata: texts about it.
        arrows, lines, triangles: none.
        cubes, spheres, cylinders, texts, models: parts.
    """

    ros = "foxglove_msgs/msg/SceneEntity"
    timestamp: Time = Time()
    frame_id: str = ""
    id: str = ""
    lifetime: Duration = Duration()
    frame_locked: bool = False
    metadata: tuple[KeyValuePair, ...] = ()
    arrows: tuple[Message, ...] = ()
    cubes: tuple[CubePrimitive, ...] = ()
    spheres: tuple[SpherePrimitive, ...] = ()
    cylinders: tuple[CylinderPrimitive, ...] = ()
    lines: tuple[Message, ...] = ()
    triangles: tuple[Message, ...] = ()
    texts: tuple[TextPrimitive, ...] = ()
    models: tuple[ModelPrimitive, ...] = ()


class SceneUpdate(Message, frozen=True):
    """Change of a scene.

    Attributes:
        deletions: none.
        entities: new things, and things that have changed.
    """

    ros = "foxglove_msgs/msg/SceneUpdate"
    deletions: tuple[Message, ...] = ()
    entities: tuple[SceneEntity, ...] = ()
