"""A perceiver runs in a worker, or in this process if the site trusts its module."""

from __future__ import annotations

from dataclasses import replace

import pytest

from aeros.runtime.isolation.protocol import PerceivedValue
from aeros.runtime.isolation.run_factory import SkillRunFactory
from aeros.runtime.isolation.zygote_pool import ZygotePool
from aeros.runtime.perception import open_perceiver as module
from aeros.runtime.perception.open_perceiver import open_by_policy, open_in_process
from aeros.runtime.perception.perceiver_run import InProcessPerceiver, IsolatedPerceiver, ViewInput
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.spec.model.site import Site
from tests.unit.runtime.perception.kettle import PLACE, full_site, kettle
from tests.unit.runtime.perception.perceiving import picture

EYE = kettle().perceivers["kettle_view"]
SEEN = ViewInput(1.0, {"tool_position": PLACE}, {}, {"overhead": picture(1.0, (320, 240))})


@pytest.fixture
def skills(pool: ZygotePool) -> SkillRunFactory:
    return SkillRunFactory(full_site(), [kettle()], lambda preload: pool)


def trusting() -> Site:
    site = full_site()
    return replace(site, isolation=replace(site.isolation, trusted_modules=frozenset({"kettle"})))


def test_the_site_says_where_a_perceiver_runs_and_both_measure_the_same(skills: SkillRunFactory) -> None:
    open_perceiver = open_by_policy(skills)
    isolated, trusted = (open_perceiver(site, kettle(), EYE) for site in (full_site(), trusting()))
    assert isinstance(isolated, IsolatedPerceiver)
    assert isinstance(trusted, InProcessPerceiver)
    values = isolated.perceive(SEEN, 10.0)
    assert values == trusted.perceive(SEEN, 10.0)
    assert values["water_hot"] == PerceivedValue(True)
    assert values["water_level"].uncertainty == 0.004
    isolated.close()
    trusted.close()


def test_other_code_than_the_certified_one_is_refused(skills: SkillRunFactory) -> None:
    changed = replace(kettle(), code_digest="0" * 64)
    for open_perceiver in (open_by_policy(skills), open_in_process):
        with pytest.raises(SkillRefusedError, match="does not match its certificate"):
            open_perceiver(full_site(), changed, EYE)


def test_a_host_that_lacks_a_required_layer_is_refused(pool: ZygotePool) -> None:
    site = full_site()
    strict = replace(
        site,
        isolation=replace(
            site.isolation, required_layers=frozenset({"landlock", "bubblewrap"}), refuses_missing=True
        ),
    )
    bare = _Bare(pool)
    skills = SkillRunFactory(site, [kettle()], lambda preload: bare)  # type: ignore[arg-type, return-value]
    with pytest.raises(
        SkillRefusedError, match=r"the site requires isolation that this host lacks \(bubblewrap"
    ):
        open_by_policy(skills)(strict, kettle(), EYE)


class _Bare:
    """A pool of a host without bubblewrap."""

    def __init__(self, pool: ZygotePool) -> None:
        self.missing = dict.fromkeys(pool.missing) | {
            layer: "there is none" for layer in pool.missing if layer.value == "bubblewrap"
        }


def test_without_numpy_the_message_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, skills: SkillRunFactory
) -> None:
    monkeypatch.setattr(module, "find_spec", lambda name: None)
    for open_perceiver in (open_by_policy(skills), open_in_process):
        with pytest.raises(
            SkillRefusedError, match=r"of module `kettle` need `pip install 'aeros\[kinematic\]'`"
        ):
            open_perceiver(full_site(), kettle(), EYE)
