"""A hostile program reads, writes, connects, multiplies and lives on only as far as the site allows."""

from __future__ import annotations

import json
import os
import re
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.isolation import control_groups
from aeros.runtime.isolation.control_groups import ControlGroupError
from aeros.runtime.tools import confinement as module
from aeros.runtime.tools.confinement import ConfinedCommand, confine
from aeros.runtime.tools.exchange import ToolError
from aeros.runtime.tools.service import call_program
from aeros.spec.model.policy import IsolationPolicy
from aeros.spec.model.tools import Confinement, Program
from tests.host_layers import landlock_version, require_layers
from tests.unit.runtime.tools.services import PYTHON, python

REQUIRED = IsolationPolicy()


def attempt(body: str, confinement: Confinement = PYTHON, seconds: float = 20.0) -> Any:
    """Return the answer of a confined program."""
    return call_program(Program(python(body), confinement), REQUIRED, {}, seconds)


def outcome(expression: str, confinement: Confinement = PYTHON) -> str:
    """Run an expression in a confined program; return `worked`, or the name of the error."""
    body = f"""
import socket, subprocess, shutil
try:
    {expression}
    print('"worked"')
except Exception as failure:
    print(json.dumps(type(failure).__name__))
"""
    return str(attempt(body, confinement))


@pytest.fixture
def key(tmp_path: Path) -> Path:
    """The key of an audit log, which this user may read."""
    folder = tmp_path / "agent"
    folder.mkdir()
    path = folder / "audit.key"
    path.write_text("secret")
    return path


@pytest.fixture(autouse=True)
def _layers() -> None:
    require_layers("landlock", "seccomp")


def test_it_reads_what_the_site_names_and_nothing_else(key: Path) -> None:
    read = f"open({str(key)!r}).read()"
    assert outcome(read) == "PermissionError"
    assert outcome(f"os.listdir({str(key.parent)!r})") == "PermissionError"
    assert outcome(f"os.symlink({str(key)!r}, os.environ['TMPDIR'] + '/link') or "
                   "open(os.environ['TMPDIR'] + '/link').read()") == "PermissionError"  # fmt: skip
    assert outcome(f"open('/proc/self/root{key}').read()") == "PermissionError"
    for place in (key, key.parent):
        assert outcome(read, replace(PYTHON, reads=(*PYTHON.reads, str(place)))) == "worked"


@pytest.mark.parametrize("file", ["/etc/passwd", "/proc/1/environ", "/proc/sys/kernel/hostname"])
def test_it_reads_nothing_of_the_system_that_no_program_needs(file: str) -> None:
    assert outcome(f"open({file!r}).read()") == "PermissionError"


def test_it_writes_to_its_own_folder_alone_which_is_gone_afterwards(key: Path) -> None:
    assert outcome(f"open({str(key)!r}, 'w')") == "PermissionError"
    assert outcome(f"os.remove({str(key)!r})") == "PermissionError"
    assert outcome(f"os.mkdir({str(key.parent / 'new')!r})") == "PermissionError"
    assert outcome("open('/tmp/mark', 'w')") == "PermissionError"
    assert key.read_text() == "secret"
    folder = attempt("open(os.environ['TMPDIR'] + '/mark', 'w'); print(json.dumps(os.environ['TMPDIR']))")
    assert not Path(folder).exists()


def test_it_changes_what_the_site_names(key: Path) -> None:
    open_ = replace(PYTHON, writes=(str(key.parent),))
    assert outcome(f"open({str(key)!r}, 'w').write('changed')", open_) == "worked"
    assert outcome(f"os.rename({str(key)!r}, {str(key) + '2'!r})", open_) == "worked"
    assert key.with_name("audit.key2").read_text() == "changed"
    assert outcome(f"os.mknod({str(key)!r}, 0o20600, os.makedev(1, 5))", open_) == "PermissionError"


def test_a_file_that_an_argument_names_is_read(tmp_path: Path) -> None:
    script, other = tmp_path / "ask.py", tmp_path / "other.txt"
    script.write_text(f"import json\ntry:\n    open({str(other)!r})\nexcept OSError:\n    print('1')\n")
    other.write_text("x")
    program = Program((sys.executable, str(script)), PYTHON)
    assert call_program(program, REQUIRED, {}, 20.0) == 1


@pytest.fixture
def listening() -> Iterator[tuple[int, str]]:
    """A server of TCP on this machine, and one of UNIX sockets."""
    name = f"aeros-confined-{os.getpid()}-{os.urandom(4).hex()}"
    with socket.create_server(("127.0.0.1", 0)) as tcp, socket.socket(socket.AF_UNIX) as unix:
        unix.bind(f"\0{name}")
        unix.listen()
        yield tcp.getsockname()[1], name


@pytest.mark.parametrize(
    "expression",
    [
        "socket.create_connection(('127.0.0.1', {port}))",
        "socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(b'x', ('127.0.0.1', {port}))",
        "socket.create_server(('127.0.0.1', 0))",
        "socket.socket(socket.AF_UNIX).connect('\\0{name}')",
        "socket.socket(socket.AF_NETLINK, socket.SOCK_RAW)",
    ],
)
def test_it_makes_no_socket_unless_the_site_says_so(expression: str, listening: tuple[int, str]) -> None:
    port, name = listening
    attack = expression.format(port=port, name=name)
    assert outcome(attack) == "PermissionError"
    assert outcome("socket.socketpair()") == "worked"
    assert outcome(attack, replace(PYTHON, network=True)) == "worked"


SLEEPERS = """
import subprocess
started = 0
try:
    for _ in range(200):
        subprocess.Popen(["/bin/sleep", "30"], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        started += 1
except OSError:
    pass
time.sleep(1)
print(started)
"""


MANY = "it started more than 8 processes (`confinement.processes`) and was killed"


def test_it_cannot_start_many_processes() -> None:
    try:
        started = attempt(SLEEPERS, replace(PYTHON, processes=8))
    except ToolError as failure:
        # The kernel did not refuse: root has no such limit, and there are no control groups.
        assert str(failure) == MANY  # noqa: PT017 - one way of two
    else:
        assert started < 8


def test_without_control_groups_it_is_killed_once_it_has_too_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "ControlGroups", _no_groups)
    if os.geteuid() != 0:
        pytest.skip("the kernel's own limit on processes is not for root alone")
    with pytest.raises(ToolError, match=f"^{re.escape(MANY)}$"):
        attempt(SLEEPERS, replace(PYTHON, processes=8))


def _no_groups() -> None:
    raise ControlGroupError("the kernel has none")


OUTLIVE = """
import subprocess
body = "import time\\nwhile True:\\n    open({file!r}, 'a').write('x')\\n    time.sleep(0.02)"
for start in (False, True):
    subprocess.Popen([sys.executable, "-c", body], start_new_session=start)
while not os.path.exists({file!r}):
    time.sleep(0.01)
print("{{}}", flush=True)
{end}
"""


@pytest.mark.parametrize("end", ["pass", "os._exit(0)", "time.sleep(60)"])
@pytest.mark.parametrize("has_groups", [True, False])
def test_it_cannot_outlive_its_call(
    end: str, *, has_groups: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not has_groups:
        monkeypatch.setattr(module, "ControlGroups", _no_groups)
    mark = tmp_path / "mark"
    body = OUTLIVE.format(file=str(mark), end=end)
    confinement = replace(PYTHON, writes=(str(tmp_path),))
    if "sleep" in end:
        with pytest.raises(ToolError, match="did not answer"):
            attempt(body, confinement, 3.0)
    else:
        assert attempt(body, confinement) == {}
    written = mark.stat().st_size
    time.sleep(0.3)
    assert mark.stat().st_size == written


def test_it_cannot_end_its_launcher() -> None:
    """Landlock from version 6 keeps it from signals; on others, the kernel ends it with its launcher."""
    killed = "os.kill(os.getppid(), 9)"
    if landlock_version() >= 6:
        assert outcome(killed) == "PermissionError"
    else:
        with pytest.raises(ToolError):
            attempt(killed + "; time.sleep(60)", seconds=3.0)


def test_it_ends_with_the_thread_that_waits_for_it(tmp_path: Path) -> None:
    """As when the runtime is killed: its launcher notices."""
    mark = tmp_path / "mark"
    body = f"while True: open({str(mark)!r}, 'a').write('x'); time.sleep(0.02)"

    def start() -> None:
        confinement = replace(PYTHON, writes=(str(tmp_path),))
        with confine(python(body), confinement, REQUIRED, 60.0) as confined:
            started.append(subprocess.Popen(confined.arguments, start_new_session=True, env={}))
            while not mark.exists():
                time.sleep(0.01)

    started: list[subprocess.Popen[bytes]] = []
    monkey = pytest.MonkeyPatch()
    monkey.setattr(module, "ControlGroups", _no_groups)
    thread = threading.Thread(target=start)
    thread.start()
    thread.join(20.0)
    monkey.undo()
    started[0].wait(20.0)
    written = mark.stat().st_size
    time.sleep(0.3)
    assert mark.stat().st_size == written


def test_its_memory_files_and_descriptors_are_limited() -> None:
    small = replace(PYTHON, memory=64 << 20)
    assert outcome("bytearray(256 << 20)", small) == "MemoryError"
    assert outcome("bytearray(256 << 20)") == "worked"
    written = "open(os.environ['TMPDIR'] + '/big', 'wb').write(bytes(65 << 20))"
    assert outcome(written) == "OSError"
    assert outcome("[os.open('/dev/null', os.O_RDONLY) for _ in range(300)]") == "OSError"
    reader = os.open(os.devnull, os.O_RDONLY)
    os.set_inheritable(reader, True)
    found = attempt("print(json.dumps(sorted(map(int, os.listdir('/proc/self/fd')))[:-1]))")
    os.close(reader)
    assert found == [0, 1, 2]


def test_it_has_no_privileges() -> None:
    status = attempt("print(json.dumps(open('/proc/self/status').read()))")
    lines = dict(line.split(":\t", 1) for line in status.splitlines())
    assert {int(lines[name], 16) for name in ("CapInh", "CapPrm", "CapEff")} == {0}
    assert lines["NoNewPrivs"] == "1"


@pytest.mark.layers
def test_its_processor_time_is_bounded_by_a_control_group() -> None:
    require_layers("cgroups")
    spin = "end = time.monotonic() + 1\nwhile time.monotonic() < end: pass\nprint(time.process_time())"
    assert attempt(spin, replace(PYTHON, processor=Fraction(1, 5))) <= 0.2 + 0.15


@pytest.mark.parametrize(
    ("layer", "broken"),
    [
        ("landlock", "import aeros.runtime.tools.launcher as one; one.restrict_files = lambda *a, **b: None"),
        ("seccomp", "import aeros.runtime.tools.launcher as one; one.restrict_sockets = lambda: None"),
    ],
)
def test_a_layer_without_effect_is_noticed_before_the_program_starts(
    layer: str, broken: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    launch = module._launch

    def launch_twin(plan: str) -> tuple[str, ...]:
        *words, code, plan = launch(plan)
        return (*words, code.replace("; one.main", f"; {broken}; one.main"), plan)

    monkeypatch.setattr(module, "_launch", launch_twin)
    mark = tmp_path / "mark"
    confinement = replace(PYTHON, writes=(str(tmp_path),))
    body = f"open({str(mark)!r}, 'w'); print('{{}}')"
    with pytest.raises(ToolError, match=f"it cannot be confined: {layer}: it was applied and has no effect"):
        attempt(body, confinement)
    assert not mark.exists()
    warned = IsolationPolicy(refuses_missing=False)
    assert call_program(Program(python(body), confinement), warned, {}, 20.0) == {}


@pytest.mark.parametrize("refuses_missing", [True, False])
@pytest.mark.parametrize("right", ["reads", "writes"])
def test_a_path_of_the_site_that_does_not_exist_is_no_missing_layer(
    right: str, *, refuses_missing: bool
) -> None:
    """A site that only warns of missing layers gets no program without those that its host has."""
    changes: dict[str, Any] = {right: (*getattr(PYTHON, right), "/no/such/folder")}
    program = Program(python("print('{}')"), replace(PYTHON, **changes))
    policy = IsolationPolicy(refuses_missing=refuses_missing)
    with pytest.raises(ToolError, match=r"^it cannot be confined: /no/such/folder does not exist$"):
        call_program(program, policy, {}, 20.0)


def test_a_layer_that_programs_do_not_have_is_refused_where_the_site_requires_it() -> None:
    program = Program(python("print('{}')"), PYTHON)
    layers = frozenset({"bubblewrap", "landlock"})
    with pytest.raises(ToolError, match=r"^it cannot be confined: bubblewrap: programs of tools do not have"):
        call_program(program, IsolationPolicy(layers), {}, 20.0)
    assert call_program(program, IsolationPolicy(layers, refuses_missing=False), {}, 20.0) == {}


@pytest.mark.parametrize("right", ["reads", "writes"])
def test_a_path_that_opens_the_files_of_the_runtime_is_refused(right: str, tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(tempfile.gettempdir())
    for path in ("/", tempfile.gettempdir(), str(tmp_path / "link")):
        changes: dict[str, Any] = {right: (path,)}
        with pytest.raises(ToolError, match=f"{path} contains the runtime's temporary files$"):
            attempt("print('{}')", replace(PYTHON, **changes))


def test_a_report_steers_no_terminal(tmp_path: Path) -> None:
    report = tmp_path / "report"
    report.write_bytes(b"it cannot\x1b[2J be \xffstarted\n")
    confined = ConfinedCommand((), report, tmp_path / "errors")
    shown = "it cannot\ufffd[2J be \ufffdstarted\ufffd"
    assert confined.describe("it ended") == shown


def test_a_file_that_is_no_program_cannot_be_started(tmp_path: Path) -> None:
    file = tmp_path / "ask"
    file.write_bytes(b"\0")
    file.chmod(0o700)
    with pytest.raises(ToolError, match="it cannot be started: Exec format error"):
        call_program(Program((str(file),)), REQUIRED, {}, 20.0)


def test_a_site_that_requires_control_groups_gets_no_less(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "ControlGroups", _no_groups)
    policy = IsolationPolicy(frozenset({"cgroups"}))
    with pytest.raises(ToolError, match="it cannot be confined: cgroups: the kernel has none"):
        call_program(Program(python("print('{}')"), PYTHON), policy, {}, 20.0)


def test_no_group_and_no_folder_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    require_layers("cgroups")
    made: list[Any] = []
    group = control_groups.ControlGroup

    def remember(hierarchies: Any) -> Any:
        made.append(group(hierarchies))
        return made[-1]

    monkeypatch.setattr(control_groups, "ControlGroup", remember)
    with confine(python("print('{}')"), PYTHON, REQUIRED, 10.0) as confined:
        paths = [Path(one).parent for one in made[0].entrance_paths]
        assert paths
        assert all(path.is_dir() for path in paths)
        folder = confined.report.parent
        assert json.loads(confined.arguments[-1])["private"] == str(folder / "private")
    assert not any(path.exists() for path in (*paths, folder))
