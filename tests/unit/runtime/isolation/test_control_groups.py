"""Control groups bound processor time and memory, end with their users, and are made where they may be."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from aeros.runtime.isolation import zygote_pool as pools
from aeros.runtime.isolation.control_groups import ControlGroupError, ControlGroups
from aeros.runtime.isolation.isolated_run import IsolatedRun
from aeros.runtime.isolation.layers import IsolationLayer
from aeros.runtime.isolation.limits import ProcessLimits
from aeros.runtime.isolation.zygote_pool import Zygote, ZygoteError, ZygotePool
from aeros.runtime.ports import StepStatus
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.runtime.skills.in_process_run import SkillRunResult
from aeros.skill import act
from tests.host_layers import require_layers
from tests.unit.runtime.isolation.support.spinning import FORK_AND_SPIN, SPIN, share_used, start

TOLERANCE = 0.1
"""Share of a core that a worker may have beyond its own: what the kernel lets run on, and then takes off."""

HOARD = """
from aeros.skill import act
def lift(observed, inputs):
    yield act("ready")
    kept = b"x" * (96 << 20)
    yield act("kept")
"""


@pytest.fixture(scope="module")
def grouped() -> Iterator[ZygotePool]:
    """Zygotes whose workers are in control groups."""
    require_layers("cgroups")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pools, "find_bubblewrap", lambda: None)
        pool = ZygotePool(["time"])
    assert pool.missing[IsolationLayer.CGROUPS] is None, "the host offers them, as tests/host_layers.py found"
    yield pool
    pool.close()


def folders_of(run: IsolatedRun) -> list[Path]:
    group = run._zygote._group
    assert group is not None
    return [folder for _, folder in group._folders]


@pytest.mark.layers
@pytest.mark.parametrize("share", [0.1, 0.4])
def test_a_worker_that_spins_gets_its_share_and_is_timed_out(grouped: ZygotePool, share: float) -> None:
    run = start(grouped, SPIN, ProcessLimits(processor=share))
    assert run.resume({}, 20.0) == act("ready")
    used, ended = share_used(run)
    assert 0 < used <= share + TOLERANCE
    assert ended.status is StepStatus.TIMED_OUT


@pytest.mark.layers
def test_all_processes_of_a_worker_share_its_share(grouped: ZygotePool) -> None:
    run = start(grouped, FORK_AND_SPIN, ProcessLimits(processor=0.2))
    assert run.resume({}, 20.0) == act("ready")
    used, _ = share_used(run)
    assert 0 < used <= 0.2 + TOLERANCE


@pytest.mark.layers
def test_a_worker_without_a_limit_on_its_own_memory_has_that_of_its_group(grouped: ZygotePool) -> None:
    enough = start(grouped, HOARD, ProcessLimits(memory=128 << 20))
    assert [enough.resume({}, 20.0), enough.resume({}, 20.0)] == [act("ready"), act("kept")]
    enough.close()
    run = start(grouped, HOARD, ProcessLimits(memory=16 << 20))
    if not any((folder / "memory.limit_in_bytes").exists() for folder in folders_of(run)):
        run.close()
        pytest.skip("the controller `memory` offers no group here")
    assert run.resume({}, 20.0) == act("ready")
    ended = run.resume({}, 20.0)
    assert isinstance(ended, SkillRunResult)
    assert "hung up or was killed" in ended.reason


@pytest.mark.layers
def test_groups_are_removed_with_their_zygotes() -> None:
    require_layers("cgroups")
    pool = ZygotePool([])
    run = start(pool, SPIN, ProcessLimits())
    folders = folders_of(run)
    assert folders
    assert all(folder.is_dir() for folder in folders)
    run.close()
    pool.close()
    assert not any(folder.exists() for folder in folders)


KILLED = """
import sys, time
from aeros.runtime.isolation.limits import ProcessLimits
from aeros.runtime.isolation.zygote_pool import ZygotePool
from tests.unit.runtime.isolation.support.spinning import SPIN, start
run = start(ZygotePool([]), SPIN, ProcessLimits(processor=0.5))
print(*(folder for _, folder in run._zygote._group._folders), flush=True)
time.sleep(600)
"""


@pytest.mark.layers
def test_groups_of_a_runtime_that_was_killed_are_removed_by_the_next_and_others_stay() -> None:
    require_layers("cgroups")
    command = [sys.executable, "-c", KILLED]
    with (
        subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as killed,
        subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as alive,
    ):
        try:
            assert killed.stdout is not None
            assert alive.stdout is not None
            left = [Path(one) for one in killed.stdout.readline().split()]
            used = [Path(one) for one in alive.stdout.readline().split()]
            assert left
            assert used
            os.kill(killed.pid, signal.SIGKILL)
            killed.wait()
            deadline = time.monotonic() + 20.0
            while any(folder.exists() for folder in left) and time.monotonic() < deadline:
                ControlGroups()  # its zygote needs a moment to notice, and to end the worker
                time.sleep(0.01)
            assert not any(folder.exists() for folder in left)
            assert all(folder.is_dir() for folder in used)
        finally:
            for one in (killed, alive):
                one.kill()


@pytest.mark.layers
def test_a_group_that_somebody_removed_is_replaced(grouped: ZygotePool) -> None:
    run = start(grouped, SPIN, ProcessLimits())
    folders, zygote = folders_of(run), run._zygote
    run.close()
    for folder in folders:
        folder.rmdir()
    with pytest.raises(ZygoteError, match="the worker has no control group: no limits can be set"):
        zygote.spawn_worker(None, ProcessLimits(), ControlGroups())
    again = start(grouped, SPIN, ProcessLimits())
    assert again._zygote is not zygote
    assert again.resume({}, 20.0) == act("ready")
    again.close()


def test_groups_with_other_names_are_somebody_elses(tmp_path: Path) -> None:
    tree(tmp_path, {".": "cpu"})
    others = ["aeros-web", "aeros-0123456789abcde", "aeros-0123456789abcdef0", "aeros-0123456789ABCDEF"]
    for name in (*others, "aeros-0123456789abcdef"):
        (tmp_path / name).mkdir()
    ControlGroups(mounted(("/", tmp_path, "cgroup2", "rw")), "0::/\n")
    assert sorted(one.name for one in tmp_path.glob("aeros-*")) == sorted(others)


@pytest.mark.layers
def test_below_a_group_that_has_less_than_a_core_there_are_no_groups() -> None:
    require_layers("cgroups")
    outer, groups = ControlGroups().make(), ControlGroups()
    zygote = Zygote([], None)
    try:
        outer.set_limits(ProcessLimits(processor=0.5))
        groups._hierarchies = tuple(replace(one, folder=folder) for one, folder in outer._folders)
        assert "no limits can be set" in str(zygote.probe_group(groups))
    finally:
        zygote.close()
        outer.close()


def test_a_worker_that_cannot_enter_its_group_runs_no_code(
    bare: ZygotePool, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The entrance is a descriptor that cannot be written, as of a group that was removed meanwhile."""
    entrance = os.open(tmp_path, os.O_RDONLY)
    send = socket.send_fds
    monkeypatch.setattr(
        socket, "send_fds", lambda channel, words, fds: send(channel, words, [*fds, entrance])
    )
    with pytest.raises(SkillRefusedError, match="its process could not enter its control group"):
        start(bare, SPIN, ProcessLimits())
    os.close(entrance)


def tree(root: Path, groups: dict[str, str]) -> None:
    """Make folders that look like groups of version 2, by the controllers that each passes on."""
    for name, controllers in groups.items():
        (root / name).mkdir(parents=True, exist_ok=True)
        (root / name / "cgroup.subtree_control").write_text(controllers)


def mounted(*mounts: tuple[str, Path, str, str]) -> str:
    """Text as in `/proc/self/mountinfo`, of root, folder, kind and options of each mount."""
    return "".join(
        f"3{number} 24 0:30 {root} {folder} rw,nosuid shared:9 - {kind} {kind} {options}\n"
        for number, (root, folder, kind, options) in enumerate(mounts)
    )


@pytest.mark.parametrize(
    ("groups", "parent"),
    [
        ({".": "cpu memory", "user": "cpu memory", "user/me": ""}, "user"),
        ({".": "cpu memory pids", "user": "memory", "user/me": ""}, "."),
        ({".": "cpu", "user": "cpu", "user/me": "cpu"}, "user/me"),
    ],
)
def test_in_version_2_groups_are_made_below_the_nearest_group_that_bounds_its_children(
    groups: dict[str, str], parent: str, tmp_path: Path
) -> None:
    tree(tmp_path, groups)
    found = ControlGroups(mounted(("/", tmp_path, "cgroup2", "rw")), "0::/user/me\n")
    group = found.make()
    ((hierarchy, folder),) = group._folders
    assert folder.parent == tmp_path / parent
    for name in hierarchy.controllers:
        (folder / f"{name}.max").touch()
    group.set_limits(ProcessLimits(memory=2**20, processor=0.25))
    assert (folder / "cpu.max").read_text() == "25000 100000"
    if "pids" in hierarchy.controllers:
        assert (folder / "pids.max").read_text() == "32"
    if "memory" in hierarchy.controllers:
        assert int((folder / "memory.max").read_text()) == 2**20 + 2**26
    (folder / "cpu.stat").write_text("usage_usec 7\nnr_periods 3\nnr_throttled 2\n")
    assert group.throttled_periods() == 2


def test_in_a_container_a_part_of_the_hierarchy_may_be_mounted(tmp_path: Path) -> None:
    (tmp_path / "inner").mkdir()
    mounts = mounted(("/docker/abc", tmp_path, "cgroup", "rw,cpu,cpuacct"))
    group = ControlGroups(mounts, "3:cpu,cpuacct:/docker/abc/inner\n0::/\n").make()
    ((_, folder),) = group._folders
    assert folder.parent == tmp_path / "inner"
    group.close()
    assert not folder.exists()


@pytest.mark.parametrize("groups", [{".": "memory"}, {".": "", "user": "memory pids"}])
def test_without_the_controller_there_are_no_groups(groups: dict[str, str], tmp_path: Path) -> None:
    tree(tmp_path, {**groups, "user/me": ""})
    with pytest.raises(ControlGroupError, match="no control group with the controller `cpu`"):
        ControlGroups(mounted(("/", tmp_path, "cgroup2", "rw")), "0::/user/me\n")
    with pytest.raises(ControlGroupError, match="no control group with the controller `cpu`"):
        ControlGroups("", "")


def test_limits_that_the_kernel_lacks_are_an_error(tmp_path: Path) -> None:
    tree(tmp_path, {".": "cpu"})
    group = ControlGroups(mounted(("/", tmp_path, "cgroup2", "rw")), "0::/\n").make()
    with pytest.raises(ControlGroupError, match=r"no limits can be set: .*cpu\.max"):
        group.set_limits(ProcessLimits())
    with pytest.raises(ControlGroupError, match="the kernel does not say"):
        group.throttled_periods()
    group.close()


def test_where_the_parent_was_removed_no_group_can_be_made(tmp_path: Path) -> None:
    tree(tmp_path, {"own": "cpu"})
    groups = ControlGroups(mounted(("/", tmp_path, "cgroup2", "rw")), "0::/own\n")
    shutil.rmtree(tmp_path / "own")
    with pytest.raises(ControlGroupError, match="no control group can be made"):
        groups.make()
