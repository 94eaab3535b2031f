"""A registry, and operator commands, as an executor follows them."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.registry.control_page import ControlPage
from aeros.runtime.registry.operator_block import OperatorBlock
from aeros.runtime.registry.registry import Registry
from aeros.runtime.registry.registry_governor import OperatorCommands, RegistryGovernor
from tests.unit.runtime.registry.conftest import BASE, Author

RUN, PAUSE, STOP = OperatorCommand


@pytest.mark.parametrize(
    ("before", "resumed", "found"),
    [(STOP, False, RUN), (STOP, True, STOP), (PAUSE, False, PAUSE), (PAUSE, True, PAUSE), (RUN, False, RUN)],
)
def test_a_stop_ended_an_earlier_run_and_a_pause_holds_for_any(
    registry: Registry, before: OperatorCommand, resumed: bool, found: OperatorCommand
) -> None:
    with ControlPage(registry.folder) as page:
        page.request_command(before)
        with OperatorCommands(registry.folder, resumed=resumed) as commands:
            assert commands.command is found
            page.request_command(STOP)
            assert commands.command is STOP


def test_commands_are_closed_once_and_leave_no_file_open(registry: Registry) -> None:
    before = len(os.listdir("/proc/self/fd"))
    commands = OperatorCommands(registry.folder, resumed=False)
    commands.close()
    commands.close()
    with OperatorCommands(registry.folder, resumed=False):
        assert len(os.listdir("/proc/self/fd")) > before
    assert len(os.listdir("/proc/self/fd")) == before


@pytest.fixture
def active(registry: Registry, write: Author) -> Registry:
    registry.install(write())
    registry.configure("tidy")
    registry.activate("tidy")
    return registry


@pytest.fixture
def governor(active: Registry) -> Iterator[RegistryGovernor]:
    with RegistryGovernor(active) as made:
        yield made


def test_the_configuration_in_force_is_loaded_once_in_each_generation(
    active: Registry, governor: RegistryGovernor
) -> None:
    generation, configuration = governor.configuration()
    assert generation == governor.generation == active.snapshot().generation
    assert list(configuration.modules) == ["tidy"]
    assert governor.configuration()[1] is configuration
    report = governor.report
    active.deactivate("tidy")
    assert governor.generation == generation + 1
    assert governor.report is report
    assert (governor.configuration()[0], governor.configuration()[1].modules) == (generation + 1, {})
    assert governor.report is not report


def test_a_generation_is_held_on_the_page_of_the_registry(
    active: Registry, governor: RegistryGovernor
) -> None:
    with ControlPage(active.folder) as page:
        with governor.hold_generation(governor.generation) as is_latest:
            assert is_latest
            assert not page.is_idle(governor.generation)
        with governor.hold_generation(governor.generation - 1) as is_latest:
            assert not is_latest
        assert page.is_idle(governor.generation)


def _reason(governor: RegistryGovernor) -> str | None:
    return governor.revocation_reason("tidy", "rest", "wait")


def test_nothing_is_revoked_while_nothing_changes(governor: RegistryGovernor) -> None:
    assert _reason(governor) is None
    assert governor.revocation_reason("absent", "rest", "wait") == "`absent` is no longer active"


def test_a_module_that_is_no_longer_active_is_revoked(active: Registry, governor: RegistryGovernor) -> None:
    active.deactivate("tidy")
    assert _reason(governor) == "`tidy` is no longer active"


def test_a_module_of_another_version_is_revoked(
    active: Registry, governor: RegistryGovernor, write: Author
) -> None:
    active.install(write("newer", version="1.0.1"))
    assert _reason(governor) == "`tidy` now has another version"


def test_everything_is_revoked_under_another_policy(active: Registry, governor: RegistryGovernor) -> None:
    path = active.folder.parent / "other.yaml"
    path.write_text((BASE / "site.yaml").read_text() + "# another\n")
    active.set_policy(path)
    assert _reason(governor) == "another policy is in force"


def test_an_action_that_the_operator_blocks_is_revoked_and_no_other(
    active: Registry, governor: RegistryGovernor
) -> None:
    active.add_block(OperatorBlock("one", "wet floor", None, None, "grip"))
    assert _reason(governor) is None
    assert governor.revocation_reason("tidy", "rest", "grip") == "the operator blocks it: wet floor"
    active.remove_block("one")
    assert governor.revocation_reason("tidy", "rest", "grip") is None


def test_the_registry_is_read_once_in_each_generation(
    active: Registry, governor: RegistryGovernor, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[int] = []
    committed = Registry.committed_snapshot

    def counted(registry: Registry, page: ControlPage) -> object:
        read.append(page.generation)
        return committed(registry, page)

    monkeypatch.setattr(Registry, "committed_snapshot", counted)
    assert (_reason(governor), _reason(governor), read) == (None, None, [])
    active.add_block(OperatorBlock("one", "wet floor", None, None, "grip"))
    assert (_reason(governor), _reason(governor)) == (None, None)
    assert len(read) == 1


def test_a_change_in_progress_is_waited_for(active: Registry, monkeypatch: pytest.MonkeyPatch) -> None:
    committed = Registry.committed_snapshot
    unfinished = [None, None]

    def slow(registry: Registry, page: ControlPage) -> object:
        return unfinished.pop() if unfinished else committed(registry, page)

    monkeypatch.setattr(Registry, "committed_snapshot", slow)
    with RegistryGovernor(active) as governor:
        assert (unfinished, list(governor.configuration()[1].modules)) == ([], ["tidy"])
        unfinished.append(None)
        with ControlPage(active.folder) as page:
            page.publish(page.generation + 1)
        assert _reason(governor) is None
