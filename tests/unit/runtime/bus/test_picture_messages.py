"""Pictures of cameras as messages that another decoder reads."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any, cast

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.bus.feed import BusFeed
from aeros.runtime.bus.in_process import InProcessBus
from aeros.runtime.bus.listened_plant import ListenedPlant
from aeros.runtime.bus.messages import CompressedImage
from aeros.runtime.bus.picture_messages import picture_message
from aeros.runtime.bus.recording.bag import McapFile
from aeros.runtime.ports import CameraPicture, CameraView, Plant
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.text.discovery import reference_site_path
from tests.hypothesis_profiles import examples
from tests.unit.runtime.bus.test_messages import STORE, plain

Image = pytest.importorskip("PIL.Image", reason="another decoder of PNG")
VIEW = CameraView((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 60.0)


def picture_of(width: int, height: int, rgb: bytes, time: float = 1.5) -> CameraPicture:
    return CameraPicture("overhead", time, width, height, rgb, None, VIEW)


@examples(20)
@given(st.integers(1, 9), st.integers(1, 9), st.data())
def test_the_colours_are_those_of_the_picture(width: int, height: int, data: st.DataObject) -> None:
    rgb = data.draw(st.binary(min_size=3 * width * height, max_size=3 * width * height))
    message = picture_message(picture_of(width, height, rgb))
    assert (message.format, message.header.frame_id) == ("png", "overhead")
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (1, 500_000_000)
    decoded = Image.open(io.BytesIO(bytes(message.data)))
    assert (decoded.size, decoded.mode) == ((width, height), "RGB")
    assert decoded.tobytes() == rgb


def test_a_recording_has_it_as_ros_encodes_it(tmp_path: Path) -> None:
    from mcap.reader import make_reader

    message = picture_message(picture_of(2, 1, bytes(range(6))))
    with McapFile(tmp_path / "run.mcap") as file:
        file.publisher("/aeros/camera/overhead/compressed", CompressedImage).publish(message)
    with (tmp_path / "run.mcap").open("rb") as opened:
        ((_, channel, kept),) = make_reader(opened).iter_messages()
    there = STORE.deserialize_cdr(kept.data, "sensor_msgs/msg/CompressedImage")
    assert channel.topic == "/aeros/camera/overhead/compressed"
    assert msgspec.convert(plain(there), CompressedImage) == message


class Camera:
    """A plant with one camera; it measures nothing."""

    def __init__(self) -> None:
        self.time = 0.0

    def observe(self) -> dict[str, Any]:
        return {}

    def pictures(self) -> dict[str, CameraPicture]:
        return {"overhead": picture_of(2, 1, bytes(6), self.time)}


def test_each_picture_is_published_once_and_the_newest_again_to_later_readers() -> None:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    bus = InProcessBus()
    seen = bus.subscribe("/aeros/camera/overhead/compressed", CompressedImage)
    camera = Camera()
    with BusFeed(bus, site) as feed:
        ListenedPlant(cast("Plant", camera), feed)
    first = seen.receive()  # before any observation
    assert first is not None
    assert first.header.stamp.sec == 0
    with BusFeed(bus, site) as feed:
        plant = ListenedPlant(cast("Plant", camera), feed)
        for time in (0.0, 0.0, 2.0, 2.0):
            camera.time = time
            plant.observe()
    assert feed.lost == 0
    times = []
    while (message := seen.receive()) is not None:
        times.append(message.header.stamp.sec)
    assert times == [0, 2]
    later = bus.subscribe("/aeros/camera/overhead/compressed", CompressedImage).receive()
    assert later is not None
    assert later.header.stamp.sec == 2
