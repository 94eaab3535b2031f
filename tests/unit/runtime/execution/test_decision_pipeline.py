"""One decision: on one look at the plant, recorded before it is returned, and counted once executed."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import pytest

from aeros.runtime.audit.log import AuditLog
from aeros.runtime.canonical_json import digest_of
from aeros.runtime.execution.decision_pipeline import DecisionPipeline, PipelineDecision
from aeros.runtime.execution.detour_search import Detour
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, Decision, DecisionKind, Reason
from aeros.runtime.gate.gate import GateDisagreementError
from aeros.runtime.gate.port import Gate
from aeros.runtime.motion.trajectory import OBSTRUCTED
from aeros.runtime.ports import ColumnNames, Plant, Reading, RobotBody, Snapshot, Trajectory
from aeros.runtime.records.obstacle_json import obstacles_to_json
from aeros.runtime.records.records import body_to_json, motion_to_json
from aeros.sim.fake import FakePlant
from aeros.sim.kinematic.plant import make_plant
from aeros.skill import Action, act
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.model.cause import causes_to_json
from aeros.spec.model.site import Site
from aeros.spec.scenes.load import load_scene
from tests.unit.runtime.execution.test_detour_search import Obstructed, box, to
from tests.unit.runtime.one_step import DENIAL, VALUES, FakeGate
from tests.unit.runtime.perception.kettle import site as reference_site

CALLER = Caller("handling", "lift", {})
MOVE = act("move", speed=0.1)
SLOWER = act("move", speed=0.05)


class Changeable(FakeGate):
    """A fake gate that follows a new configuration, and says which."""

    def with_configuration(self, configuration: Configuration) -> Changeable:
        made = Changeable(configuration.site)
        made.answers, made.asked = self.answers, self.asked
        return made


class Desk:
    """Decides for a fake plant by a fake gate, into a real audit record."""

    def __init__(self, site: Site, folder: Path) -> None:
        self.plant, self.gate = FakePlant(VALUES), Changeable(site)
        self.path = folder / "audit.jsonl"
        self.audit = AuditLog(self.path)
        self.configuration = Configuration(site=site, modules={}, certificates={}, digest="c" * 64)
        self.deciding = DecisionPipeline(self.configuration, cast("Gate", self.gate), self.plant, self.audit)

    def decide(self, action: Action = MOVE, *answers: Decision) -> PipelineDecision:
        self.gate.answers.extend(answers)
        return self.deciding.decide(CALLER, action, [])

    def records(self) -> list[dict[str, Any]]:
        lines = (json.loads(line) for line in self.path.read_text().splitlines())
        return [one["details"] for one in lines if one["event"] == "decision"]

    def events(self, name: str) -> list[dict[str, Any]]:
        lines = (json.loads(line) for line in self.path.read_text().splitlines())
        return [one["details"] for one in lines if one["event"] == name]

    def counted(self) -> list[int]:
        """The use of the quota on moves that the gate received, decision by decision."""
        return [usage["move-rate"] for *_, usage in self.gate.asked]


@pytest.fixture
def desk(site: Site, tmp_path: Path) -> Iterator[Desk]:
    made = Desk(site, tmp_path)
    yield made
    made.audit.close()


def test_a_disagreement_is_recorded_with_both_verdicts_before_it_halts(desk: Desk) -> None:
    allowed = Decision(DecisionKind.ALLOW, MOVE, ())
    desk.gate.answers.append(GateDisagreementError(allowed, DENIAL))
    with pytest.raises(GateDisagreementError):
        desk.decide()
    (last,) = [
        one["details"]
        for one in map(json.loads, desk.path.read_text().splitlines())
        if one["event"] == "gate-disagreement"
    ]
    assert desk.records() == []
    asked = {"kind": "move", "parameters": {"speed": 0.1}}
    assert last["asked"] == asked
    assert last["compiled"] == {"verdict": "ALLOW", "reasons": [], "decided": asked}
    reasons = [["AE750", "workspace", "outside"]]
    assert last["z3"] == {"verdict": "DENY", "reasons": reasons, "decided": None}
    assert (last["module"], last["skill"], sorted(last["state"])) == ("handling", "lift", sorted(VALUES))
    assert (last["time"], last["configuration"]) == (desk.plant.now(), "c" * 64)


def test_an_action_is_counted_at_the_time_of_its_decision(desk: Desk) -> None:
    decided = desk.decide()
    assert decided.active_action is not None
    at = desk.plant.now()
    desk.plant.now = lambda: at + 1.0  # type: ignore[method-assign]
    desk.deciding.count_execution(decided.active_action)
    (window,) = [quota.window_s for quota in desk.configuration.site.quotas if quota.id == "move-rate"]
    desk.plant.now = lambda: at + float(window) + 0.5  # type: ignore[method-assign]
    desk.decide()
    assert desk.counted() == [0, 0]


def test_an_allowed_action_is_decided_on_what_is_measured_and_recorded(desk: Desk) -> None:
    decided = desk.decide()
    ((caller, readings, action, now, _),) = desk.gate.asked
    assert (caller, action) == (CALLER, MOVE)
    assert {name: reading.value for name, reading in readings.items()} == VALUES
    assert now == desk.plant.now()
    (record,) = desk.records()
    assert (record["verdict"], record["module"], record["skill"]) == ("ALLOW", "handling", "lift")
    assert decided.decision.kind is DecisionKind.ALLOW
    assert decided.active_action is not None
    assert (
        decided.active_action.action,
        decided.active_action.decided_at,
        decided.active_action.record_number,
    ) == (MOVE, now, 0)
    assert (decided.plan, decided.is_protective_stop, decided.causes) == (None, False, ())


def test_a_denied_action_may_not_begin_and_is_recorded_with_its_causes(desk: Desk) -> None:
    decided = desk.decide(MOVE, DENIAL)
    assert decided == PipelineDecision(DENIAL, None, None, is_protective_stop=False, causes=decided.causes)
    (record,) = desk.records()
    assert record["verdict"] == "DENY"
    assert record["causes"] == json.loads(json.dumps(causes_to_json(decided.causes))) != []


def test_an_attenuated_action_begins_as_it_was_reduced(desk: Desk) -> None:
    reduced = Decision(DecisionKind.ATTENUATE, SLOWER, (Reason("AE750", "separation", "near"),))
    decided = desk.decide(MOVE, reduced)
    assert decided.active_action is not None
    assert decided.active_action.action == SLOWER
    assert [cause.rule for cause in decided.causes] == ["separation"]
    (record,) = desk.records()
    assert (record["asked"]["parameters"], record["decided"]["parameters"]) == (
        {"speed": 0.1},
        {"speed": 0.05},
    )


def test_an_action_that_is_allowed_without_an_action_is_our_own_fault(desk: Desk) -> None:
    with pytest.raises(InternalError, match="returned no action"):
        desk.decide(MOVE, Decision(DecisionKind.ALLOW, None, ()))


def test_a_protective_stop_ends_what_moves(site: Site, tmp_path: Path) -> None:
    kinds = {**site.kinds, "stop": replace(site.kinds["stop"], protective=True)}
    desk = Desk(replace(site, kinds=kinds), tmp_path)
    assert desk.decide(act("stop")).is_protective_stop
    assert not desk.decide(MOVE).is_protective_stop
    assert not desk.decide(act("stop"), DENIAL).is_protective_stop
    desk.audit.close()


def test_a_quota_counts_what_was_executed_and_nothing_else(desk: Desk) -> None:
    first = desk.decide()
    second = desk.decide()
    assert first.active_action is not None
    assert second.active_action is not None
    desk.deciding.count_execution(second.active_action)
    desk.decide(MOVE, DENIAL)
    desk.decide()
    assert desk.counted() == [0, 0, 1, 1]


def test_quotas_go_on_under_another_configuration(desk: Desk) -> None:
    started = desk.decide().active_action
    assert started is not None
    desk.deciding.count_execution(started)
    desk.deciding.switch_configuration(replace(desk.configuration, digest="d" * 64))
    desk.decide()
    other = replace(desk.configuration.site, digest="6" * 64)
    desk.deciding.switch_configuration(replace(desk.configuration, site=other, digest="e" * 64))
    desk.decide()
    assert desk.counted() == [0, 1, 1]
    assert [record["configuration"] for record in desk.records()] == ["c" * 64, "d" * 64, "e" * 64]


def test_under_another_site_the_monitors_are_those_of_its_gate(desk: Desk) -> None:
    before = desk.deciding.monitors
    desk.deciding.switch_configuration(replace(desk.configuration, digest="d" * 64))
    assert desk.deciding.monitors is before
    other = replace(desk.configuration.site, digest="6" * 64)
    desk.deciding.switch_configuration(replace(desk.configuration, site=other))
    assert desk.deciding.monitors is not before
    assert desk.deciding.monitors(0.0, VALUES) is None
    desk.decide()
    assert desk.plant.calls == [], "the site has no motions"
    desk.deciding.switch_configuration(replace(desk.configuration, site=reference_site()))
    desk.decide(act("move_tool"))
    assert desk.plant.calls == [("plan", act("move_tool"))]


def test_a_way_round_is_searched_in_the_state_of_the_decision_and_recorded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    desk = Desk(reference_site(), tmp_path)
    ways = [Detour([(0.0, 0.0, 1.0), (1.0, 0.0, 0.0)], [SLOWER, MOVE]), None]
    made: list[tuple[Any, ...]] = []

    class Search:
        def __init__(self, *parts: Any) -> None:
            made.append(parts)

        def find(self, *asked: Any) -> Detour | None:
            made.append(asked)
            return ways.pop(0)

    monkeypatch.setattr("aeros.runtime.execution.decision_pipeline.DetourSearch", Search)
    box = Reason("AE766", "box", "in the way")
    denied = Decision(DecisionKind.DENY, None, (box, Reason("AE766", "crate", "in the way"), box))
    assert desk.deciding.find_detour(CALLER, denied, MOVE) is None  # before any decision
    assert made == []
    desk.plant.time = 2.5
    desk.decide(MOVE, denied)
    desk.plant.time = 3.5
    assert desk.deciding.find_detour(CALLER, denied, MOVE) == [SLOWER, MOVE]
    assert desk.deciding.find_detour(CALLER, denied, MOVE) is None
    ((_, readings, _, now, usage),) = desk.gate.asked
    motion = desk.configuration.site.motion
    parts = (motion, desk.gate, desk.deciding._motions, desk.plant, readings, now, usage)
    assert made == [parts, (CALLER, denied, MOVE)] * 2
    (record,) = desk.events("detour")
    assert record == {
        "time": 2.5,
        "module": "handling",
        "skill": "lift",
        "inputs": {},
        "asked": {"kind": "move", "parameters": {"speed": 0.1}},
        "round": ["box", "crate"],
        "targets": [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
    }
    desk.plant.time = -1.0  # so the use of quotas is unknown
    denial = desk.decide().decision
    assert desk.deciding.find_detour(CALLER, denial, MOVE) is None
    assert len(made) == 4
    desk.audit.close()


def test_a_body_is_recorded_when_it_differs_from_the_one_before(desk: Desk) -> None:
    short, equal, long = (RobotBody(((0.0, 0.0, 0.0),), (x, 0.0, 0.0), ()) for x in (0.5, 0.5, 0.75))
    digests = [desk.deciding._record_robot_body(body) for body in (short, short, equal, long, long, short)]
    recorded = [one["body"] for one in desk.events("body")]
    assert [digest_of(body_to_json(body)) for body in (short, long, short)] == [
        digests[0],
        digests[3],
        digests[5],
    ]
    assert digests[1:3] == digests[:1] * 2
    assert digests[4] == digests[3]
    assert [digest_of(body) for body in recorded] == [digests[0], digests[3], digests[5]]


def test_a_decision_keeps_the_readings_that_it_was_made_on(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    shared = {"holding": Reading(False, 0.0)}
    monkeypatch.setattr(desk.plant, "observe", lambda: shared)
    decided = desk.decide().active_action
    shared["holding"] = Reading(True, 1.0)
    assert decided is not None
    assert decided.readings == {"holding": Reading(False, 0.0)}
    moment = Snapshot(ColumnNames(["holding"]), (True,), desk.plant.now())
    monkeypatch.setattr(desk.plant, "observe", lambda: moment)
    at_once = desk.decide().active_action
    assert at_once is not None
    assert at_once.readings is moment, "a snapshot never changes, so it is not copied"


def test_a_whole_motion_is_decided_beside_obstacles_and_recorded_with_them(tmp_path: Path) -> None:
    robot = make_plant(load_scene("bare"), 0)
    desk, obstacle = Desk(reference_site(), tmp_path), box(0.45, -0.2, 0.4)
    plant = cast("Plant", Obstructed(robot, obstacle))
    deciding = DecisionPipeline(desk.configuration, cast("Gate", desk.gate), plant, desk.audit)
    denied = deciding.decide(CALLER, to(0.45, -0.45, 0.3), [])
    assert [(reason.code, reason.rule) for reason in denied.decision.reasons] == [(OBSTRUCTED, "box")]
    assert isinstance(denied.plan, Trajectory)
    allowed = deciding.decide(CALLER, to(0.5, 0.1, 0.5), [])
    assert allowed.decision.kind is DecisionKind.ALLOW
    (body,), (first, second) = desk.events("body"), desk.records()
    for record, planned in ((first, denied.plan), (second, allowed.plan)):
        assert record["motion"] == json.loads(json.dumps(motion_to_json(planned, digest_of(body["body"]))))
        assert record["motion_digest"] == digest_of(record["motion"])
        assert record["obstacles"] == json.loads(json.dumps(obstacles_to_json([obstacle])))
    assert (first["gate"]["verdict"], "gate" in second) == ("ALLOW", False)
    robot.close()
    desk.audit.close()
