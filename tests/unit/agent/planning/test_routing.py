from __future__ import annotations

from aeros.agent.planning.routing import RoutedTask
from tests.unit.agent.dumplings import MAKE_DUMPLINGS


def test_a_routed_task_is_written_as_module_and_task() -> None:
    assert str(RoutedTask("dumpling", MAKE_DUMPLINGS)) == "dumpling.make_dumplings"
