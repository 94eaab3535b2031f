"""A worker of a perceiver maps its pictures for reading, then locks down, then runs the code."""

from __future__ import annotations

import mmap
import os
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from aeros.runtime.isolation import perceiver_worker as module
from aeros.runtime.isolation.layers import IsolationLayer
from aeros.runtime.isolation.perceiver_worker import PerceiverWorker
from aeros.runtime.isolation.protocol import (
    CloseSkill,
    LoadPerceiver,
    PerceivedValue,
    PictureFacts,
    PictureSlot,
    ResumePerceiver,
    ResumeSkill,
    SkillClosed,
    SkillLoaded,
    SkillRaised,
    SkillRejected,
    ValuesPerceived,
    WorkerResponse,
)
from aeros.runtime.skills.code import CodeFile

TOKEN = b"t" * 16
SLOTS = (PictureSlot("mast", 2, 1, 0, 64),)
FACTS = PictureFacts(1.5, (0.0, 0.0, 2.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 45.0, (4, 2))
LOOK = ResumePerceiver(TOKEN, 2.0, {"force": 3.0}, {"force": ((1.0, 2.0),)}, (FACTS,))


@pytest.fixture
def memory(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """Memory of a picture; this process is not locked down, and keeps its paths."""
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.setattr(sys, "path_importer_cache", dict(sys.path_importer_cache))
    descriptor = os.memfd_create("pictures")
    os.write(descriptor, bytes(range(6)).ljust(64) + np.array([1.0, 2.0], np.float32).tobytes())
    yield descriptor
    os.close(descriptor)


@pytest.fixture
def locked(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    done: list[Any] = []
    monkeypatch.setattr(module, "apply_layers", lambda *given: done.append(given))
    return done


def load(body: str, top: str = "") -> LoadPerceiver:
    source = f"{top}\ndef see(view):\n    {body}\n".encode()
    members: dict[str, tuple[str, ...]] = {"math": ("pi",)}
    return LoadPerceiver(
        TOKEN,
        ("seccomp",),
        1 << 26,
        CodeFile("m", "eye.py", "/eye.py", source),
        "see",
        members,
        ("list",),
        SLOTS,
        72,
    )


def answer(memory: int, body: str, *questions: Any) -> list[WorkerResponse]:
    worker = PerceiverWorker(7, memory)
    assert worker.handle(load(body)) == SkillLoaded(TOKEN)
    return [worker.handle(question) for question in questions or (LOOK,)]


def test_it_locks_down_with_the_memory_of_the_perceiver_before_the_code_runs(
    memory: int, locked: list[Any]
) -> None:
    rejected = PerceiverWorker(7, memory).handle(load("yield {}", "import os"))
    assert locked == [([IsolationLayer.SECCOMP], 7, 1 << 26)]
    assert sys.path == []
    assert rejected == SkillRejected(
        TOKEN, "the code of module `m` fails to load: ImportError: a perceiver may not import `os`"
    )


def test_without_a_layer_no_code_runs(memory: int, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*given: Any) -> None:
        raise PermissionError("no seccomp")

    monkeypatch.setattr(module, "apply_layers", refuse)
    worker = PerceiverWorker(7, memory)
    (why,) = [worker.handle(load("yield {}", "1 / 0"))]
    assert why == SkillRejected(TOKEN, "a layer of isolation cannot be applied: no seccomp")
    assert worker.handle(LOOK) == SkillRaised(TOKEN, "no perceiver is loaded")


@pytest.mark.usefixtures("locked")
def test_it_shows_the_memory_as_a_picture(memory: int) -> None:
    body = "yield {'rgb': list(view.pictures['mast'].rgb.ravel()), 'z': view.pictures['mast'].depth[0, 1]," \
        " 'force': view.readings['force'], 'at': view.samples['force'][0].time}"  # fmt: skip
    assert answer(memory, body) == [
        ValuesPerceived(
            TOKEN,
            {
                "rgb": PerceivedValue([0, 1, 2, 3, 4, 5]),
                "z": PerceivedValue(2.0),
                "force": PerceivedValue(3.0),
                "at": PerceivedValue(1.0),
            },
        )
    ]


@pytest.mark.usefixtures("locked")
def test_the_next_view_shows_what_the_memory_then_holds(memory: int) -> None:
    worker = PerceiverWorker(7, memory)
    worker.handle(load("while True: view = yield {'a': view.pictures['mast'].rgb[0, 0, 0]}"))
    with mmap.mmap(memory, 72) as shared:
        for value in (0, 9):
            shared[0] = value
            assert worker.handle(LOOK) == ValuesPerceived(TOKEN, {"a": PerceivedValue(value)})


@pytest.mark.usefixtures("locked")
@pytest.mark.parametrize(
    ("body", "why"),
    [
        ("yield 3", "the perceiver yielded a `int`, not a dict of values"),
        ("yield {'a': view}", "the perceiver yielded values that are not plain data"),
        ("yield {'a': 'x' * 70000}", "the perceiver yielded values of more than 65536 bytes"),
        ("yield {'a': 10 ** 30}", "the perceiver yielded values that are not plain data"),
        ("yield 1 / 0", "eye.py:3: ZeroDivisionError: division by zero"),
        ("return\n    yield", "the perceiver returned: it yields values for every view"),
    ],
)
def test_anything_but_values_is_described(memory: int, body: str, why: str) -> None:
    (response,) = answer(memory, body)
    assert isinstance(response, SkillRaised)
    assert response.reason.startswith(why)


@pytest.mark.usefixtures("locked")
def test_it_can_be_closed_and_answers_no_question_of_skills(memory: int) -> None:
    closed, wrong = answer(memory, "yield {}", CloseSkill(TOKEN), ResumeSkill(TOKEN, {}))
    assert closed == SkillClosed(TOKEN, None)
    assert wrong == SkillRaised(TOKEN, "no perceiver is loaded")
