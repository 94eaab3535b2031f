"""Errors of the agent: their reason is what people read, and it survives the way from another process."""

from __future__ import annotations

import pickle

import pytest

from aeros.agent.errors import AgentError
from aeros.agent.instructions.refusals import InstructionError
from aeros.spec.diagnostics.errors import UserError


def test_an_agent_error_is_a_users_error_that_says_its_reason() -> None:
    error = AgentError("another agent is awake")
    assert isinstance(error, UserError)
    assert (str(error), error.reason, error.diagnostics) == (
        "another agent is awake",
        "another agent is awake",
        (),
    )


@pytest.mark.parametrize("kind", [AgentError, InstructionError])
def test_an_error_of_another_process_keeps_its_kind_and_reason(kind: type[AgentError]) -> None:
    again = pickle.loads(pickle.dumps(kind("no task is named so")))  # noqa: S301 - pickled here
    assert type(again) is kind
    assert str(again) == "no task is named so"
