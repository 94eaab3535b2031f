"""The motion section of a site file: its form alone."""

from __future__ import annotations

import pytest

from aeros.spec.declared.decode import decode
from aeros.spec.declared.motion import Barrier
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import Source
from aeros.spec.text.yaml_reader import read_yaml

_FENCE = "{id: fence, volume: cell, keep: in, rationale: people}"


def barrier(text: str) -> tuple[Barrier | None, list[str]]:
    sink = Diagnostics()
    node = read_yaml(Source("site.yaml", text), sink)
    assert node is not None
    return decode(node, Barrier, sink), [one.code for one in sink]


def test_a_barrier_is_in_the_world_frame_and_for_all_links_unless_it_says_so() -> None:
    fence, message = barrier(_FENCE)
    assert message == []
    assert fence is not None
    assert (fence.keep.value, fence.frame, fence.links) == ("in", None, None)


@pytest.mark.parametrize(
    ("old", "new"), [("keep: in", "keep: near"), ("id: fence", "id: My Fence"), (", rationale: people", "")]
)
def test_a_barrier_of_another_form_is_refused(old: str, new: str) -> None:
    fence, message = barrier(_FENCE.replace(old, new))
    assert fence is None
    assert len(message) == 1
