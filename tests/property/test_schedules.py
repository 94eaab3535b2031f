"""Invariants of schedules, for any requests of several skills, and any starts and cancellations.

- Of what is under way at one tick no two actions move the same actuator or break a joint rule.
- Every step that was started ends once, every one that began is cleaned up once, and nothing stays held.
- The record replays, in another mode of the gate.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.audit.log import verify_log
from aeros.runtime.gate.configuration import single_configuration
from aeros.runtime.ports import (
    EndedStep,
    Monitor,
    MotionCompletion,
    MotionHandle,
    PlannedMotion,
    StepHandle,
    StepStatus,
)
from aeros.runtime.records.replay import LogReplay
from aeros.sim.fake import FakePlant
from aeros.skill import Action, act
from tests.property.test_compositions import bounded
from tests.unit.runtime.together import VALUES, Cart, asking, configuration

SPEEDS = st.sampled_from([0.0, 0.25, 0.5, 0.75, 6.0])
ACTIONS = st.one_of(
    SPEEDS.map(lambda speed: act("move", speed=speed)),
    SPEEDS.map(lambda pace: act("roll", pace=pace)),
    st.just(act("lift", height=0.5)),
    st.just(act("wait", duration=1.0)),
    st.just(act("stop")),
)
BODIES = st.fixed_dictionaries({skill: st.lists(ACTIONS, max_size=4) for skill in ("reach", "drive", "look")})
MOVES = st.lists(
    st.one_of(
        st.sampled_from(["reach", "drive", "look"]),  # start it
        st.integers(0, 8),  # cancel the n-th that was started
        st.floats(0.0, 3.0),  # wait that long
        st.sampled_from([0.5, 0.1]).map(lambda charge: {"charge": charge}),  # let that be measured
    ),
    max_size=16,
)


class Watched(FakePlant):
    """Looks at everything under way whenever time goes on."""

    def __init__(self) -> None:
        super().__init__(VALUES)
        self.actions: dict[MotionHandle, Action] = {}
        self.problems: list[str] = []

    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle:
        motion = super().begin(action, decided)
        self.actions[motion] = action
        return motion

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        ended = super().advance(monitor, until)
        tripped = any(str(one.reason).startswith("monitor:") for one in ended.values())
        kinds = configuration().site.kinds
        under_way = [self.actions[motion] for motion in (*self._ends, *ended)]
        for one, other in combinations(under_way, 2):
            if kinds[one.kind].actuators & kinds[other.kind].actuators:
                self.problems.append(f"{one} and {other}")
            speeds = {**one.parameters, **other.parameters}
            joint = {one.kind, other.kind} == {"move", "roll"} and not tripped
            if joint and (speeds["speed"] + speeds["pace"] > 1.0 or self.values["charge"] < 0.2):
                self.problems.append(f"{one} beside {other}")
        return ended


@bounded
@given(BODIES, MOVES, st.lists(st.floats(0.1, 12.0), max_size=12))
def test_invariants_hold_for_every_schedule(
    bodies: dict[str, list[Action]], moves: list[Any], durations: list[float]
) -> None:
    with TemporaryDirectory() as folder:
        plant, skills = Watched(), {name: asking(*asked) for name, asked in bodies.items()}
        cart = Cart(Path(folder) / "audit.jsonl", skills, plant=plant)
        plant.durations = list(durations)
        started: list[StepHandle] = []
        ended: list[EndedStep] = []
        for move in moves:
            if isinstance(move, str):
                started.append(cart.start(move))
            elif isinstance(move, dict):
                plant.values |= move
            elif isinstance(move, int) and move < len(started):
                cart.executor.cancel(started[move], "taken back")
            elif isinstance(move, float) and len(ended) < len(started):
                found = cart.executor.wait(plant.time + move)
                ended += [] if found is None else [found]
        while len(ended) < len(started):
            found = cart.executor.wait()
            assert found is not None
            ended.append(found)
        assert plant.problems == []
        assert sorted(one.step for one in ended) == started
        cart.assert_nothing_is_held()
        began = [call[1] for call in plant.calls if call[0] == "skill_began"]
        over = [call[1] for call in plant.calls if call[0] == "skill_ended"]
        assert sorted(began) == sorted(over)
        finished = [call for call in plant.calls if call[0] == "skill_ended" and call[2]]
        assert len(finished) == sum(one.result.status is StepStatus.FINISHED for one in ended)
        cart.audit.close()
        replay = LogReplay(single_configuration(configuration()))
        assert verify_log(cart.log, lambda record, _: replay.replay_record(record)).is_sound
        assert replay.mismatches == []
