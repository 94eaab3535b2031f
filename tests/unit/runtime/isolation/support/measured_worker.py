"""Isolation of one worker, measured: from outside by what the kernel says of it, from inside by attempts.

Each layer is measured in a worker that puts on this layer alone, so that no other layer covers for it.
"""

from __future__ import annotations

import os
import socket
import subprocess
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.isolation import zygote_pool as module
from aeros.runtime.isolation.isolated_run import IsolatedRun
from aeros.runtime.isolation.layers import IsolationLayer
from aeros.runtime.isolation.zygote_pool import ZygotePool
from aeros.runtime.skills.code import CodeFile
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.runtime.skills.load import CertifiedCode
from aeros.skill import Action, act
from tests.host_layers import landlock_version

MEBIBYTE = 1024 * 1024

# What each attempt does is in `ATTEMPTS`; all of them work in a worker that puts on no layer.
FILES = (
    "read a file",
    "write a file",
    "truncate a file",
    "list a folder",
    "make a folder",
    "remove a folder",
    "remove a file",
    "make a link",
    "make a pipe",
    "make a socket",
    "move a file",
)
TCP = ("listen on TCP", "connect to TCP")
SCOPES = ("signal a process", "connect to a socket")
CALLS = (
    "read a file",
    "make a datagram socket",
    "fork",
    "signal a process",
    "ask who its parent is",
    "map executable memory",
    "make memory executable",
)
BY_LAYER: Mapping[IsolationLayer, tuple[str, ...]] = {
    IsolationLayer.LANDLOCK: (*FILES, *TCP, *SCOPES),
    IsolationLayer.SECCOMP: CALLS,
    IsolationLayer.RLIMITS: ("map much memory", "open many files"),
}

ATTEMPTS = """
import ctypes, mmap, os, socket
from aeros.skill import act

def _fork():
    child = os.fork()
    if child == 0:
        os._exit(0)
    os.waitpid(child, 0)

def _connect(family, address):
    with socket.socket(family) as client:
        client.connect(address)

def _listen(family, address):
    with socket.socket(family) as server:
        server.bind(address)
        server.listen()

def _write(path):
    os.close(os.open(path, os.O_WRONLY))

def _protect():
    found = mmap.mmap(-1, mmap.PAGESIZE)
    place = ctypes.addressof(ctypes.c_char.from_buffer(found))
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mprotect(ctypes.c_void_p(place), ctypes.c_size_t(mmap.PAGESIZE), 5) != 0:
        raise OSError(ctypes.get_errno(), "mprotect")

def _parent():
    if os.getppid() < 0:
        raise OSError(1, "getppid")

def attempts(inputs):
    at = inputs["folder"]
    return {
        "read a file": lambda: os.close(os.open(f"{at}/file", os.O_RDONLY)),
        "write a file": lambda: _write(f"{at}/file"),
        "truncate a file": lambda: os.truncate(f"{at}/file", 0),
        "list a folder": lambda: os.listdir(at),
        "make a folder": lambda: os.mkdir(f"{at}/new"),
        "remove a folder": lambda: os.rmdir(f"{at}/old"),
        "remove a file": lambda: os.unlink(f"{at}/other"),
        "make a link": lambda: os.symlink("/", f"{at}/link"),
        "make a pipe": lambda: os.mkfifo(f"{at}/pipe"),
        "make a socket": lambda: _listen(socket.AF_UNIX, f"{at}/socket"),
        "move a file": lambda: os.rename(f"{at}/file", f"{at}/below/file"),
        "listen on TCP": lambda: _listen(socket.AF_INET, ("127.0.0.1", 0)),
        "connect to TCP": lambda: _connect(socket.AF_INET, ("127.0.0.1", inputs["tcp"])),
        "signal a process": lambda: os.kill(inputs["victim"], 0),
        "connect to a socket": lambda: _connect(socket.AF_UNIX, "\\0" + inputs["abstract"]),
        "make a datagram socket": lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM).close(),
        "fork": _fork,
        "ask who its parent is": _parent,
        "map executable memory": lambda: mmap.mmap(-1, mmap.PAGESIZE, prot=mmap.PROT_READ | mmap.PROT_EXEC),
        "make memory executable": _protect,
        "map much memory": lambda: mmap.mmap(-1, 300 * 1024 * 1024).close(),
        "open many files": lambda: [os.dup(0) for _ in range(20)],
    }

def works(name, inputs):
    try:
        attempts(inputs)[name]()
    except (OSError, MemoryError):
        return False
    return True
"""

AT_RUN_TIME = """
def probe(observed, inputs):
    yield act("measured", works=tuple(name for name in inputs["names"].split("|") if works(name, inputs)))
"""

PAUSED = """
from aeros.skill import act

def probe(observed, inputs):
    yield act("paused")
    yield act("never")
"""

AT_LOAD_TIME = """
from aeros.skill import act

try:
    open("/proc/self/statm").close()
    SHUT = False
except OSError:
    SHUT = True

def probe(observed, inputs):
    yield act("measured", works=() if SHUT else ("open a file while its code is loaded",))
"""


# A loader that is put before all others: reads a module's source, and changes it before it is compiled.
_CHANGE_IMPORTS = """
import importlib.machinery as machinery, sys
class Changing(machinery.SourceFileLoader):
    def source_to_code(self, data, path):
        text = bytes(data).decode()
        for old, new in CHANGES[self.name.rpartition(".")[2]]:
            text = text.replace(old, new)
        return compile(text, path, "exec")
    def get_code(self, fullname):
        return self.source_to_code(self.get_data(self.path), self.path)
class Finder:
    def find_spec(name, path=None, target=None):
        package, _, last = name.rpartition(".")
        if package != "aeros.runtime.isolation" or last not in CHANGES:
            return None
        found = machinery.PathFinder.find_spec(name, path)
        found.loader = Changing(name, found.origin)
        return found
sys.meta_path.insert(0, Finder)
"""


@contextmanager
def mutated_pool(
    changes: Mapping[str, Sequence[tuple[str, str]]], bubblewrap: str | None = None
) -> Iterator[ZygotePool]:
    """A pool whose zygotes and workers run changed source; this process does not.

    Args:
        changes: by module of `aeros.runtime.isolation`, pairs of a piece of its source and the replacement.
        bubblewrap: path of the program; None to do without it.
    """
    for name, pairs in changes.items():
        source = Path(module.__file__).with_name(f"{name}.py").read_text("utf-8")
        assert [source.count(old) for old, _ in pairs] == [1] * len(pairs), f"mend the twins of {name}.py"
    hook = f"exec({f'CHANGES = {dict(changes)!r}' + _CHANGE_IMPORTS!r}, {{}})"
    popen = module.Zygote._popen

    def start(zygote: module.Zygote, command: Sequence[str], *rest: Any) -> None:
        *words, code = command
        popen(zygote, [*words, code.replace("; import ", f"; {hook}; import ", 1)], *rest)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module.Zygote, "_popen", start)
        patch.setattr(module, "find_bubblewrap", lambda: bubblewrap)
        pool = ZygotePool(["mmap", "ctypes"])
        try:
            yield pool
        finally:
            pool.close()


class Around:
    """Targets of a worker's attempts: files, listeners, and a process."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.tcp = socket.create_server(("127.0.0.1", 0))
        self.abstract = socket.socket(socket.AF_UNIX)
        self.name = f"aeros-measured-{os.getpid()}-{os.urandom(4).hex()}"
        self.abstract.bind(f"\0{self.name}")
        self.abstract.listen()
        self.victim = subprocess.Popen(["sleep", "600"])

    def close(self) -> None:
        self.tcp.close()
        self.abstract.close()
        self.victim.kill()
        self.victim.wait()

    def inputs(self, names: Iterable[str]) -> dict[str, Any]:
        """Inputs of the attempts, with a fresh folder."""
        folder = self.folder / os.urandom(4).hex()
        for one in (folder, folder / "old", folder / "below"):
            one.mkdir()
        for name in ("file", "other"):
            (folder / name).write_text("content")
        return {
            "folder": str(folder),
            "tcp": self.tcp.getsockname()[1],
            "abstract": self.name,
            "victim": self.victim.pid,
            "names": "|".join(names),
        }


def attempts_that_work(
    pool: ZygotePool, layers: Iterable[IsolationLayer], names: Sequence[str], around: Around
) -> set[str]:
    """Attempts, by name, that work in a worker that puts on these layers."""
    return _run(pool, layers, ATTEMPTS + AT_RUN_TIME, around.inputs(names))


def breaches(pool: ZygotePool, around: Around) -> list[str]:
    """Find what the workers of a pool may do although they must not; empty if all layers are whole."""
    found = [f"{layer.value}: {why}" for layer, why in pool.missing.items() if why and layer in BY_LAYER]
    version = landlock_version()
    for layer, names in BY_LAYER.items():
        barred = [
            name
            for name in names
            if not (name in TCP and version < 4) and not (name in SCOPES and version < 6)
        ]
        try:
            works = attempts_that_work(
                pool, [layer], barred if layer is IsolationLayer.LANDLOCK else names, around
            )
        except SkillRefusedError as refusal:
            found.append(f"{layer.value}: {refusal}")
        else:
            found += [f"{layer.value}: it could {name}" for name in names if name in works]
    try:
        found += [f"late: it could {name}" for name in _run(pool, BY_LAYER, AT_LOAD_TIME, {})]
        found += _seen_from_outside(pool)
    except SkillRefusedError as refusal:
        found.append(f"all: {refusal}")
    return found


def _run(
    pool: ZygotePool, layers: Iterable[IsolationLayer], text: str, inputs: Mapping[str, Any]
) -> set[str]:
    run = _start(pool, layers, text, inputs)
    try:
        action = run.resume({}, 20.0)
        assert isinstance(action, Action), action
        works = action.parameters["works"]
        assert isinstance(works, tuple)
        return set(map(str, works))
    finally:
        run.close()


def _start(
    pool: ZygotePool, layers: Iterable[IsolationLayer], text: str, inputs: Mapping[str, Any]
) -> IsolatedRun:
    code = CertifiedCode(CodeFile("hostile", "measured.py", "/hostile/measured.py", text.encode()), "probe")
    return IsolatedRun(pool, layers, code, inputs, 20.0)


NO_CAPABILITY = "0" * 16
LIMITS = {
    "Max cpu time": 3600,
    "Max core file size": 0,
    "Max file size": 0,
    "Max locked memory": 0,
    "Max msgqueue size": 0,
    "Max processes": 0,
    "Max open files": 16,
}
"""Limits of a worker as `/proc` names them, soft and hard."""


def _seen_from_outside(pool: ZygotePool) -> list[str]:
    """Compare what the kernel says of a worker with what must be so, and of its zygote and this process."""
    run = _start(pool, BY_LAYER, PAUSED, {})
    try:
        assert run.resume({}, 20.0) == act("paused")
        zygote = run._zygote._process
        assert zygote is not None
        (worker,) = _children(zygote.pid)
        status, limits = _status(worker), _limits(worker)
        found = [
            f"seen: {name} is {status[name]}"
            for name, must in {
                "CapInh": NO_CAPABILITY,
                "CapPrm": NO_CAPABILITY,
                "CapEff": NO_CAPABILITY,
                "NoNewPrivs": "1",
                "Seccomp": "2",
                "Threads": "1",
            }.items()
            if status[name] != must
        ]
        found += [
            f"seen: {name} is {limits[name]}"
            for name, must in LIMITS.items()
            if limits[name] != (str(must), str(must))
        ]
        soft, hard = limits["Max address space"]
        mapped = int(status["VmSize"].split()[0]) * 1024
        if soft != hard or not soft.isdigit() or int(soft) > mapped + 257 * MEBIBYTE:
            found.append(f"seen: Max address space is {soft}, {hard}")
        for name, process in {"zygote": zygote.pid, "runtime": os.getpid()}.items():
            if (
                _status(process)["Seccomp"] != _OWN_SECCOMP
                or _limits(process)["Max open files"] != _OWN_FILES
            ):
                found.append(f"seen: the {name} is restricted")
    finally:
        run.close()
    return found


def _children(pid: int) -> list[int]:
    files = Path(f"/proc/{pid}/task").glob("*/children")
    return [int(child) for file in files for child in file.read_text().split()]


def _status(pid: int) -> dict[str, str]:
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return {name: value.strip() for name, _, value in (line.partition(":") for line in lines)}


def _limits(pid: int) -> dict[str, tuple[str, str]]:
    lines = Path(f"/proc/{pid}/limits").read_text().splitlines()[1:]
    return {line[:26].strip(): (line[26:47].strip(), line[47:68].strip()) for line in lines}


_OWN_SECCOMP = _status(os.getpid())["Seccomp"]
_OWN_FILES = _limits(os.getpid())["Max open files"]
