"""Code in a worker: it is refused if it cannot be loaded, and its end is told in words."""

from __future__ import annotations

import signal

import pytest

from aeros.runtime.isolation.isolated_code import IsolatedCode, format_exit_code
from aeros.runtime.isolation.protocol import CloseSkill, LoadSkill, SkillClosed, WorkerConnection
from aeros.runtime.isolation.zygote_pool import ZygoteError, ZygotePool
from aeros.runtime.skills.code import CodeFile
from aeros.runtime.skills.contract import SkillRefusedError


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (None, "hung up or was killed"),
        (-9, "hung up or was killed"),
        (0, "ended with exit status 0"),
        (3, "ended with exit status 3"),
        (-11, "was killed by SIGSEGV"),
        (-200, "was killed by signal 200"),
    ],
)
def test_the_end_of_a_worker_in_words(code: int | None, words: str) -> None:
    assert format_exit_code(code) == words


def test_without_a_worker_the_code_is_refused() -> None:
    class Empty:
        def spawn_worker(self, *_: object) -> None:
            raise ZygoteError("the zygote is gone")

    with pytest.raises(SkillRefusedError, match="there is no worker for module `m`: the zygote is gone"):
        IsolatedCode(Empty(), "m")  # type: ignore[arg-type]


def load(source: bytes) -> LoadSkill:
    return LoadSkill(WorkerConnection.token(), (), CodeFile("m", "s.py", "/s.py", source), "lift", {})


def test_loaded_code_answers_until_its_worker_is_killed(bare: ZygotePool) -> None:
    code = IsolatedCode(bare, "m")
    code._load(load(b"def lift(o, i): yield"), 20.0)
    token = WorkerConnection.token()
    assert code._request(CloseSkill(token), 20.0) == SkillClosed(token, None)
    # The worker ends by itself when its connection closes, unless the kill arrives first.
    assert code._kill_worker() in (0, -signal.SIGKILL)
    assert code._kill_worker() is None


def test_code_that_is_rejected_leaves_no_worker(bare: ZygotePool) -> None:
    code = IsolatedCode(bare, "m")
    with pytest.raises(SkillRefusedError, match="has no generator function `lift`"):
        code._load(load(b""), 20.0)
    assert not code._is_alive
