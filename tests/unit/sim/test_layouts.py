"""What is concluded of pictures and touch, without a simulator."""

from __future__ import annotations

from math import pi

from aeros.sim.layouts.dumpling_bench import BELONGS, Inspector, WrapperSight

CLOSED = WrapperSight(BELONGS, 0.0, pi)
ON_ITS_EDGE = CLOSED._replace(fold=None)


def test_a_closed_wrapper_may_hide_its_filling() -> None:
    assert Inspector().look_down(CLOSED, None, 0.0)["filling_on_workspace"] is True


def test_a_wrapper_on_its_edge_hides_no_filling_unless_it_was_wrapped() -> None:
    inspector = Inspector()
    assert inspector.look_down(ON_ITS_EDGE, None, 0.0)["filling_on_workspace"] is False
    inspector.feel(1000.0)
    inspector.look_down(CLOSED, None, 1.0)
    assert inspector.look_across(filled=True) == {"dumpling_wrapped": True}
    assert inspector.look_down(ON_ITS_EDGE, None, 2.0)["filling_on_workspace"] is True
