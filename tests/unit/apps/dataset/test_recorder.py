"""Frames of an episode come at a constant rate, and hold nothing that was measured after their time."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import pytest

from aeros.apps.dataset.recorder import EpisodeRecorder
from aeros.runtime.bus.message_publisher import RobotChain
from aeros.runtime.ports import Reading
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.text.discovery import reference_site_path

_CHAIN = RobotChain()


@pytest.fixture
def recorder() -> EpisodeRecorder:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    return EpisodeRecorder({name: site.state[name] for name in ("base_speed", "holding")})


def test_frames_come_at_a_constant_rate_with_the_newest_values(recorder: EpisodeRecorder) -> None:
    recorder.on_observed({"base_speed": Reading(0.0, 2.0), "holding": Reading(False, 2.0)}, _CHAIN)
    for tick in range(1, 61):
        now = 2.0 + tick / 240
        recorder.on_tick(now, {"base_speed": now, "holding": Reading(True, now - 0.001)}, _CHAIN)
    recorder.finish()
    assert [frame.time for frame in recorder.frames] == pytest.approx([2.0, 2.1, 2.2, 2.3])
    known: list[Any] = [frame.world.known for frame in recorder.frames]
    assert known[0] == {"base_speed": Fraction(0), "holding": False}
    speeds = [float(one["base_speed"]) for one in known]
    assert speeds[1:] == pytest.approx([2.1, 2.2, 2.25], abs=0.5 / 240)
    assert all(speed <= frame.time for speed, frame in zip(speeds, recorder.frames, strict=True))


def test_a_value_that_is_too_old_is_unknown(recorder: EpisodeRecorder) -> None:
    recorder.on_observed({"base_speed": Reading(0.5, 0.0)}, _CHAIN)
    recorder.on_observed({"holding": Reading(True, 1.0)}, _CHAIN)
    recorder.finish()
    assert len(recorder.frames) == 11
    assert recorder.frames[0].world.known == {"base_speed": Fraction(1, 2)}
    assert recorder.frames[5].world.known == {}
    assert recorder.frames[10].world.known == {"holding": True}


def test_a_run_that_measured_nothing_has_no_frames(recorder: EpisodeRecorder) -> None:
    recorder.finish()
    assert recorder.frames == []
