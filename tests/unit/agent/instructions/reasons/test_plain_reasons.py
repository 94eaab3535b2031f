from __future__ import annotations

import pytest

from aeros.agent.instructions.grammar import parse_instruction
from aeros.agent.instructions.lexicon import task_phrases
from aeros.agent.instructions.reasons.plain_reasons import (
    require_no_retraction,
    require_plain_reason,
    without_statements,
)
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.segments import Link, Mood, Segment
from aeros.agent.instructions.understand import understand
from tests.unit.agent.instructions.lists.reference import reference_modules


def reasons_of(instruction: str) -> tuple[list[str], list[str]]:
    """Requests and reasons of a sentence."""
    (sentence,) = parse_instruction(instruction)
    kept, reasons = without_statements(sentence, task_phrases(reference_modules()))
    return [" ".join(one.words) for one in kept], [" ".join(one.words) for one in reasons]


@pytest.mark.parametrize(
    ("instruction", "request_", "reason"),
    [
        ("clean the table because guests are coming", "clean the table", "guests are coming"),
        ("since we want to eat, clean the table", "clean the table", "we want to eat"),
        ("the table is dirty, so clean it", "clean it", "the table is dirty"),
        ("clean the table, it is dirty", "clean the table", "it is dirty"),
        ("clean the table so that we can eat", "clean the table", "we can eat"),
    ],
)
def test_reasons_are_set_apart(instruction: str, request_: str, reason: str) -> None:
    assert reasons_of(instruction) == ([request_], [reason])


@pytest.mark.parametrize(
    ("words", "link", "is_plain"),
    [
        ("guests are coming", Link.ADJUNCT, True),
        ("we never do it", Link.ADJUNCT, True),
        ("nobody does it", Link.ADJUNCT, False),
        ("the table is not clean", Link.ADJUNCT, True),
        ("it rains when you do", Link.ADJUNCT, False),
        ("i want dumplings", Link.ADJUNCT, False),
        ("the can on the floor is mine", Link.START, False),
        ("the can on the floor is mine", Link.ADJUNCT, True),
        ("customers from town arrive at ten", Link.START, True),
        ("customers on the left arrive at ten", Link.START, False),
    ],
)
def test_more_than_a_reason_is_refused(words: str, link: Link, is_plain: bool) -> None:
    reason = Segment(Mood.REASON, tuple(words.split()), link, ("because",))
    tasks = task_phrases(reference_modules())
    if is_plain:
        require_plain_reason(reason, tasks, [])
        return
    with pytest.raises(InstructionError, match="only a reason"):
        require_plain_reason(reason, tasks, [])


def test_a_reason_stands_in_the_account() -> None:
    meaning = understand("clean the table because guests are coming", reference_modules())
    assert meaning.account == ("`guests are coming`: a reason, asks for nothing",)


@pytest.mark.parametrize(
    ("words", "may_retract"),
    [
        ("i changed my mind", True),
        ("it is a joke", True),
        ("it is not needed", True),
        ("the kids are hungry", False),
        ("the table is dirty", False),
    ],
)
def test_a_statement_after_a_request_may_take_it_back(words: str, may_retract: bool) -> None:
    reason = Segment(Mood.REASON, tuple(words.split()), Link.START)
    tasks = task_phrases(reference_modules())
    asked_for = [entry.routed for entry in tasks if entry.routed.module == "fetch_object"]
    if not may_retract:
        require_no_retraction([reason], tasks, asked_for)
        return
    with pytest.raises(InstructionError, match="may take back"):
        require_no_retraction([reason], tasks, asked_for)


@pytest.mark.parametrize(
    ("reason", "is_plain"),
    [("the table is not a mess", False), ("the table is not clean", True), ("the table is a mess", True)],
)
def test_a_denied_condition_is_a_reason_only_if_it_is_of_the_goal(reason: str, is_plain: bool) -> None:
    instruction = f"{reason}, clean it"
    if is_plain:
        assert len(understand(instruction, reference_modules()).errands) == 1
    else:
        with pytest.raises(InstructionError, match="is not needed"):
            understand(instruction, reference_modules())
