"""Zygotes of this host, and hostile code to run in their workers."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.isolation import zygote_pool as module
from aeros.runtime.isolation.isolated_run import IsolatedRun
from aeros.runtime.isolation.layers import APPLY_LAYER, IsolationLayer
from aeros.runtime.isolation.limits import USUAL_LIMITS, ProcessLimits
from aeros.runtime.isolation.zygote_pool import ZygotePool
from aeros.runtime.skills.code import CodeFile
from aeros.runtime.skills.load import CertifiedCode
from aeros.spec.obligations.skill_syntax.allowed_names import ALLOWED_MODULES
from tests.host_layers import require_layers
from tests.unit.runtime.isolation.support.surroundings import Surroundings, surroundings

PROBES = Path(__file__).with_name("probes")
_HELP = "from tests.unit.runtime.isolation.support.hostile import"
_FUTURE = "from __future__ import annotations\n"
_ATTACK = """

def probe(observed, inputs):
    try:
        got = attack(inputs)
    except BaseException as failure:
        yield act("blocked", why=f"{type(failure).__name__}: {failure}"[:500])
    else:
        yield act("harmed", got=str(got)[:500])
"""

Start = Callable[..., IsolatedRun]


def pytest_itemcollected(item: pytest.Item) -> None:
    """Mark the tests that need layers of the host."""
    if "nursery" in getattr(item, "fixturenames", ()):
        item.add_marker("layers")


@cache
def probe_code(name: str) -> CertifiedCode:
    """The hostile file `name`, made self-contained: a worker can import nothing of the tests."""
    text = (PROBES / f"{name}.py").read_text()
    lines = [line for line in text.splitlines() if not line.startswith((_HELP, _FUTURE.strip()))]
    helpers = (Path(__file__).parent / "support" / "hostile.py").read_text() if _HELP in text else _FUTURE
    body = "\n".join([helpers, "from aeros.skill import act", *lines]) + "\n"
    if "def attack(" in text:
        body += _ATTACK
    return CertifiedCode(CodeFile("hostile", f"{name}.py", f"/hostile/{name}.py", body.encode()), "probe")


def _nursery(bubblewrap: bool) -> Iterator[ZygotePool]:
    patch = pytest.MonkeyPatch()
    if not bubblewrap:
        patch.setattr(module, "find_bubblewrap", lambda: None)
    patch.setenv("AEROS_PROBE_SECRET", "the runtime's own")
    with patch.context():
        made = ZygotePool([*sorted(ALLOWED_MODULES), "numpy"])
    patch.undo()
    yield made
    made.close()


@pytest.fixture(scope="session")
def bare() -> Iterator[ZygotePool]:
    """Zygotes without bubblewrap, whether or not there is one."""
    yield from _nursery(bubblewrap=False)


@pytest.fixture(scope="session")
def wrapped() -> Iterator[ZygotePool]:
    """Zygotes in bubblewrap."""
    require_layers("bubblewrap")
    yield from _nursery(bubblewrap=True)


@pytest.fixture(params=["alone", "in bubblewrap"])
def nursery(request: pytest.FixtureRequest) -> ZygotePool:
    """Zygotes whose workers can put on every layer that this host offers; skipped where it lacks one."""
    wanted = [*APPLY_LAYER, *([IsolationLayer.BUBBLEWRAP] if request.param != "alone" else [])]
    require_layers(*(layer.value for layer in wanted))
    found: ZygotePool = request.getfixturevalue("bare" if request.param == "alone" else "wrapped")
    lacking = {layer.value: found.missing[layer] for layer in wanted if found.missing[layer] is not None}
    assert not lacking, "the host offers this, as tests/host_layers.py found, and the code does not find it"
    return found


@pytest.fixture
def around(tmp_path: Path) -> Iterator[Surroundings]:
    with surroundings(tmp_path) as made:
        yield made


@pytest.fixture
def start() -> Iterator[Start]:
    """Starts hostile code by name in a worker, and sees it to its end."""
    started: list[IsolatedRun] = []

    def run(
        nursery: ZygotePool,
        name: str,
        inputs: Mapping[str, Any],
        layers: Iterable[IsolationLayer] = APPLY_LAYER,
        answer_within: float = 20.0,
        limits: ProcessLimits = USUAL_LIMITS,
    ) -> IsolatedRun:
        one = IsolatedRun(nursery, layers, probe_code(name), inputs, answer_within, limits)
        started.append(one)
        return one

    yield run
    for one in started:
        one.close()


def is_root() -> bool:
    return os.geteuid() == 0
