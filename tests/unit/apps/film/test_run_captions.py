"""The captions of a stored run tell at each time what the gate decided, and why the robot waits."""

from __future__ import annotations

import pytest

from aeros.apps.film.run_captions import RunCaptions
from aeros.apps.report_page.run_data import RunData, read_run_data
from aeros.sim.film.captions import Caption, Status
from tests.unit.apps.film.runs import RUN, captions


@pytest.mark.parametrize(
    ("time", "status", "headline", "rule"),
    [
        (0.01, "allowed", "", ""),
        (
            4.2,
            "slowed",
            "person first at 1.60 m: speed 0.20 in place of 0.45 m/s",
            "reduced-speed-near-person",
        ),
        (4.52, "stopped", "person at 0.90 m, 0.93 m needed", "arm-separation"),
        (4.9, "waiting", "person at 0.83 m, 0.89 m needed", "arm-standing, arm-separation"),
    ],
)
def test_a_caption_tells_the_verdict_and_its_reason(
    time: float, status: Status, headline: str, rule: str
) -> None:
    caption = captions()(time)
    assert (caption.status, caption.headline, caption.rule) == (status, headline, rule)
    assert caption.skill == "make_dumplings.prepare"


def test_a_motion_has_a_path_and_values_have_their_bounds() -> None:
    caption = captions()(4.2)
    assert caption.action == "move tool at 0.20 m/s"
    assert len(caption.joint_path) > 5
    assert {len(joints) for joints in caption.joint_path} == {7}
    speed, force, distance = caption.gauges
    assert (speed.label, speed.is_upper, speed.unit) == ("tool speed", True, "m/s")
    assert speed.bound == pytest.approx(0.2)
    assert (force.bound, force.unit) == (65.0, "N")
    assert distance.label == "person"
    assert distance.value == pytest.approx(1.19, abs=0.05)
    assert distance.bound == pytest.approx(0.927, abs=0.001)
    assert caption.separation is not None
    assert caption.separation.slow == pytest.approx(2.3)
    assert [zone.name for zone in caption.zones] == ["bench_area"]
    assert caption.camera == "overhead"
    assert "wrapper" in {one.label for one in caption.detections}


def test_a_waiting_robot_has_no_path_and_still_a_needed_distance() -> None:
    caption = captions()(4.9)
    assert caption.joint_path == ()
    assert caption.action == "asked for: move tool at 0.10 m/s"
    assert caption.separation is not None
    assert caption.separation.stop == pytest.approx(0.886, abs=0.001)


def test_before_the_first_decision_and_without_a_site_captions_have_less() -> None:
    assert captions()(-1.0) == Caption()
    without = RunCaptions(read_run_data(RUN), {})(4.2)
    assert (without.status, without.gauges, without.zones) == ("slowed", (), ())
    assert RunCaptions(RunData(), {})(1.0) == Caption()
