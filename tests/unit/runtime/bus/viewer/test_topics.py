"""The topics of a recording are those that a feed makes publishers for."""

from __future__ import annotations

from aeros.runtime.bus.feed import BusFeed
from aeros.runtime.bus.viewer.topics import topics_of
from aeros.spec.model.site import Site
from tests.unit.runtime.bus.test_message_publisher import Topics
from tests.unit.runtime.bus.viewer.test_things import with_variables


def test_they_are_those_of_a_feed(site: Site) -> None:
    bus, cameras = Topics(), {"m.look": {"top"}}
    whole = with_variables(site)
    with BusFeed(bus, whole, cameras=cameras):
        pass
    found = topics_of(whole, cameras)
    assert found == tuple(sorted(bus.kinds))
    assert {"/joint_states", "/aeros/things", "/aeros/camera/top/annotations"} <= set(found) | {
        "/joint_states"
    }
