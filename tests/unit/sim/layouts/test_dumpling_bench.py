"""What is concluded of pictures and touch, without a simulator."""

from __future__ import annotations

from math import pi

from aeros.sim.layouts.dumpling_bench import ALIGNED_POSITION, DumplingTracker, WrapperDetection

CLOSED = WrapperDetection(ALIGNED_POSITION, 0.0, pi)
ON_ITS_EDGE = CLOSED._replace(fold=None)


def test_a_closed_wrapper_may_hide_its_filling() -> None:
    assert DumplingTracker().add_overhead_view(CLOSED, None, 0.0)["filling_on_workspace"] is True


def test_a_wrapper_on_its_edge_hides_no_filling_unless_it_was_wrapped() -> None:
    inspector = DumplingTracker()
    assert inspector.add_overhead_view(ON_ITS_EDGE, None, 0.0)["filling_on_workspace"] is False
    inspector.add_press_force(1000.0)
    inspector.add_overhead_view(CLOSED, None, 1.0)
    assert inspector.add_side_view(filled=True) == {"dumpling_wrapped": True}
    assert inspector.add_overhead_view(ON_ITS_EDGE, None, 2.0)["filling_on_workspace"] is True
