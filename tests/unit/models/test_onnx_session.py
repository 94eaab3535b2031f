from __future__ import annotations

import threading

from aeros.models.onnx_session import OnnxSession, fitting_shape
from tests.unit.models.packages import doubling


def test_a_network_is_evaluated_in_its_own_units_and_this_thread() -> None:
    package = doubling()
    before = threading.active_count()
    session = OnnxSession(package.file, package.content, package.inputs, package.outputs)
    assert session.evaluate({"angle": (0.5, 1.0)}) == {"turned": (1.0, 2.0)}
    assert threading.active_count() == before


def test_a_file_may_have_a_batch_dimension() -> None:
    assert fitting_shape([1, 3], (3,)) == (1, 3)
    assert fitting_shape(["batch", 3], (3,)) == (1, 3)
    assert fitting_shape([3], (3,)) == (3,)
    assert fitting_shape([], ()) == ()
    assert fitting_shape([1], ()) == (1,)
    assert fitting_shape([2, 3], (3,)) is None
    assert fitting_shape([None], (3,)) is None
    assert fitting_shape(None, (3,)) is None
