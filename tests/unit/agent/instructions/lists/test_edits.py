"""Requests with a few words more or other ones, by which they ask for nothing or for another thing."""

from __future__ import annotations

import re
from functools import cache
from hashlib import sha256

import pytest
import yaml

from aeros.agent.instructions.meaning import Errand
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.understand import understand
from tests.unit.agent.instructions.lists.reference import LISTS, parametric_modules
from tests.unit.agent.instructions.lists.test_lists import FLOORS, REFUSE

EDITS: dict[str, list[str]] = yaml.safe_load((LISTS / "edits.yaml").read_text(encoding="utf-8"))
PLAIN = (
    "Clean the table.",
    "Bring me the red can.",
    "Make two dumplings.",
    "Put the blue block on the left.",
)
MAX_WORDS = 8
SAMPLE = 2
"""Requests of the lists that each edit is tried with beside `PLAIN`."""

NEGATIONS = ("not", "never", "don't", "hardly", "almost", "pretend to")
VERBS = re.compile(
    r"(?i)\b(?:bring|fetch|get|grab|put|move|take|clean|wipe|tidy|make|cook|boil|check|inspect)\b"
)
THINGS = re.compile(r"(?i)\b(?:table|can|block|dumplings?)\b")
MORE = re.compile(r"(?i)[,;:.!?] |\b(?:and|because|but|can (?:i|we|you)|for|if|or|please|so|then)\b|\.\.")
"""More than one plain request, or courtesy, before which some edits end."""


def errands_of(instruction: str) -> tuple[Errand, ...]:
    """Requests of an instruction; none if it is refused."""
    try:
        return understand(instruction, parametric_modules()).errands
    except InstructionError:
        return ()


@cache
def plain_requests() -> tuple[str, ...]:
    """Short requests of the lists that begin with their verb and ask for one thing."""
    requests = {
        case["say"]
        for name in FLOORS
        for case in yaml.safe_load((LISTS / f"{name}.yaml").read_text(encoding="utf-8"))
        if case["want"] != REFUSE and len(case["say"].split()) <= MAX_WORDS
    }
    return tuple(sorted(one for one in requests if VERBS.match(one) and not MORE.search(one)))


def drawn(number: int) -> tuple[str, ...]:
    """The plain requests, and more of the lists: those first by a digest of their words."""
    digests = sorted(plain_requests(), key=lambda one: sha256(one.encode()).hexdigest())
    return (*PLAIN, *digests[:number])


def edited(request: str, edit: str, *, is_before: bool) -> str:
    if is_before:
        return f"{edit} {request[0].lower()}{request[1:]}"
    space = "" if edit[0] in ",.?" else " "
    return request.rstrip(" .!?") + space + edit + ("" if edit[-1] in ".!?" else ".")


def moved(edits: list[str], requests: tuple[str, ...], *, is_before: bool) -> list[str]:
    texts = [edited(one, edit, is_before=is_before) for edit in edits for one in requests]
    return [text for text in texts if errands_of(text)]


@pytest.mark.parametrize(
    "instruction",
    [
        "it is too late to bring me the red can",
        "I am too tired to clean the table.",
        "before I was born they would make three, no, two dumplings",
        "Clean the table because it is dirty was a joke.",
        "Clean the table so we can eat is what my brother does.",
        "Make two dumplings is done.",
        "Make two dumplings is on the menu.",
        "Clean the table, my foot.",
        "Once it is done, bring me the can.",
        "do you make dumplings.",
        "so you want to clean the table?",
        "may I take the block?",
        "say inspect the table",
        "Clean the table. I was reading from a script.",
        "Fetch the block prior to wiping the table is unnecessary.",
        "people make dumplings",
        "robot to clean the table",
        "do not bring the can before wiping the table",
        "put the can down",
        "put your hand right up the block",
        "please pick up the can on the left and put it on the right",
        "bring the can to the left, and along with it the block",
        "Make sure the table was cleaned.",
        "The left half is clean. Clean it.",
        "put the can on the stand",
        "fetch the can and put it on the first stand",
        "put the can in front of you",
        "put the can down with your gripper",
        "put the block in your left hand",
        "I want a dumpling, then clean the table, then the can",
        "I'd like the table cleaned and the can",
        "if possible for the guests, clean the table",
        "The table is so clean it shines.",
        "the kids left the table so clean it is shiny",
        "make dumplings until there are two people",
        "can you make one?",
        "I'd rather have the table dirty",
        "do not first clean the table and then make dumplings",
        "do not check the table, then bring me the block",
        "rather than cleaning the table first, then making dumplings, fetch the can",
        "prepare to cook a dumpling",
        "fetch the can and the block is forbidden",
        "fetching the can, cleaning the table is forbidden",
        "if you were free you would clean the left half, actually no, the whole table",
        "get ready to make one dumpling, no, two dumplings",
        "get ready to bring me the can, sorry, I mean the block",
        "next week make one dumpling, no wait, two",
        "bring the can to the left, actually the right. On second thought, leave it.",
        "I used to take the can and bring it to me, then do the same with the block",
        "The table of Anna is dirty, clean it.",
        "I hate the other table, clean it.",
        "The can! Bring them both!",
        "they will please clean the table",
        "my wish is that nobody will please clean the table",
        "do not check the table and, if it is dirty, wipe it down",
    ],
)
def test_instructions_that_moved_the_robot_wrongly_are_refused(instruction: str) -> None:
    assert not errands_of(instruction)


@pytest.mark.deep
@pytest.mark.parametrize("is_before", [True, False])
def test_words_around_a_request_take_it_back(*, is_before: bool) -> None:
    edits = EDITS["before" if is_before else "after"]
    assert moved(edits, drawn(SAMPLE), is_before=is_before) == []


@pytest.mark.deep
def test_with_a_negation_before_the_verb_nothing_moves() -> None:
    texts = [VERBS.sub(rf"{no} \g<0>", one, count=1) for one in drawn(20) for no in NEGATIONS]
    moving = [text for text in texts if errands_of(text)]
    assert moving == []


@pytest.mark.deep
def test_an_unknown_thing_is_not_taken_for_a_known_one() -> None:
    texts = [THINGS.sub(thing, one) for one in drawn(20) for thing in ("zebra", "lamp", "neighbour's cat")]
    assert [text for text in texts if errands_of(text)] == []
