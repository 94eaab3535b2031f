"""Hostile skills in real workers: whatever they try, nothing around them is harmed and the runtime goes on.

Each file in `probes/` is one skill.  The same files show that they can do harm: run in a worker that puts on
no layer, or in this process, they succeed.
"""

from __future__ import annotations

import builtins
import math
import os
import re
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.isolation.isolated_run import IsolatedRun
from aeros.runtime.isolation.limits import ProcessLimits
from aeros.runtime.isolation.zygote_pool import ZygotePool
from aeros.runtime.ports import StepStatus
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.runtime.skills.in_process_run import InProcessRun, SkillRunResult
from aeros.skill import Action, act
from tests.unit.runtime.isolation.conftest import PROBES, Start, probe_code
from tests.unit.runtime.isolation.support.surroundings import CONTENT, Surroundings, below

NAMES = sorted(path.stem for path in PROBES.glob("*.py"))
ATTACKS = [name for name in NAMES if "def attack(" in (PROBES / f"{name}.py").read_text()]

# These find nothing even in a worker without layers: it is born without descriptors, environment,
# terminal and privileges, and each invocation has a worker of its own.
ALWAYS_BLOCKED = {
    "become_another_user",
    "environment",
    "inherited_descriptors",
    "mount_memory",
    "second_mind",
    "terminal",
}
# These are blocked by some hosts themselves, whatever AEROS does: by Yama, a container's seccomp, settings.
# And where the runtime is root, a worker, which has given up its privileges, may not touch a root process.
HOST_MAY_BLOCK = {
    "io_ring",
    "ipv6_datagram",
    "kernel_keyring",
    "new_namespace",
    "read_runtime_file",
    "read_runtime_memory",
    "resolve_name",
    "shared_memory",
    "slow_bystander",
    "trace_bystander",
    "write_runtime_memory",
}

RAISED, TIMED_OUT = StepStatus.RAISED, StepStatus.TIMED_OUT
ENDINGS: dict[str, tuple[StepStatus, str]] = {
    "action_subclass": (RAISED, "yielded a `Forged`, not an action"),
    "ahead": (RAISED, "does not belong to the latest request"),
    "bytes_parameter": (RAISED, "malformed"),
    "crash": (RAISED, "was killed by SIGSEGV"),
    "deep": (RAISED, "malformed"),
    "drip": (TIMED_OUT, "did not answer within 1 s"),
    "empty": (RAISED, "malformed"),
    "endless_list": (RAISED, "not plain data"),
    "exhaust_memory": (RAISED, "MemoryError"),
    "exit": (RAISED, "ended with exit status 3"),
    "extra_field": (RAISED, "malformed"),
    "float_subclass": (RAISED, "not plain data"),
    "flood": (RAISED, "sent more than one answer"),
    "hang_up": (RAISED, "hung up or was killed"),
    "hostile_mapping": (RAISED, "not a dict"),
    "huge_integer": (RAISED, "not plain data"),
    "huge_text": (RAISED, "more than 65536 bytes"),
    "int_subclass": (RAISED, "not plain data"),
    "keyboard_interrupt": (RAISED, "KeyboardInterrupt"),
    "long_words": (RAISED, "ValueError"),
    "malformed": (RAISED, "malformed"),
    "many_outputs": (RAISED, "not a dict of at most 64 outputs"),
    "many_parameters": (RAISED, "not a dict of at most 64"),
    "nested_parameter": (RAISED, "malformed"),
    "no_action": (RAISED, "yielded a `dict`, not an action"),
    "no_characters": (RAISED, "not plain data"),
    "out_of_turn": (RAISED, "sent an unexpected response"),
    "oversized": (RAISED, "2147483648 bytes, more than 65536"),
    "patched_worker": (RAISED, "not plain data"),
    "recursion": (RAISED, "RecursionError"),
    "reduce": (RAISED, "not plain data"),
    "replay": (RAISED, "does not belong to the latest request"),
    "sleep": (TIMED_OUT, "did not answer within 1 s"),
    "spin": (TIMED_OUT, "did not answer within 1 s"),
    "spin_in_c": (TIMED_OUT, "did not answer within 1 s"),
    "str_subclass": (RAISED, "not plain data"),
    "system_exit": (RAISED, "SystemExit"),
    "twice": (RAISED, "sent more than one answer"),
    "unknown_frame": (RAISED, "malformed"),
    "wrong_types": (RAISED, "malformed"),
}
SPECIAL = {
    "changed_afterwards",
    "changed_inputs",
    "exit_at_load",
    "no_clean_up",
    "slow_clean_up",
    "spin_at_load",
    "strange_floats",
}


@pytest.fixture
def alive(nursery: ZygotePool, start: Start) -> Iterator[None]:
    """After the test the runtime's next skill runs as if nothing had been."""
    yield
    assert _results(start(nursery, "changed_afterwards", {})) == [
        act("ask", speed=0.1),
        act("ask", speed=0.2),
        SkillRunResult(StepStatus.FINISHED, ""),
    ]


def _results(run: IsolatedRun, most: int = 10) -> list[Action | SkillRunResult]:
    """Everything until the run ends."""
    results: list[Action | SkillRunResult] = []
    while len(results) < most and not (results and isinstance(results[-1], SkillRunResult)):
        results.append(run.resume({}, 60.0))
    run.close()
    return results


def test_every_probe_is_run() -> None:
    assert set(NAMES) == {*ATTACKS, *ENDINGS, *SPECIAL}
    assert len(NAMES) >= 30


@pytest.mark.parametrize("name", ATTACKS)
def test_an_attack_is_blocked(
    name: str, nursery: ZygotePool, start: Start, around: Surroundings, capfd: pytest.CaptureFixture[str]
) -> None:
    for _ in range(2):  # what one invocation leaves behind, the next would find
        first, *_ = _results(start(nursery, name, around.inputs))
        if isinstance(first, Action):
            assert first.kind == "blocked", first
        else:
            assert first.status is RAISED
        assert CONTENT not in str(first)
    assert around.harm() == []
    assert capfd.readouterr() == ("", "")


UNLIMITED = ProcessLimits(memory=2**40, processes=10**6)
"""Limits of a control group that holds nobody back; the host may have put the zygotes in one."""


@pytest.mark.parametrize("name", [name for name in ATTACKS if name not in ALWAYS_BLOCKED])
def test_the_same_attack_works_where_no_layer_is_put_on(
    name: str, bare: ZygotePool, start: Start, around: Surroundings
) -> None:
    first, *_ = _results(start(bare, name, around.inputs, layers=(), limits=UNLIMITED))
    if isinstance(first, Action) and first.kind == "blocked" and name in HOST_MAY_BLOCK:
        pytest.skip(f"this host blocks it by itself: {first.parameters['why']}")
    assert around.harm() or (isinstance(first, Action) and first.kind == "harmed"), first


@pytest.mark.usefixtures("alive")
@pytest.mark.parametrize("name", sorted(ENDINGS))
def test_a_skill_that_misbehaves_is_ended(
    name: str, nursery: ZygotePool, start: Start, around: Surroundings
) -> None:
    status, why = ENDINGS[name]
    within = 1.0 if status is TIMED_OUT else 20.0
    run = start(nursery, name, around.inputs, answer_within=within)
    began = time.monotonic()
    *asked, ending = _results(run)
    assert isinstance(ending, SkillRunResult)
    assert ending.status is status
    assert re.search(why, ending.reason), ending
    assert len(ending.reason) < 2000
    assert all(one == act("ask") for one in asked)
    assert time.monotonic() - began < 15
    assert around.harm() == []
    assert run.resume({}, 1.0) == SkillRunResult(RAISED, "the skill's process has ended")
    assert run.close() is None


@pytest.mark.usefixtures("alive")
@pytest.mark.parametrize(("name", "why"), [("spin_at_load", "does not answer"), ("exit_at_load", "status 0")])
def test_code_that_never_becomes_a_skill_is_refused(
    name: str, why: str, nursery: ZygotePool, start: Start
) -> None:
    with pytest.raises(SkillRefusedError, match=f"`hostile` fails to load: .*{why}"):
        start(nursery, name, {}, answer_within=1.0)


@pytest.mark.usefixtures("alive")
def test_a_clean_up_without_end_is_cut_off(nursery: ZygotePool, start: Start) -> None:
    run = start(nursery, "slow_clean_up", {})
    assert run.resume({}, 60.0) == act("ask")
    began = time.monotonic()
    assert run.close() == "TimeoutError: it took more than 1 s and was killed"
    assert time.monotonic() - began < 5


@pytest.mark.usefixtures("alive")
def test_a_skill_that_does_not_let_itself_be_closed_is_ended(nursery: ZygotePool, start: Start) -> None:
    run = start(nursery, "no_clean_up", {})
    assert run.resume({}, 60.0) == act("ask")
    assert run.close() == "RuntimeError: generator ignored GeneratorExit"


def test_strange_numbers_arrive_as_they_are_for_the_gate_to_decide(nursery: ZygotePool, start: Start) -> None:
    action, ending = _results(start(nursery, "strange_floats", {}))
    assert isinstance(action, Action)
    values = list(action.parameters.values())
    assert [type(value) for value in values] == [float] * 4
    assert math.isnan(values[0])
    assert values[1] == math.inf
    assert math.copysign(1.0, values[2]) == -1.0
    assert values[3] == 5e-324
    assert ending == SkillRunResult(StepStatus.FINISHED, "")


def test_inputs_changed_by_a_skill_are_the_runtimes_as_before(
    nursery: ZygotePool, start: Start, around: Surroundings
) -> None:
    inputs = around.inputs
    assert _results(start(nursery, "changed_inputs", inputs))[0] == act("ask", address=0)
    assert inputs == around.inputs


@pytest.mark.parametrize("name", ["hidden_grandchild", "fork_bomb"])
@pytest.mark.layers
@pytest.mark.parametrize("kind", ["bare", "wrapped"])
def test_processes_of_a_worker_die_with_it(
    name: str, kind: str, request: pytest.FixtureRequest, start: Start, around: Surroundings
) -> None:
    nursery: ZygotePool = request.getfixturevalue(kind)
    before = below(os.getpid())
    run = start(nursery, name, around.inputs, layers=(), limits=UNLIMITED)
    run.resume({}, 60.0)
    assert len(below(os.getpid())) > len(before) + 1
    run.close()
    assert below(os.getpid()) == before


@pytest.mark.deep
@pytest.mark.layers
@pytest.mark.parametrize("kind", ["bare", "wrapped"])
def test_processes_of_a_worker_die_when_the_zygote_is_killed(
    kind: str, request: pytest.FixtureRequest, start: Start, around: Surroundings
) -> None:
    nursery: ZygotePool = request.getfixturevalue(kind)
    run = start(nursery, "fork_bomb", around.inputs, layers=(), limits=UNLIMITED)
    run.resume({}, 60.0)
    before = below(os.getpid())
    run._zygote.kill()
    assert len(below(os.getpid())) < len(before) - 100
    run.close()


# What happens in this process instead: why code that the site does not trust never runs here.


def _in_process(name: str, inputs: dict[str, Any]) -> InProcessRun:
    code = probe_code(name)
    return InProcessRun(code.file.generator_function(code.function), inputs)


def test_in_process_a_skill_keeps_a_second_mind() -> None:
    try:
        first, second = (_in_process("second_mind", {}).resume({}, 1.0) for _ in range(2))
    finally:
        vars(builtins).pop("kept", None)
    assert isinstance(first, Action)
    assert isinstance(second, Action)
    assert (first.kind, second.kind) == ("blocked", "harmed")


def test_in_process_a_skill_passes_for_the_user() -> None:
    with pytest.raises(KeyboardInterrupt):
        _in_process("keyboard_interrupt", {}).resume({}, 1.0)


def test_in_process_objects_arrive_with_their_own_operators() -> None:
    action = _in_process("float_subclass", {}).resume({}, 1.0)
    assert isinstance(action, Action)
    assert action.parameters["speed"] <= 0.0


def test_in_process_files_are_read(tmp_path: Path) -> None:
    (tmp_path / "canary").write_text(CONTENT)
    action = _in_process("read_file", {"canary": str(tmp_path / "canary")}).resume({}, 1.0)
    assert action == act("harmed", got=CONTENT)
