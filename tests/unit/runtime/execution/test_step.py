"""Steps of an executor: what their skills may sense, their table, and how they end."""

from __future__ import annotations

from aeros.skill import Inputs, Observation, SkillBody, act
from tests.unit.runtime.one_step import MakeBench


def test_a_skill_sees_what_its_module_may_sense_while_it_is_fresh(make_bench: MakeBench) -> None:
    seen: list[Observation] = []

    def looking(observed: Observation, inputs: Inputs) -> SkillBody:
        seen.append(observed)
        for stale in (0.0625, 0.11, -0.01):
            bench.plant.reading_age = stale
            seen.append((yield act("move")))

    bench = make_bench(looking)
    bench.submit()
    allowed = {"tool_position": (0.3, 0.0, 0.5), "holding": False}
    assert seen == [allowed, allowed, {}, {}]
