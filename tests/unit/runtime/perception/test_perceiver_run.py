"""Perceivers in workers and in this process: what they see, and what becomes of hostile ones."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from aeros.runtime.isolation.layers import APPLY_LAYER
from aeros.runtime.isolation.protocol import PerceivedValue
from aeros.runtime.isolation.zygote_pool import ZygotePool
from aeros.runtime.perception.perceiver_run import (
    NAMES,
    InProcessPerceiver,
    IsolatedPerceiver,
    PerceiverError,
    PerceiverRun,
)
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.runtime.skills.load import CertifiedCode
from aeros.spec.model.perception import PictureRequest
from tests.unit.runtime.isolation.conftest import probe_code
from tests.unit.runtime.isolation.support.surroundings import CONTENT, Surroundings, surroundings
from tests.unit.runtime.isolation.test_probes import ATTACKS
from tests.unit.runtime.perception.perceiving import code, perceiver, picture, view

Start = Callable[..., IsolatedPerceiver]

ESCAPE = """
REAL = estimate.__globals__["__builtins__"]

def load(name):
    return REAL["__import__"](name)
"""
"""Way out of the list of names: every function of a module leads to the module."""


@pytest.fixture
def start(pool: ZygotePool) -> Iterator[Start]:
    started: list[IsolatedPerceiver] = []

    def run(one: CertifiedCode, **declared: Any) -> IsolatedPerceiver:
        started.append(IsolatedPerceiver(pool, APPLY_LAYER, one, perceiver(**declared), 20.0))
        return started[-1]

    yield run
    for one in started:
        one.close()


SEES = """
while True:
    picture = view.pictures["overhead"]
    view = yield {
        "time": view.time,
        "shape": list(picture.rgb.shape + picture.depth.shape),
        "first": int(picture.rgb[0, 1, 2]),
        "depth": estimate(picture.depth[1, 2], np.float32(0.5)),
        "corner": picture.points()[2, 0],
        "full": list(picture.full_size),
        "reading": view.readings.get("force"),
        "missing": None,
        "high": bool(picture.depth.max() > 1.0),
    }
"""


def test_both_kinds_of_runs_see_the_same(start: Start) -> None:
    isolated: PerceiverRun = start(code(SEES))
    trusted: PerceiverRun = InProcessPerceiver(code(SEES), perceiver())
    for moment in (1.0, 2.5):
        seen = view(moment, {"force": moment * 2.0}, picture(moment))
        values = isolated.perceive(seen, 5.0)
        assert values == trusted.perceive(seen, 5.0)
        assert values["time"] == PerceivedValue(moment)
        assert values["reading"] == PerceivedValue(moment * 2.0)
        assert values["shape"] == PerceivedValue([3, 4, 3, 3, 4])
        # Row 0 of the sample is row 1 of the picture, column 1 is column 2; a row has 24 bytes.
        assert values["first"] == PerceivedValue(24 + 2 * 3 + 2)
        # Row 1 is row 3, column 2 is column 4.
        assert values["depth"] == PerceivedValue(float(np.float32(1.0 + (3 * 8 + 4) / 1000.0)), 0.5)
        assert values["full"] == PerceivedValue([8, 6])
        assert "missing" not in values


def test_a_perceiver_keeps_its_state_from_view_to_view(start: Start) -> None:
    run = start(code("count = 0\nwhile True:\n    count += 1\n    view = yield {'count': count}"))
    assert [run.perceive(view(), 5.0)["count"].value for _ in range(3)] == [1, 2, 3]


def test_samples_arrive_with_their_times(start: Start) -> None:
    run = start(code("yield {'peak': max(one.value for one in view.samples['force']),"
                     " 'first': view.samples['force'][0].time}"))  # fmt: skip
    seen = view()._replace(samples={"force": ((0.1, 3.0), (0.2, 7.0), (0.3, 5.0))})
    assert run.perceive(seen, 5.0) == {"peak": PerceivedValue(7.0), "first": PerceivedValue(0.1)}


def test_dataclasses_and_the_toolkit_work_in_a_worker(start: Start) -> None:
    top = """
from dataclasses import dataclass, replace
from math import hypot
from aeros.perception import connected_components, find_plane, fit_circle, has_hsv_colour, locate_cylinder

@dataclass(frozen=True)
class Found:
    count: int = 0
"""
    body = """
points = view.pictures["overhead"].points()
found = find_plane(points.reshape(-1, 3), 0.5)
has_hsv_colour(view.pictures["overhead"].rgb, (0.0, 90.0))
fit_circle(points[..., :2].reshape(-1, 2))
locate_cylinder(points.reshape(-1, 3), 0.02, 0.1)
_, count = connected_components(np.array([[True, False, True]]))
yield {"count": replace(Found(), count=count).count, "normal": found[0].normal}
"""
    assert start(code(body, top)).perceive(view(), 5.0)["count"] == PerceivedValue(2)


def test_no_allowed_function_of_numpy_needs_what_is_not_loaded(start: Start) -> None:
    body = """
failed = []
for module, names in ((np, NAMES), (np.linalg, LINALG)):
    for name in names:
        member = getattr_of(module, name)
        for arguments in ((), (A,), (A, A), (A, 1), (2,), (A, A, A), (V,), (V, V), (V, V, 1)):
            try:
                member(*arguments)
            except Exception as error:
                if isinstance(error, IMPORT_ERROR):
                    failed.append(name + " " + str(error))
yield {"failed": " ".join(failed)[:900]}
"""
    members = sorted(set(NAMES.members["numpy"]) - {"linalg"})
    top = f"""
A = np.array([[2.0, 1.0], [1.0, 3.0]])
V = np.array([1.0, 2.0, 3.0])
NAMES = {members}
LINALG = {sorted(NAMES.members["numpy.linalg"])}
getattr_of = estimate.__globals__["__builtins__"]["getattr"]
IMPORT_ERROR = estimate.__globals__["__builtins__"]["ImportError"]
"""
    assert "median" in members
    assert start(code(body, top), memory=512 << 20).perceive(view(), 60.0)["failed"] == PerceivedValue("")


# What goes wrong: each ends the run with these words.

ENDINGS: dict[str, tuple[str, str]] = {
    "it raises": ("raise ValueError('broken')\nyield {}", "ValueError: broken"),
    "it returns": ("yield {}\nreturn", ""),
    "it ends at once": ("if False:\n    yield {}", "the perceiver returned"),
    "it yields nothing": ("yield", "yielded a `NoneType`, not a dict"),
    "it yields a list": ("yield [1.0]", "yielded a `list`, not a dict"),
    "a million values": (
        "yield {str(n): 0.0 for n in range(10**6)}",
        "yielded 1000000 values; at most 256",
    ),
    "a name that is no text": ("yield {1: 2.0}", "a value whose name is not a string"),
    "a large array": ("yield {'a': np.zeros(65)}", "an array of 65 numbers as one value"),
    "a long list": ("yield {'a': [0.0] * 65}", "65 numbers as one value"),
    "a long text": ("yield {'a': 'x' * 70000}", "more than 65536 bytes"),
    "an object": ("yield {'a': object()}", "not plain data"),
    "a set": ("yield {'a': np}", "not plain data"),
    "a deep list": ("yield {'a': [[1.0]]}", "malformed"),
    "it writes into the picture": (
        "view.pictures['overhead'].rgb[0, 0, 0] = 1\nyield {}",
        "ValueError: assignment destination is read-only",
    ),
    "it makes the picture writable": (
        "view.pictures['overhead'].rgb.setflags(write=True)\nyield {}",
        "ValueError: cannot set WRITEABLE flag",
    ),
    "it reads what it does not get": (
        "view.pictures['overheat']\nyield {}",
        r"^\w+\.py:\d+: KeyError: 'overheat'; did you mean `overhead`\?$",
    ),
    "it opens a file": ("open('/etc/passwd')\nyield {}", "NameError: name 'open' is not defined"),
    "it runs text": ("eval('1')\nyield {}", "NameError: name 'eval' is not defined"),
    "it takes an attribute by name": ("getattr(np, 'abs')\nyield {}", "NameError: name 'getattr'"),
    "it imports": ("import os\nyield {}", "ImportError: a perceiver may not import `os`"),
    "it imports a submodule": (
        "import numpy.ctypeslib as c\nyield {}",
        "ImportError: a perceiver may not import `numpy.ctypeslib`",
    ),
    "it imports a loaded submodule": (
        "from numpy import lib\nyield {}",
        "ImportError: cannot import name 'lib'",
    ),
    "it imports a member": ("from numpy import memmap\nyield {}", "ImportError: cannot import name 'memmap'"),
    "it imports its neighbour": (
        "from . import skills\nyield {}",
        "ImportError: module `hostile` has no file for `.`",
    ),
    "it imports the port": (
        "from aeros.perception import points\nyield {}",
        "ImportError: cannot import name 'points'",
    ),
    **{
        f"it uses np.{name}": (f"np.{name}\nyield {{}}", f"no attribute '{name.partition('.')[0]}'")
        for name in (
            "DataSource",
            "ctypeslib",
            "fromfile",
            "frombuffer",
            "fromregex",
            "genfromtxt",
            "lib",
            "lib.npyio",
            "lib.stride_tricks",
            "load",
            "loadtxt",
            "memmap",
            "random",
            "save",
            "savetxt",
            "savez",
            "testing",
            "f2py",
            "show_config",
            "core",
            "_core",
            "ndarray",
        )
    },
    "it writes an array to a file": (
        "view.pictures['overhead'].rgb.tofile('/tmp/aeros-perceiver')\nyield {}",
        "PermissionError|ModuleNotFoundError|SystemError",
    ),
    "it dumps an array to a file": (
        "view.pictures['overhead'].rgb.dump('/tmp/aeros-perceiver')\nyield {}",
        "PermissionError|ModuleNotFoundError|SystemError",
    ),
    "it takes much memory at once": ("np.ones(10**9)\nyield {}", "MemoryError"),
    "it takes memory without end": (
        "kept = []\nwhile True:\n    kept.append(np.ones(10**6))\nyield {}",
        "MemoryError",
    ),
    "it crashes": ("load('ctypes').string_at(0)\nyield {}", "was killed by SIGSEGV"),
    "it exits": ("load('os')._exit(3)\nyield {}", "ended with exit status 3"),
    "it starts a thread": ("load('threading').Thread(target=len).start()\nyield {}", "RuntimeError"),
    "it forks": ("load('os').fork()\nyield {}", "PermissionError"),
    "it floods": (
        "for _ in range(50):\n    load('os').write(CHANNEL(), b'\\0\\0\\0\\1x')\nyield {}",
        "malformed|more than one answer",
    ),
    "it answers with an action": (
        "load('os').write(CHANNEL(), ACTION())\nyield {}",
        "sent an unexpected response|more than one answer",
    ),
}
_HELPERS = (
    ESCAPE
    + """
def CHANNEL():
    frame = load("sys")._getframe(1)
    while "channel" not in frame.f_locals or frame.f_code.co_name != "serve":
        frame = frame.f_back
    return frame.f_locals["channel"]

def ACTION():
    frame = load("sys")._getframe(1)
    while frame.f_code.co_name != "handle":
        frame = frame.f_back
    protocol = load("sys").modules["aeros.runtime.isolation.protocol"]
    return protocol.encode(protocol.ActionRequested(frame.f_locals["question"].token, "stop", {}))
"""
)


def _perceive_twice(run: PerceiverRun) -> None:
    for _ in range(2):
        run.perceive(view(), 5.0)


@pytest.mark.parametrize("name", ENDINGS)
def test_a_perceiver_that_misbehaves_is_ended(name: str, start: Start) -> None:
    body, why = ENDINGS[name]
    run = start(code(body, _HELPERS), memory=256 << 20)
    with pytest.raises(PerceiverError) as ended:
        _perceive_twice(run)
    assert re.search(why, str(ended.value)), ended.value
    assert len(str(ended.value)) < 1500
    with pytest.raises(PerceiverError, match="the perceiver's process has ended"):
        run.perceive(view(), 5.0)


@pytest.mark.parametrize(
    "body",
    [
        "while True: pass\nyield {}",
        "load('time').sleep(60)\nyield {}",
        "np.ones(10**6).tolist() * 99\nyield {}",
    ],
)
def test_a_perceiver_that_is_late_is_killed(body: str, start: Start) -> None:
    run = start(code(body.replace("np.ones(10**6).tolist() * 99", "sum(range(10**12))"), ESCAPE))
    began = time.monotonic()
    with pytest.raises(PerceiverError, match=r"did not answer within 0\.2 s and was killed"):
        run.perceive(view(), 0.2)
    assert time.monotonic() - began < 5.0


@pytest.mark.parametrize(
    ("one", "why"),
    [
        (code("yield {}", "raise ValueError('at load')"), "fails to load: ValueError: at load"),
        (code("yield {}", "while True: pass"), "fails to load: it does not answer"),
        (code("return {}"), "has no generator function `see`"),
        (code("yield {}", "import os"), "ImportError: a perceiver may not import `os`"),
    ],
)
def test_code_that_never_becomes_a_perceiver_is_refused(
    one: CertifiedCode, why: str, pool: ZygotePool
) -> None:
    with pytest.raises(SkillRefusedError, match=why):
        IsolatedPerceiver(pool, APPLY_LAYER, one, perceiver(), 1.0)


def test_the_memory_of_pictures_cannot_be_made_writable_even_without_layers(zygotes: ZygotePool) -> None:
    body = """
ctypes = load("ctypes")
address = view.pictures["overhead"].rgb.ctypes.data
libc = ctypes.CDLL(None)
failed = libc.mprotect(ctypes.c_void_p(address & -4096), ctypes.c_size_t(4096), 3)
view = yield {"failed": failed, "first": int(view.pictures["overhead"].rgb[0, 0, 0])}
ctypes.memset(address, 77, 1)
yield {}
"""
    run = IsolatedPerceiver(zygotes, (), code(body, ESCAPE), perceiver(), 20.0)
    assert run.perceive(view(), 5.0)["failed"] == PerceivedValue(-1)
    with pytest.raises(PerceiverError, match="was killed by SIGSEGV"):
        run.perceive(view(), 5.0)
    run.close()


def test_a_perceiver_sees_no_more_pixels_than_it_asked_for(start: Start) -> None:
    body = "yield {'size': REAL['len'](memoryview_of(view.pictures['overhead'].rgb.base))}"
    top = ESCAPE + "memoryview_of = REAL['memoryview']\n"
    # 3 bytes for each of 4 x 3 pixels, though the camera took 8 x 6.
    assert start(code(body, top)).perceive(view(), 5.0)["size"] == PerceivedValue(36)


@pytest.mark.parametrize("one", ["isolated", "trusted"])
def test_a_picture_that_is_not_as_asked_for_ends_the_run(one: str, start: Start) -> None:
    for taken, why in (
        (picture(size=(3, 6)), "`overhead` delivers 3 x 6 pixels, and 4 x 3 are asked for"),
        (replace(picture(), depth=None), "`overhead` measures no depth"),
    ):
        run = start(code(SEES)) if one == "isolated" else InProcessPerceiver(code(SEES), perceiver())
        with pytest.raises(PerceiverError, match=why):
            run.perceive(view(taken=taken), 5.0)


def test_without_depth_there_are_no_points(start: Start) -> None:
    run = start(
        code("view.pictures['overhead'].points()\nyield {}"),
        pictures=(PictureRequest("overhead", 4, 3, False),),
    )
    with pytest.raises(PerceiverError, match="has no depth: ask for it with `depth: true`"):
        run.perceive(view(), 5.0)


def test_a_perceiver_without_pictures_gets_none(start: Start) -> None:
    run = start(code("yield {'count': len(view.pictures)}"), pictures=())
    assert run.perceive(view()._replace(pictures={}), 5.0) == {"count": PerceivedValue(0)}


@pytest.fixture
def around(tmp_path: Any) -> Iterator[Surroundings]:
    with surroundings(tmp_path) as made:
        yield made


@pytest.mark.parametrize("name", ATTACKS)
def test_the_attacks_of_hostile_skills_are_blocked_in_a_perceiver(
    name: str, start: Start, around: Surroundings, capfd: pytest.CaptureFixture[str]
) -> None:
    source = probe_code(name).file.content.decode()
    body = f"""
space = {{"__builtins__": REAL, "__name__": "attack"}}
try:
    REAL["exec"]({source!r}, space)
    got = "harmed: " + str(space["attack"]({around.inputs!r}))
except REAL["BaseException"] as failure:
    got = "blocked: " + type(failure).__name__
yield {{"got": got[:500]}}
"""
    try:
        values = start(code(body.replace("type(failure)", 'REAL["type"](failure)'), ESCAPE)).perceive(
            view(), 20.0
        )
    except PerceiverError as ended:
        values = {"got": PerceivedValue(f"blocked: {ended}")}
    assert str(values["got"].value).startswith("blocked: "), values
    assert CONTENT not in str(values)
    assert around.harm() == []
    assert capfd.readouterr() == ("", "")
