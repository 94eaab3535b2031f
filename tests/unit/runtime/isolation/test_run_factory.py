"""The site decides the isolation of a module's code, and a weaker host is always reported."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any, cast

import pytest

from aeros.runtime.audit.log import AuditLog
from aeros.runtime.execution.executor import Executor
from aeros.runtime.gate.compiled.rules import MonitorRules
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Decision, DecisionKind
from aeros.runtime.gate.port import Gate
from aeros.runtime.isolation.isolated_run import IsolatedRun
from aeros.runtime.isolation.layers import IsolationLayer
from aeros.runtime.isolation.limits import ProcessLimits
from aeros.runtime.isolation.run_factory import SkillRunFactory, limits_in_force
from aeros.runtime.isolation.zygote_pool import ZygoteError, ZygotePool
from aeros.runtime.ports import StepRequest, StepResult, StepStatus
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.runtime.skills.in_process_run import InProcessRun
from aeros.sim.fake import FakePlant
from aeros.skill import Action, act
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.policy import IsolationPolicy, WorkerLimits
from aeros.spec.model.site import Site
from aeros.spec.text.digests import code_digest, code_files
from tests.host_layers import require_layers

CODE = "from aeros.skill import act\ndef lift(observed, inputs):\n    yield act('move', h=inputs['height'])\n"
SPIN = "def lift(observed, inputs):\n    while True: pass\n    yield\n"
INPUTS = {"height": 0.1}


class FakeNursery:
    """A host that lacks given layers, and has no worker."""

    def __init__(self, **missing: str) -> None:
        self.missing = {layer: missing.get(layer.value) for layer in IsolationLayer}
        self.limits: list[ProcessLimits] = []

    def spawn_worker(self, _: int | None, limits: ProcessLimits) -> None:
        self.limits.append(limits)
        raise ZygoteError("this host has none")

    def close(self) -> None:
        pass


def _given(nursery: ZygotePool, preload: Sequence[str]) -> ZygotePool:
    return nursery


def _runs(site: Site, ecm: Ecm, isolation: IsolationPolicy, **missing: str) -> SkillRunFactory:
    host = cast("ZygotePool", FakeNursery(**missing))
    return SkillRunFactory(replace(site, isolation=isolation), [ecm], lambda preload: host)


def test_a_module_that_the_site_trusts_runs_in_this_process(site: Site, make_ecm: Any) -> None:
    ecm = make_ecm(CODE)
    trusting = replace(site, isolation=IsolationPolicy(trusted_modules=frozenset({ecm.id})))
    with SkillRunFactory(trusting, [ecm]) as runs:
        assert runs.audit_details()["layers"] == {}  # nothing was started, so nothing was probed
        assert runs.audit_details()["trusted"] == ["handling"]
        run = runs(trusting, ecm, ecm.skills["lift"], INPUTS)
        assert isinstance(run, InProcessRun)
        assert run.resume({}, 1.0) == act("move", h=0.1)


def test_a_module_that_the_site_does_not_speak_of_is_isolated(
    site: Site, make_ecm: Any, nursery: ZygotePool
) -> None:
    ecm = make_ecm(CODE)
    runs = SkillRunFactory(site, [ecm], lambda preload: nursery)
    run = runs(site, ecm, ecm.skills["lift"], INPUTS)
    assert isinstance(run, IsolatedRun)
    assert run.resume({}, 1.0) == act("move", h=0.1)
    run.close()
    assert runs.unavailable_reason is None
    assert runs.weakness_warning is None
    assert runs.audit_details()["layers"]["landlock"] == "in place"


def test_code_that_was_changed_is_refused_before_any_worker_sees_it(
    site: Site, make_ecm: Any, nursery: ZygotePool
) -> None:
    ecm = make_ecm(CODE)
    (Path(ecm.folder) / "skills.py").write_text(SPIN)
    with pytest.raises(SkillRefusedError, match="does not match its certificate"):
        SkillRunFactory(site, [ecm], lambda preload: nursery)(site, ecm, ecm.skills["lift"], INPUTS)


@pytest.mark.parametrize("layer", ["landlock", "seccomp", "rlimits", "cgroups"])
def test_a_host_that_lacks_a_required_layer_refuses(layer: str, site: Site, make_ecm: Any) -> None:
    ecm = make_ecm(CODE)
    policy = IsolationPolicy(IsolationPolicy().required_layers | {"cgroups"})
    runs = _runs(site, ecm, policy, **{layer: "no such call"})
    assert runs.unavailable_reason is not None
    assert (
        f"`handling` may not run here: the site requires isolation that this host lacks ({layer}: no such"
        in (runs.unavailable_reason)
    )
    assert runs.audit_details()["layers"][layer] == "missing: no such call"
    with pytest.raises(SkillRefusedError, match="no such call"):
        runs(replace(site, isolation=policy), ecm, ecm.skills["lift"], INPUTS)


def test_a_host_without_bubblewrap_refuses_where_the_site_requires_it(site: Site, make_ecm: Any) -> None:
    ecm = make_ecm(CODE)
    assert _runs(site, ecm, IsolationPolicy(), bubblewrap="none").unavailable_reason is None
    required = IsolationPolicy(required_layers=frozenset({"bubblewrap"}))
    assert "bubblewrap: none" in str(_runs(site, ecm, required, bubblewrap="none").unavailable_reason)


def test_a_site_may_be_warned_instead(site: Site, make_ecm: Any) -> None:
    runs = _runs(site, make_ecm(CODE), IsolationPolicy(refuses_missing=False), landlock="no such call")
    assert runs.unavailable_reason is None
    assert runs.weakness_warning == (
        "skill code is isolated less than the site requires (landlock: no such call)"
    )
    assert runs.audit_details()["missing"] == "warn"


@pytest.mark.layers
def test_a_worker_puts_on_what_the_host_has(site: Site, make_ecm: Any, bare: ZygotePool) -> None:
    """The layers that are there hold, also where another is missing."""
    text = (
        "from aeros.skill import act\n"
        "import sys\n"
        "def lift(observed, inputs):\n"
        "    try:\n"
        "        open('/proc/self/statm')\n"
        "    except OSError:\n"
        "        yield act('blocked')\n"
        "    yield act('open')\n"
    )
    require_layers("landlock", "seccomp")
    ecm = make_ecm(text)
    warning = replace(site, isolation=IsolationPolicy(refuses_missing=False))
    seen = {}
    for lacking in (None, IsolationLayer.LANDLOCK, IsolationLayer.SECCOMP):
        weaker = ZygotePool.__new__(ZygotePool)
        weaker.__dict__.update(bare.__dict__)
        weaker.missing = {**bare.missing, **({} if lacking is None else {lacking: "left out"})}
        run = SkillRunFactory(warning, [ecm], partial(_given, weaker))(
            warning, ecm, ecm.skills["lift"], INPUTS
        )
        seen[lacking] = run.resume({}, 1.0)
        run.close()
    assert seen == dict.fromkeys((None, IsolationLayer.LANDLOCK, IsolationLayer.SECCOMP), act("blocked"))


@pytest.mark.parametrize(
    ("text", "numpy"),
    [(CODE, False), ("import numpy as np\n" + CODE, True), ("from numpy.linalg import inv\n" + CODE, True)],
)
def test_numpy_is_preloaded_for_code_that_imports_it(
    text: str, numpy: bool, site: Site, make_ecm: Any
) -> None:
    (preload,) = _preloads(site, make_ecm(text))
    assert ("numpy" in preload, "numpy.linalg" in preload) == (numpy, numpy)
    assert "math" in preload


@pytest.mark.parametrize(
    ("first", "second", "numpy"),
    [
        ("", "import numpy\n", False),  # a file of perceivers
        ("from .first import A\n", "import numpy\n", False),
        ("from .second import A\n", "import numpy\n", True),
        ("from .second import A\n", "from .first import B\n", False),
        ("def _later():\n    from . import second\n", "import numpy\n", True),
    ],
)
def test_numpy_is_preloaded_for_the_files_that_a_skill_imports(
    first: str, second: str, numpy: bool, site: Site, make_ecm: Any
) -> None:
    ecm = make_ecm("from .first import A\n" + CODE)
    folder = Path(ecm.folder)
    (folder / "first.py").write_text(first + "A = 1\n")
    (folder / "second.py").write_text(second + "A = B = 2\n")
    ecm = replace(ecm, code_digest=code_digest(code_files(folder)))
    (preload,) = _preloads(site, ecm)
    assert ("numpy" in preload) == numpy


def _preloads(site: Site, ecm: Ecm) -> list[Sequence[str]]:
    asked: list[Sequence[str]] = []

    def remember(preload: Sequence[str]) -> Any:
        asked.append(preload)
        return FakeNursery()

    SkillRunFactory(site, [ecm], remember).close()
    return asked


# The executor, over workers.


class AllowAll:
    def __init__(self, configuration: Configuration) -> None:
        self.monitor_rules = MonitorRules(configuration.site)

    def decide(self, caller: Any, readings: Any, action: Action, now: float, usage: Any) -> Decision:
        return Decision(DecisionKind.ALLOW, action, ())


@contextmanager
def _executor(site: Site, ecm: Ecm, runs: SkillRunFactory, log: Path) -> Iterator[tuple[Executor, FakePlant]]:
    plant = FakePlant({"tool_position": (0.3, 0.0, 0.5), "human_distance": 20.0, "holding": False})
    configuration = Configuration(site=site, modules={ecm.id: ecm}, certificates={}, digest="c" * 64)
    with AuditLog(log) as audit:
        yield Executor(configuration, cast("Gate", AllowAll(configuration)), plant, audit, runs), plant


def test_a_step_runs_in_a_worker(site: Site, make_ecm: Any, nursery: ZygotePool, tmp_path: Path) -> None:
    ecm = make_ecm(CODE)
    with _executor(site, ecm, SkillRunFactory(site, [ecm], lambda preload: nursery), tmp_path / "log") as (
        executor,
        plant,
    ):
        result = executor.run_step(StepRequest("handling", "lift", {"height": 0.05}))
    assert result == StepResult(StepStatus.FINISHED, "", allowed=1)
    assert plant.executed == [act("move", h=0.05)]


def test_a_step_that_spins_is_timed_out_and_the_plant_stopped(
    site: Site, make_ecm: Any, nursery: ZygotePool, tmp_path: Path
) -> None:
    ecm = make_ecm(SPIN)
    hasty = replace(site, isolation=IsolationPolicy(answer_timeout_s=Fraction(1)))
    runs = SkillRunFactory(hasty, [ecm], lambda preload: nursery)
    with _executor(hasty, ecm, runs, tmp_path / "log") as (executor, plant):
        result = executor.run_step(StepRequest("handling", "lift", {}))
    assert result.status is StepStatus.TIMED_OUT
    assert result.reason == "the skill did not answer within 1 s and was killed"
    assert plant.call_count("stop") == 1
    assert plant.executed == []


def test_a_module_that_may_not_run_here_is_refused_as_a_step(
    site: Site, make_ecm: Any, tmp_path: Path
) -> None:
    ecm = make_ecm(CODE)
    runs = _runs(site, ecm, IsolationPolicy(), seccomp="no such call")
    with _executor(site, ecm, runs, tmp_path / "log") as (executor, plant):
        result = executor.run_step(StepRequest("handling", "lift", {}))
    assert result.status is StepStatus.REFUSED
    assert "seccomp: no such call" in result.reason
    assert plant.executed == []


HOARD = (
    "def lift(observed, inputs):\n    kept = bytearray(96 << 20)\n    yield act('move', h=float(len(kept)))\n"
)


@pytest.mark.parametrize(
    ("of_module", "of_site", "is_enough"),
    [(256, 256, True), (32, 256, False), (256, 32, False), (None, 32, False), (None, 256, True)],
)
def test_a_skill_has_the_memory_of_its_module_within_that_of_the_site(
    site: Site, make_ecm: Any, nursery: ZygotePool, of_module: int | None, of_site: int, *, is_enough: bool
) -> None:
    worker = None if of_module is None else WorkerLimits(of_module << 20, Fraction(5))
    ecm = replace(make_ecm(f"from aeros.skill import act\n{HOARD}"), worker=worker)
    limited = replace(site, isolation=IsolationPolicy(memory=of_site << 20))
    run = SkillRunFactory(limited, [ecm], lambda preload: nursery)(limited, ecm, ecm.skills["lift"], INPUTS)
    found = run.resume({}, 1.0)
    run.close()
    assert isinstance(found, Action) == is_enough
    if not isinstance(found, Action):
        assert found.status is StepStatus.RAISED
        assert "MemoryError" in found.reason


def test_a_skill_has_the_time_of_its_module_before_each_action(
    site: Site, make_ecm: Any, nursery: ZygotePool
) -> None:
    ecm = replace(make_ecm(SPIN), worker=WorkerLimits(2**28, Fraction(1, 4)))
    run = SkillRunFactory(site, [ecm], lambda preload: nursery)(site, ecm, ecm.skills["lift"], INPUTS)
    found = run.resume({}, 30.0)
    assert not isinstance(found, Action)
    assert (found.status, "within 0.25 s" in found.reason) == (StepStatus.TIMED_OUT, True)


@pytest.mark.parametrize(
    ("of_module", "of_site", "share"),
    [(Fraction(1, 2), Fraction(1), 0.5), (Fraction(1), Fraction(1, 4), 0.25), (None, Fraction(1, 4), 0.25)],
)
def test_a_skill_has_the_processor_share_of_its_module_within_that_of_the_site(
    site: Site, make_ecm: Any, of_module: Fraction | None, of_site: Fraction, share: float
) -> None:
    worker = None if of_module is None else WorkerLimits(2**28, Fraction(5), of_module)
    ecm = replace(make_ecm(CODE), worker=worker)
    host = FakeNursery()
    limited = replace(site, isolation=IsolationPolicy(processor=of_site))
    factory = SkillRunFactory(limited, [ecm], lambda preload: cast("ZygotePool", host))
    with pytest.raises(SkillRefusedError, match="there is no worker"):
        factory(limited, ecm, ecm.skills["lift"], INPUTS)
    assert host.limits == [ProcessLimits(2**28, share)]


@pytest.mark.parametrize(
    ("devices", "reason"),
    [({}, "the site declares no such device"), ({"gpu": "/dev/no-gpu"}, "has no `/dev/no-gpu`")],
)
def test_a_module_that_needs_a_device_runs_only_where_it_is(
    site: Site, make_ecm: Any, nursery: ZygotePool, devices: dict[str, str], reason: str
) -> None:
    ecm = make_ecm(CODE)
    ecm = replace(ecm, requested_access=replace(ecm.requested_access, compute=frozenset({"gpu"})))
    here = replace(site, devices={"gpu": "/dev/null"})
    runs = SkillRunFactory(here, [ecm], lambda preload: nursery)
    runs(here, ecm, ecm.skills["lift"], INPUTS).close()
    elsewhere = replace(site, devices=devices)
    with pytest.raises(SkillRefusedError, match=f"needs `gpu`, and .*{reason}"):
        runs(elsewhere, ecm, ecm.skills["lift"], INPUTS)
    SkillRunFactory(elsewhere, [ecm], lambda preload: nursery)  # other modules may run


def test_a_module_has_its_own_limits_as_far_as_the_site_allows(site: Site, make_ecm: Any) -> None:
    ecm = replace(make_ecm("def lift(o, i):\n    yield\n"), worker=None)
    policy = site.isolation
    assert limits_in_force(site, ecm) == WorkerLimits(policy.memory, policy.answer_timeout_s)
    asked = replace(ecm, worker=WorkerLimits(policy.memory * 2, policy.answer_timeout_s / 2))
    assert limits_in_force(site, asked) == WorkerLimits(policy.memory, policy.answer_timeout_s / 2)
