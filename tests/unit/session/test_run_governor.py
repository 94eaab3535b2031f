"""Ctrl-C during a run: the first asks for a stop, the second raises, and afterwards all is as before."""

from __future__ import annotations

import signal

import pytest

from aeros.runtime.execution.governor import FixedGovernor, OperatorCommand
from aeros.session.run_governor import RunGovernor
from tests.unit.runtime.bench import configuration


def test_the_first_interrupt_asks_for_a_stop_and_the_second_raises(capfd: pytest.CaptureFixture[str]) -> None:
    former = signal.getsignal(signal.SIGINT)
    with RunGovernor(FixedGovernor(configuration())) as governor:
        assert (governor.command, governor.is_interrupted) == (OperatorCommand.RUN, False)
        signal.raise_signal(signal.SIGINT)
        assert (governor.command, governor.is_interrupted) == (OperatorCommand.STOP, True)
        assert capfd.readouterr().err == "stopping the robot; press Ctrl-C again to exit at once\n"
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is former


def test_otherwise_it_is_the_governor_that_it_was_given() -> None:
    given = configuration()
    with RunGovernor(FixedGovernor(given)) as governor:
        assert governor.configuration() == (governor.generation, given)
        assert governor.revocation_reason("any", "skill", "at_all") is None
        with governor.hold_generation(governor.generation) as in_force:
            assert in_force
        with governor.hold_generation(governor.generation + 1) as in_force:
            assert not in_force
