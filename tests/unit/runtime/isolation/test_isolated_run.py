from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any

import pytest

from aeros.runtime.isolation.isolated_run import MIN_RESPONSE_TIMEOUT_S, IsolatedRun
from aeros.runtime.isolation.layers import APPLY_LAYER
from aeros.runtime.isolation.zygote_pool import ZygotePool
from aeros.runtime.ports import StepStatus
from aeros.runtime.skills.code import CodeFile
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.runtime.skills.in_process_run import SkillRunResult
from aeros.runtime.skills.load import CertifiedCode
from aeros.skill import Action, act
from tests.unit.runtime.isolation.support.surroundings import below

HEAD = "from aeros.skill import act\n"


def code(text: str, function: str = "lift") -> CertifiedCode:
    return CertifiedCode(
        CodeFile("handling", "skills.py", "/ecms/handling/skills.py", text.encode()), function
    )


STARTED: list[IsolatedRun] = []


def run(
    nursery: ZygotePool, text: str, inputs: dict[str, Any] | None = None, within: float = 20.0
) -> IsolatedRun:
    """A run that is closed after the test."""
    STARTED.append(IsolatedRun(nursery, APPLY_LAYER, code(text), inputs or {}, within))
    return STARTED[-1]


@pytest.fixture(autouse=True)
def _closed() -> Iterator[None]:
    yield
    while STARTED:
        STARTED.pop().close()


def test_a_worker_executes_neighbours_from_their_bytes_and_has_no_other_files(nursery: ZygotePool) -> None:
    text = HEAD + "from .legs import lift_leg\ndef lift(o, i):\n    yield lift_leg(o['x'])\n"
    legs = HEAD + "def lift_leg(x):\n    return act('say', x=1 / x)\n"
    file = code(text).file
    certified = CertifiedCode(file._replace(neighbours=(("legs.py", legs.encode()),)), "lift")
    STARTED.append(IsolatedRun(nursery, APPLY_LAYER, certified, {}, 20.0))
    assert STARTED[-1].resume({"x": 2.0}, 60.0) == act("say", x=0.5)
    STARTED.append(IsolatedRun(nursery, APPLY_LAYER, certified, {}, 20.0))
    why = "legs.py:3: ZeroDivisionError: division by zero"
    assert STARTED[-1].resume({"x": 0}, 60.0) == SkillRunResult(StepStatus.RAISED, why)
    with pytest.raises(SkillRefusedError, match=r"`handling` has no file for `\.legs`"):
        run(nursery, text)


def test_observations_and_inputs_arrive_as_they_were_sent(nursery: ZygotePool) -> None:
    text = HEAD + (
        "def lift(o, i):\n"
        "    while True:\n"
        "        kinds = [type(v).__name__ for v in (*o.values(), *i.values())]\n"
        "        x = o['tool'][0] + i['height']\n"
        "        o = yield act('say', kinds=kinds, x=x, tool=o['tool'], side=i['side'])\n"
    )
    skill = run(nursery, text, {"height": 0.1, "side": "left", "count": 3, "careful": True})
    observed = {"tool": (0.1, 0.2, 0.3), "human_distance": 2.5, "holding": False}
    for _ in range(3):
        action = skill.resume(observed, 60.0)
        assert action == act(
            "say",
            kinds=("tuple", "float", "bool", "float", "str", "int", "bool"),
            x=0.1 + 0.1,
            tool=(0.1, 0.2, 0.3),
            side="left",
        )
    assert skill.close() is None


def test_a_skill_that_finishes_and_one_that_fails(nursery: ZygotePool) -> None:
    done = run(nursery, HEAD + "def lift(o, i):\n    yield act('move')\n")
    assert [done.resume({}, 1.0), done.resume({}, 1.0)] == [
        act("move"),
        SkillRunResult(StepStatus.FINISHED, ""),
    ]
    assert done.close() is None
    failed = run(nursery, HEAD + "def lift(o, i):\n    yield act('move')\n    1 / 0\n")
    assert failed.resume({}, 1.0) == act("move")
    assert failed.resume({}, 1.0) == SkillRunResult(
        StepStatus.RAISED, "skills.py:4: ZeroDivisionError: division by zero"
    )
    assert failed.close() is None


@pytest.mark.parametrize(
    ("returned", "ending"),
    [
        ("{'at': [1.0, 2.0], 'n': 3}", SkillRunResult(StepStatus.FINISHED, "", {"at": (1.0, 2.0), "n": 3})),
        ("{}", SkillRunResult(StepStatus.FINISHED, "", {})),
        (
            "3",
            SkillRunResult(StepStatus.RAISED, "the skill returned a `int`, not a dict of at most 64 outputs"),
        ),
        (
            "{1: 2}",
            SkillRunResult(StepStatus.RAISED, "the skill returned an output whose name is not a string"),
        ),
        (
            "{'x': 'x' * 70_000}",
            SkillRunResult(StepStatus.RAISED, "the skill returns outputs of more than 65536 bytes"),
        ),
    ],
)
def test_the_return_value_of_a_skill_holds_its_outputs(
    nursery: ZygotePool, returned: str, ending: SkillRunResult
) -> None:
    skill = run(nursery, f"def lift(o, i):\n    return {returned}\n    yield\n")
    assert skill.resume({}, 1.0) == ending


def test_outputs_that_are_no_plain_data_are_not_taken(nursery: ZygotePool) -> None:
    ending = run(nursery, "def lift(o, i):\n    return {'x': object()}\n    yield\n").resume({}, 1.0)
    assert isinstance(ending, SkillRunResult)
    assert ending.status is StepStatus.RAISED
    assert ending.reason.startswith("the skill returns outputs that are not plain data")


def test_a_skills_own_clean_up_runs_and_its_error_is_reported(nursery: ZygotePool) -> None:
    text = HEAD + (
        "def lift(o, i):\n"
        "    try:\n"
        "        yield act('move')\n"
        "    finally:\n"
        "        raise ValueError('mine')\n"
    )
    skill = run(nursery, text)
    skill.resume({}, 1.0)
    assert skill.close() == "ValueError: mine"
    assert skill.close() is None


def test_a_skill_that_never_started_is_closed(nursery: ZygotePool) -> None:
    assert run(nursery, HEAD + "def lift(o, i):\n    yield act('move')\n").close() is None


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "no generator function `lift`"),
        ("def lift(o, i):\n    return None\n", "no generator function `lift`"),
        ("raise ValueError('no')", "fails to load: ValueError: no"),
        ("raise KeyboardInterrupt", "KeyboardInterrupt"),
        ("def lift(:", "fails to load: SyntaxError"),
        ("import socketserver", "fails to load: ModuleNotFoundError: No module named 'socketserver'"),
    ],
)
def test_code_that_is_not_a_skill_is_refused(nursery: ZygotePool, text: str, why: str) -> None:
    with pytest.raises(SkillRefusedError, match=why):
        run(nursery, text)


def test_numpy_computes_in_a_worker(nursery: ZygotePool) -> None:
    text = (
        "import numpy as np\n" + HEAD + "def lift(o, i):\n"
        "    matrix = np.linalg.inv(np.array([[2.0, 0.0], [0.0, 4.0]]))\n"
        "    yield act('move', x=float(matrix[0, 0] + np.linalg.norm(np.ones(4))))\n"
        "    yield act('move', x=matrix[0, 0])\n"
    )
    skill = run(nursery, text)
    assert skill.resume({}, 60.0) == act("move", x=2.5)
    ending = skill.resume({}, 60.0)
    assert isinstance(ending, SkillRunResult)
    assert ending.status is StepStatus.RAISED  # a NumPy scalar is a float with operators of its own
    skill.close()


def test_a_skill_that_loops_is_killed_when_its_timeout_passes(nursery: ZygotePool) -> None:
    skill = run(nursery, HEAD + "def lift(o, i):\n    while True: pass\n    yield\n", within=60.0)
    began = time.monotonic()
    ending = skill.resume({}, 0.01)
    assert isinstance(ending, SkillRunResult)
    assert ending.status is StepStatus.TIMED_OUT
    assert MIN_RESPONSE_TIMEOUT_S <= time.monotonic() - began < 10


def test_several_skills_in_flight_are_apart(nursery: ZygotePool) -> None:
    text = HEAD + "def lift(o, i):\n    for n in range(3):\n        yield act('say', who=i['who'], n=n)\n"
    skills = [run(nursery, text, {"who": who}) for who in "abc"]
    for n in range(3):
        assert [skill.resume({}, 60.0) for skill in skills] == [act("say", who=who, n=n) for who in "abc"]
    for skill in skills:
        skill.close()


def test_values_that_no_frame_holds_refuse_the_skill(nursery: ZygotePool) -> None:
    with pytest.raises(SkillRefusedError, match="fails to load"):
        run(nursery, HEAD + "def lift(o, i):\n    yield act('move')\n", {"count": 10**30})
    assert isinstance(run(nursery, HEAD + "def lift(o, i):\n    yield act('move')\n").resume({}, 1.0), Action)


def test_a_zygote_that_was_killed_is_replaced(bare: ZygotePool) -> None:
    text = HEAD + "def lift(o, i):\n    yield act('move')\n"
    first = run(bare, text)
    first._zygote.kill()
    ending = first.resume({}, 60.0)
    assert isinstance(ending, SkillRunResult)
    assert ending.status is StepStatus.RAISED
    second = run(bare, text)
    assert second.resume({}, 60.0) == act("move")
    second.close()


_RUNTIME = """
import sys, time
from aeros.runtime.isolation.isolated_run import IsolatedRun
from aeros.runtime.isolation.zygote_pool import ZygotePool
from aeros.runtime.skills.code import CodeFile
from aeros.runtime.skills.load import CertifiedCode
text = b"def lift(o, i):\\n    while True: pass\\n    yield\\n"
run = IsolatedRun(ZygotePool([]), (), CertifiedCode(CodeFile("m", "s.py", "/s.py", text), "lift"), {}, 600.0)
print("running", flush=True)
run.resume({}, 600.0)
"""


@pytest.mark.usefixtures("nursery")
def test_when_the_runtime_is_killed_its_workers_are_gone() -> None:
    with subprocess.Popen([sys.executable, "-c", _RUNTIME], stdout=subprocess.PIPE) as runtime:
        assert runtime.stdout is not None
        assert runtime.stdout.readline() == b"running\n"
        deadline = time.monotonic() + 60
        while len(family := below(runtime.pid)) < 2 and time.monotonic() < deadline:
            time.sleep(0.05)
        assert len(family) >= 2
        runtime.kill()
    deadline = time.monotonic() + 60
    while (left := {pid for pid in family if _lives(pid)}) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not left


def _lives(pid: int) -> bool:
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_the_memory_of_a_worker_is_that_beyond_its_zygote(nursery: ZygotePool) -> None:
    text = HEAD + (
        "def lift(o, i):\n"
        "    yield act('say')\n"
        "    held = bytearray(40_000_000)\n"
        "    yield act('say')\n"
        "    del held\n"
        "    yield act('say')\n"
    )
    skill, peaks = run(nursery, text), []
    for _ in range(3):
        skill.resume({}, 60.0)
        peaks.append(skill.memory_peak())
    small, large, later = peaks
    assert small is not None
    assert large is not None
    assert small < 20_000_000
    assert 40_000_000 <= large < 60_000_000
    assert later == large
    skill.close()
    assert skill.memory_peak() is None


CAREFUL = """from aeros.skill import ActionDenied, act

def lift(observed, inputs):
    try:
        yield act("move")
    except ActionDenied as denied:
        yield act("say", reason=str(denied), seen=denied.observed["near"])
    finally:
        yield act("say")
"""


def test_a_denial_is_raised_in_a_worker_as_in_this_process(nursery: ZygotePool) -> None:
    skill = run(nursery, CAREFUL)
    assert skill.resume({"near": 1}, 60.0) == act("move")
    assert skill.resume({"near": 2}, 60.0, "too near") == act("say", reason="too near", seen=2)
    assert skill.resume({"near": 3}, 60.0, "too far") == act("say")
    ending = skill.resume({"near": 4}, 60.0)
    assert isinstance(ending, SkillRunResult)
    assert ending.status is StepStatus.DENIED
    assert skill.close() is None
