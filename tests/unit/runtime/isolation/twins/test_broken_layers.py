"""Broken twins of each layer are found by measuring their workers: off, half on, or for another process.

`measured_worker` measures; whole layers have no breach, and each twin at least the one that is named here.
"""

from __future__ import annotations

import inspect
import os
from collections.abc import Iterator, Mapping
from shutil import which
from textwrap import indent
from typing import Any

import pytest

from aeros.runtime.isolation import bubblewrap, zygote_pool
from aeros.runtime.isolation.layers import APPLY_LAYER, IsolationLayer
from aeros.runtime.isolation.zygote_pool import ZygotePool
from tests.host_layers import missing_reason, require_layers
from tests.unit.runtime.isolation.support.measured_worker import (
    BY_LAYER,
    Around,
    attempts_that_work,
    breaches,
    mutated_pool,
)

pytestmark = pytest.mark.layers

Changes = Mapping[str, list[tuple[str, str]]]

_RETURN_ALLOW = "            yield _RETURN, 0, 0, _ALLOW\n"


def in_child(statement: str) -> str:
    """The statement, executed in a child of the process instead."""
    lines = (
        "from os import _exit, fork, wait",
        "if fork() == 0:",
        f"    {statement.strip()}",
        "    _exit(0)",
        "wait()",
    )
    return indent("\n".join(lines), _indentation(statement))


def in_thread(statement: str) -> str:
    """The statement, executed in another thread instead."""
    lines = (
        "from threading import Thread",
        f"thread = Thread(target=lambda: {statement.strip()})",
        "thread.start()",
        "thread.join()",
    )
    return indent("\n".join(lines), _indentation(statement))


def _indentation(statement: str) -> str:
    return " " * (len(statement) - len(statement.lstrip()))


SOCKET, OPENAT = {"x86_64": (41, 257)}.get(os.uname().machine, (198, 56))
_RESTRICT = "        system_call(_RESTRICT_SELF, descriptor, 0)"
_INSTALL = "    process_control(_PR_SET_SECCOMP, _MODE_FILTER, ctypes.byref(program))"
_LIMIT = "        resource.setrlimit(limit, (value, value))"
_APPLY = """        if layer in requested:
            apply(*arguments.get(layer, ()))"""
_LAYERED = (
    "            apply_layers([IsolationLayer(name) for name in load.layers], self._channel, load.memory)\n"
)
_LOADED = "            self._function = load.file.generator_function(load.function)\n"
_FAILS = """            return SkillRejected(
                load.token, sanitize_text(f"a layer of isolation cannot be applied: {failure}")
            )"""

_RESTRICTED_ZYGOTE = """\
    from aeros.runtime.isolation.limits import restrict_resources
    waiting, done = os.pipe()
    child = os.fork()
    if child == 0:
        os.read(waiting, 1)
    else:
        restrict_resources()
        os.write(done, b".")
        os.close(waiting)
        os.close(done)
"""
"""The worker goes on when the zygote is restricted, so that this is seen."""

TWINS: dict[str, tuple[Changes, str]] = {
    "landlock off": (
        {
            "landlock": [
                ("    version = landlock_version()\n", "    return\n    version = landlock_version()\n")
            ]
        },
        "landlock: it was applied and has no effect",
    ),
    "landlock made and not enforced": ({"landlock": [(_RESTRICT, "        pass")]}, "it could read a file"),
    "landlock without the right to read": (
        {"landlock": [("(1 << rights) - 1)", "((1 << rights) - 1) & ~4)")]},
        "landlock: it could read a file",
    ),
    "landlock with the rights of no version": (
        {"landlock": [("max(count", "min(13, 1) or max(count")]},
        "landlock: it could write a file",
    ),
    "landlock without what folders hold": (
        {"landlock": [("(1 << rights) - 1)", "0b1111)")]},
        "landlock: it could make a folder",
    ),
    "landlock of version 1": (
        {"landlock": [("    version = landlock_version()\n", "    version = 1\n")]},
        "landlock: it could truncate a file",
    ),
    "landlock without TCP": (
        {"landlock": [("if version >= _TCP_RIGHTS[0]", "if version < 0")]},
        "landlock: it could connect to TCP",
    ),
    "landlock without connecting": (
        {"landlock": [("(4, 0b11)", "(4, 0b01)")]},
        "landlock: it could connect to TCP",
    ),
    "landlock without scopes": (
        {"landlock": [("if version >= _SCOPES[0]", "if version < 0")]},
        "landlock: it could signal a process",
    ),
    "landlock without sockets": (
        {"landlock": [("(6, 0b11)", "(6, 0b10)")]},
        "landlock: it could connect to a socket",
    ),
    "landlock for a child": (
        {
            "landlock": [
                (
                    _RESTRICT,
                    in_child(_RESTRICT),
                )
            ]
        },
        "landlock: it could read a file",
    ),
    "landlock for another thread": (
        {
            "landlock": [
                (
                    _RESTRICT,
                    in_thread(_RESTRICT),
                )
            ]
        },
        "landlock: it could read a file",
    ),
    "seccomp off": ({"seccomp": [(_INSTALL, "    pass")]}, "seccomp: it was applied and has no effect"),
    "seccomp that allows by default": (
        {
            "seccomp": [
                (
                    f"{_RETURN_ALLOW}    yield _RETURN, 0, 0, _DENY",
                    f"{_RETURN_ALLOW}    yield _RETURN, 0, 0, _ALLOW",
                )
            ]
        },
        "seccomp: it could fork",
    ),
    "seccomp that denies sockets only": (
        {
            "seccomp": [
                (
                    "    yield _LOAD, 0, 0, _CALL_NUMBER_OFFSET\n",
                    "    yield _LOAD, 0, 0, _CALL_NUMBER_OFFSET\n"
                    f"    yield _JUMP_EQUAL, 0, 1, {SOCKET}\n    yield _RETURN, 0, 0, _DENY\n",
                ),
                (
                    f"{_RETURN_ALLOW}    yield _RETURN, 0, 0, _DENY",
                    f"{_RETURN_ALLOW}    yield _RETURN, 0, 0, _ALLOW",
                ),
            ]
        },
        "seccomp: it could read a file",
    ),
    "seccomp that also allows files": (
        {
            "seccomp": [
                ('"read": 0, ', f'"read": 0, "openat": {OPENAT}, '),
                ('"read": 63, ', f'"read": 63, "openat": {OPENAT}, '),
            ]
        },
        "seccomp: it could read a file",
    ),
    "seccomp that lets memory be executable": (
        {"seccomp": [("_PROT_EXEC: Final = 4", "_PROT_EXEC: Final = 0")]},
        "seccomp: it could map executable memory",
    ),
    "seccomp that lets memory become executable": (
        {"seccomp": [('frozenset(("mmap", "mprotect"))', 'frozenset(("mmap",))')]},
        "seccomp: it could make memory executable",
    ),
    "seccomp for a child": (
        {"seccomp": [(_INSTALL, in_child(_INSTALL))]},
        "seccomp: it could fork",
    ),
    "seccomp for another thread": (
        {"seccomp": [(_INSTALL, in_thread(_INSTALL))]},
        "seccomp: it could fork",
    ),
    "limits off": ({"limits": [(_LIMIT, "        pass")]}, "rlimits: it was applied and has no effect"),
    "limits that can be raised again": (
        {"limits": [("(value, value))", "(value, resource.getrlimit(limit)[1]))")]},
        "seen: Max processes is ('0', ",
    ),
    "limits of twice the memory": (
        {"limits": [("mapped + memory", "mapped + 2 * memory")]},
        "rlimits: it could map much memory",
    ),
    "limits for a child": (
        {"limits": [(_LIMIT, in_child(_LIMIT))]},
        "rlimits: it could open many files",
    ),
    **{
        f"limits without {name}": (
            {"limits": [(f"        ({name}, {value}),\n", "")]},
            f"seen: {line} is ",
        )
        for name, value, line in (
            ("resource.RLIMIT_AS", "mapped + memory", "Max address space"),
            ("resource.RLIMIT_CPU", "CPU", "Max cpu time"),
            ("resource.RLIMIT_CORE", "0", "Max core file size"),
            ("resource.RLIMIT_FSIZE", "0", "Max file size"),
            ("resource.RLIMIT_MEMLOCK", "0", "Max locked memory"),
            ("resource.RLIMIT_MSGQUEUE", "0", "Max msgqueue size"),
            ("resource.RLIMIT_NPROC", "0", "Max processes"),
            ("resource.RLIMIT_NOFILE", "FILES", "Max open files"),
        )
    },
    "new privileges may be gained": (
        # Without this bit only root may install a filter, and this process is not to keep that right.
        {
            "privileges": [("    process_control(_PR_SET_NO_NEW_PRIVS, 1)\n", "")],
        },
        "Operation not permitted",
    ),
    "layers left out": ({"layers": [(_APPLY, "        pass")]}, "landlock: it could read a file"),
    "layers of another name": (
        {"layers": [("if layer in requested", "if layer not in requested")]},
        "seccomp: it could fork",
    ),
    "layers for a child": (
        {"layers": [(_APPLY.splitlines()[1], in_child(_APPLY.splitlines()[1]))]},
        "landlock: it could read a file",
    ),
    "layers for the zygote, not the worker": (
        {
            "worker": [(_LAYERED, "            pass\n")],
            "zygote": [("    child = os.fork()\n", _RESTRICTED_ZYGOTE)],
        },
        "seen: the zygote is restricted",
    ),
    "layers after the code is loaded": (
        {"worker": [(_LAYERED, "            pass\n"), (_LOADED, f"{_LOADED}{_LAYERED}")]},
        "late: it could open a file while its code is loaded",
    ),
    "layers that fail and are done without": (
        {
            "landlock": [(_RESTRICT, "        raise PermissionError(1, 'Operation not permitted')")],
            "worker": [(_FAILS, "            pass")],
        },
        "landlock: it could read a file",
    ),
}


@pytest.fixture(scope="module")
def around(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Around]:
    made = Around(tmp_path_factory.mktemp("measured"))
    yield made
    made.close()


def test_whole_layers_have_no_breach(around: Around) -> None:
    require_layers(*(layer.value for layer in APPLY_LAYER))
    with mutated_pool({}) as pool:
        assert breaches(pool, around) == []


def test_every_attempt_works_where_no_layer_is_put_on(around: Around) -> None:
    names = [name for names in BY_LAYER.values() for name in names]
    with mutated_pool({}) as pool:
        assert attempts_that_work(pool, (), names, around) == set(names)


@pytest.mark.parametrize("name", TWINS)
def test_a_broken_twin_is_found(name: str, around: Around) -> None:
    require_layers(*(layer.value for layer in APPLY_LAYER))
    changes, breach = TWINS[name]
    with mutated_pool(changes) as pool:
        found = breaches(pool, around)
    assert [one for one in found if breach in one], found


BUBBLEWRAP_TWINS: dict[str, tuple[str, str, str]] = {
    "no namespaces": ('        "--unshare-all",\n', "", "signal a process"),
    "the processes of the host": ('"--unshare-all"', '"--unshare-net", "--unshare-ipc"', "signal a process"),
    "the network of the host": ('"--unshare-all"', '"--unshare-pid", "--unshare-ipc"', "connect to TCP"),
    "all files of the host": ("        *mounts,\n", '        "--ro-bind", "/", "/",\n', "read a file"),
    "files to be changed": ("        *mounts,\n", '        "--bind", "/", "/",\n', "make a folder"),
}
"""By what bubblewrap does not take away: a change of its command line, and an attempt that works then."""

_OUTSIDE = ("read a file", "make a folder", "signal a process", "connect to TCP", "connect to a socket")


def test_nothing_outside_of_bubblewrap_can_be_reached(around: Around) -> None:
    require_layers("bubblewrap")
    with mutated_pool({}, which("bwrap")) as pool:
        assert pool.missing[IsolationLayer.BUBBLEWRAP] is None
        assert attempts_that_work(pool, (), _OUTSIDE, around) == set()


@pytest.mark.parametrize("name", BUBBLEWRAP_TWINS)
def test_a_broken_twin_of_bubblewrap_is_found(
    name: str, around: Around, monkeypatch: pytest.MonkeyPatch
) -> None:
    require_layers("bubblewrap")
    old, new, works = BUBBLEWRAP_TWINS[name]
    source = inspect.getsource(bubblewrap)
    assert source.count(old) == 1
    twin: dict[str, Any] = {}
    exec(source.replace(old, new), twin)  # noqa: S102 - a twin of our own code
    monkeypatch.setattr(zygote_pool, "wrap_command", twin["wrap_command"])
    with mutated_pool({}, which("bwrap")) as pool:
        assert pool.missing[IsolationLayer.BUBBLEWRAP] is not None
        assert works in attempts_that_work(pool, (), _OUTSIDE, around)


_ENTER = "            enter_control_group(entrances)\n"
CGROUP_TWINS: dict[str, tuple[str, str, str]] = {
    "nobody enters": ("zygote", _ENTER, "            pass\n"),
    "another process enters": ("zygote", _ENTER, in_child(_ENTER) + "\n"),
}
"""By what is wrong with control groups: a module, a piece of its source, and the replacement."""


@pytest.mark.parametrize("name", CGROUP_TWINS)
def test_a_broken_twin_of_control_groups_is_found(name: str) -> None:
    require_layers("cgroups")
    module, old, new = CGROUP_TWINS[name]
    with mutated_pool({module: [(old, new)]}) as pool:
        zygote, channel = pool.spawn_worker()
        channel.close()
        zygote.end_worker()
        pool.release(zygote)
        assert pool.missing[IsolationLayer.CGROUPS] == "they were applied and have no effect"


def test_the_layers_reported_missing_are_those_that_the_host_lacks(bare: ZygotePool) -> None:
    for layer in APPLY_LAYER:
        assert (bare.missing[layer] is None) == (missing_reason(layer.value) is None), layer
    # The tests ask for version 1 alone.
    assert bare.missing[IsolationLayer.CGROUPS] is None or missing_reason("cgroups") is not None
