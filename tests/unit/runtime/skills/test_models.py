"""Models in skills: loaded from the certified bytes, in this process and in a worker."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, closing, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.isolation.isolated_run import IsolatedRun
from aeros.runtime.isolation.layers import APPLY_LAYER
from aeros.runtime.isolation.run_factory import _preload_modules
from aeros.runtime.isolation.zygote_pool import ZygotePool
from aeros.runtime.ports import StepStatus
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.runtime.skills.in_process_run import SkillRunProtocol, SkillRunResult, run_in_process
from aeros.runtime.skills.load import certified_code
from aeros.skill import act
from aeros.spec.model.ecm import Ecm
from aeros.spec.text.digests import file_digest
from tests.host_layers import require_layers
from tests.unit.models.packages import LEVELS, gauge_and_tent
from tests.unit.runtime.conftest import MakeEcm
from tests.unit.spec.backends.network.networks import TENT, content_of

CODE = """
from aeros.skill import ModelError, act

def lift(observed, inputs, models):
    observed = yield act("move", volume=models["gauge"].run(level=0.015)["volume"])
    observed = yield act("move", height=models["tent"].run(x=(observed["x"],))["y"][0])
    try:
        models["gauge"].run(level=1.0)
    except ModelError as failure:
        observed = yield act("move", why=str(failure))
    observed = yield act("move", size=len(models["gauge"].content))
    models["tent"].run(x=(1.0,))
"""


@pytest.fixture
def ecm(make_ecm: MakeEcm) -> Ecm:
    made = make_ecm(CODE)
    contents = {"gauge.csv": LEVELS, "tent.onnx": content_of(TENT)}
    for name, content in contents.items():
        (Path(made.folder) / name).write_bytes(content)
    gauge, tent = gauge_and_tent()
    return replace(
        made,
        models={"gauge": gauge, "tent": tent},
        model_digests={name: file_digest(content) for name, content in contents.items()},
        skills={"lift": replace(made.skills["lift"], models=("gauge", "tent"))},
    )


@contextmanager
def isolated(ecm: Ecm) -> Iterator[SkillRunProtocol]:
    require_layers(*(layer.value for layer in APPLY_LAYER))
    with closing(ZygotePool(_preload_modules(ecm))) as pool:
        run = IsolatedRun(pool, APPLY_LAYER, certified_code(ecm, ecm.skills["lift"]), {}, 20.0)
        yield run
        run.close()


def trusted(ecm: Ecm) -> SkillRunProtocol:
    site: Any = None
    return run_in_process(site, ecm, ecm.skills["lift"], {})


@contextmanager
def in_process(ecm: Ecm) -> Iterator[SkillRunProtocol]:
    yield trusted(ecm)


@pytest.mark.parametrize("start", [in_process, isolated])
def test_models_run_in_this_process_and_locked_down_in_a_worker(
    ecm: Ecm, start: Callable[[Ecm], AbstractContextManager[SkillRunProtocol]]
) -> None:
    with start(ecm) as run:
        first = run.resume({}, 10.0)
        assert first == act("move", volume=pytest.approx(0.25))
        assert run.resume({"x": 0.5}, 10.0) == act("move", height=0.5)
        assert run.resume({}, 10.0) == act(
            "move", why="`gauge`: `level` is 1, outside its range 0 to 0.02 (SI)"
        )
        assert run.resume({}, 10.0) == act("move", size=len(LEVELS))
        # The output 1 is above the bound of 0.75 that is checked at run time, and `x` = 0.5 was not.
        ended = run.resume({}, 10.0)
        assert isinstance(ended, SkillRunResult)
        assert ended.status is StepStatus.RAISED
        assert "ModelBoundError: `tent`: the output `y` is (1), outside the bound `low`" in ended.reason


def test_a_model_with_one_bit_changed_is_refused(ecm: Ecm) -> None:
    file = Path(ecm.folder) / "tent.onnx"
    content = bytearray(file.read_bytes())
    content[-1] ^= 1
    file.write_bytes(content)
    with pytest.raises(SkillRefusedError, match="the model `tent` of module `handling` does not match"):
        trusted(ecm)


def test_a_model_that_is_gone_is_refused(ecm: Ecm) -> None:
    (Path(ecm.folder) / "gauge.csv").unlink()
    with pytest.raises(SkillRefusedError, match="the model `gauge` of module `handling` cannot be read"):
        trusted(ecm)


def test_a_file_without_the_interface_is_refused(ecm: Ecm) -> None:
    broken = replace(ecm.models["tent"], inputs={"z": ecm.models["tent"].inputs["x"]})
    with pytest.raises(
        SkillRefusedError, match="a model of module `handling` cannot be loaded: the inputs of"
    ):
        trusted(replace(ecm, models={**ecm.models, "tent": broken}))


def test_a_worker_is_given_no_library_that_it_does_not_need(ecm: Ecm) -> None:
    assert "onnxruntime" in _preload_modules(ecm)
    assert "onnxruntime" not in _preload_modules(
        replace(ecm, skills={"lift": replace(ecm.skills["lift"], models=("gauge",))})
    )
