"""Decisions on whole motions are decided again from the record, and whatever is altered in it is found."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.audit.check import GENESIS, verify_log
from aeros.runtime.canonical_json import digest_of, seal_record
from aeros.runtime.gate.configuration import Configuration, single_configuration
from aeros.runtime.gate.gate import GateMode
from aeros.runtime.ports import MotionCompletion, NoMotion, PlannedMotion, Trajectory
from aeros.runtime.records.records import body_to_json, motion_to_json
from aeros.runtime.records.replay import LogReplay
from aeros.skill import act
from tests.unit.runtime.one_joint import DRIVES, PLAN, TURNS, governed
from tests.unit.runtime.together import Cart, asking, configuration, move, roll

AWAY = replace(PLAN, joint_paths=((((0.5,),) * 4,),))
"""Starts half a radian from where the joint is."""


@cache
def with_motions() -> Configuration:
    """Moves and rolls are decided as whole motions, of one joint."""
    site = governed(configuration().site, "move", "roll")
    return replace(configuration(), site=site, digest="d" * 64)


def altered(**fields: Any) -> Trajectory:
    return replace(PLAN, **fields)


def written(folder: Path, *plans: Any) -> Path:
    """The log of moves, one step each, of which the plant says this."""
    one = Cart(folder / "audit.jsonl", {"reach": asking(move())}, under=with_motions())
    one.plant.values["joint_angle"] = (0.0,)
    for plan in plans:
        one.plant.planned = plan
        one.start("reach")
        one.ends(1)
    one.audit.close()
    return one.log


Change = Callable[[list[dict[str, Any]]], None]


def replayed(log: Path, change: Change | None = None, mode: GateMode = GateMode.COMPILED) -> LogReplay:
    """The log decided again, with its records changed and the chain made anew."""
    records = [json.loads(line) for line in log.read_bytes().splitlines()]
    if change is not None:
        change(records)
    again, previous = log.with_name("again.jsonl"), GENESIS
    with again.open("wb") as file:
        for sequence, record in enumerate(records):
            body = {name: record[name] for name in ("details", "event", "written")}
            body |= {"previous": previous, "sequence": sequence}
            line, previous = seal_record(json.dumps(body, sort_keys=True, separators=(",", ":")).encode())
            file.write(line)
    replay = LogReplay(single_configuration(with_motions()), mode)
    assert verify_log(again, lambda record, _: replay.replay_record(record)).is_sound
    return replay


@pytest.mark.parametrize("mode", GateMode)
def test_replay_decides_any_planned_motion_the_same(mode: GateMode, tmp_path: Path) -> None:
    plans: list[Any] = [
        PLAN, AWAY, PLAN, NoMotion("it waits"), MotionCompletion(False, "too far"), None, "nothing",
        replace(PLAN, duration=0.0), replace(PLAN, joint_paths=()), altered(body=None),
        replace(PLAN, body=replace(PLAN.body, balls=())),
    ]  # fmt: skip
    log = written(tmp_path, *plans)
    replay = replayed(log, mode=mode)
    assert (replay.mismatches, replay.matching_count, replay.verdict_only_count) == ([], len(plans), 0)
    records = [json.loads(line) for line in log.read_bytes().splitlines()]
    bodies = [record["details"]["body"] for record in records if record["event"] == "body"]
    assert len(bodies) == 3  # PLAN's, none, and one without balls
    verdicts = [record["details"]["verdict"] for record in records if record["event"] == "decision"]
    assert verdicts == ["ALLOW", "DENY", *["ALLOW"] * 3, *["DENY"] * 6]


def test_a_log_of_an_older_site_is_decided_anew_under_a_stricter_one(tmp_path: Path) -> None:
    """A site that compares links, too, refuses motions of bodies without hulls: named, and no crash."""
    log = written(tmp_path, PLAN, AWAY)
    site = with_motions().site
    assert site.motion is not None
    stricter = replace(site, motion=replace(site.motion, link_clearance=Fraction(1, 100)))
    replay = LogReplay(single_configuration(replace(with_motions(), site=stricter)), GateMode.COMPILED)
    assert verify_log(log, lambda record, _: replay.replay_record(record)).is_sound
    assert replay.matching_count == 0
    assert len(replay.mismatches) == 2
    assert "AE760" in str(replay.mismatches[0])


def test_a_motion_that_no_record_can_hold_is_compared_by_its_verdict(tmp_path: Path) -> None:
    replay = replayed(written(tmp_path, altered(base=object()), object()))
    assert (replay.mismatches, replay.matching_count, replay.verdict_only_count) == ([], 2, 2)


def two_at_once(log: Path, second: PlannedMotion, *, cancelled: bool = False) -> Cart:
    """A cart whose arm turns, and meanwhile does something else; the turn may be taken back before."""
    one = Cart(log, {"reach": asking(move()), "drive": asking(roll())}, under=with_motions())
    one.plant.values["joint_angle"] = (0.0,)
    plans: dict[str, PlannedMotion] = {"move": TURNS, "roll": second}
    one.plant.plan = lambda action: plans[action.kind]  # type: ignore[method-assign]
    reach = one.start("reach")
    if cancelled:
        assert one.executor.wait(0.0) is None
        assert one.executor.wait(0.01) is None
        one.executor.cancel(reach, "enough")
    one.start("drive")
    one.ends(2)
    one.audit.close()
    return one


@pytest.mark.parametrize(
    ("second", "reason"), [(TURNS, "AE764"), (DRIVES, None), (NoMotion("wheels alone"), None)]
)
def test_replay_decides_a_second_motion_together_with_the_first(
    second: PlannedMotion, reason: str | None, tmp_path: Path
) -> None:
    one = two_at_once(tmp_path / "audit.jsonl", second)
    replay = replayed(one.log)
    assert (replay.mismatches, replay.matching_count) == ([], 2)
    last = one.records("decision")[-1]
    assert [code for code, _, _ in last["reasons"]] == ([reason] if reason else [])
    assert "motion" in last


def test_replay_needs_the_record_numbers_of_halting_motions(
    tmp_path: Path,
) -> None:
    one = two_at_once(tmp_path / "audit.jsonl", DRIVES, cancelled=True)
    replay = replayed(one.log)
    assert (replay.mismatches, replay.matching_count) == ([], 2)
    (found,) = replayed(one.log, lambda records: decisions(records)[-1].pop("halting")).mismatches
    assert (found.recorded["verdict"], found.replayed and found.replayed["verdict"]) == ("DENY", "ALLOW")


# What is altered.


def decisions(records: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [record["details"] for record in records if record["event"] == "decision"]


def says(plan: Trajectory, name: str = "motion") -> dict[str, Any]:
    encoded = motion_to_json(plan, digest_of(body_to_json(plan.body)))
    return {name: encoded, "motion_digest": digest_of(encoded)}


def allowed_after_all(records: list[dict[str, Any]]) -> None:
    first, second = decisions(records)
    second.update({name: copy.deepcopy(first[name]) for name in ("verdict", "decided", "reasons")})
    del second["gate"]


def denied_by_nobody(records: list[dict[str, Any]]) -> None:
    decisions(records)[0].update(verdict="DENY", decided=None, reasons=[["AE761", "joint_angle", "so"]])


def another_reason(records: list[dict[str, Any]]) -> None:
    decisions(records)[1]["reasons"] = [["AE763", "wall", "so"]]


def another_word_of_the_gate(records: list[dict[str, Any]]) -> None:
    decisions(records)[1]["gate"]["verdict"] = "DENY"


def no_word_of_the_gate(records: list[dict[str, Any]]) -> None:
    del decisions(records)[1]["gate"]


def another_motion(records: list[dict[str, Any]]) -> None:
    decisions(records)[0]["motion"]["duration"] = 2.0


def another_motion_with_its_digest(records: list[dict[str, Any]]) -> None:
    decisions(records)[0].update(says(AWAY))


def a_motion_in_order_with_its_digest(records: list[dict[str, Any]]) -> None:
    decisions(records)[1].update(says(PLAN))


def another_digest(records: list[dict[str, Any]]) -> None:
    decisions(records)[0]["motion_digest"] = "0" * 64


def no_motion(records: list[dict[str, Any]]) -> None:
    del decisions(records)[0]["motion"]


def a_motion_of_the_old_form(records: list[dict[str, Any]]) -> None:
    details = decisions(records)[0]
    details["motion"] = details.pop("motion_digest")


def another_body(records: list[dict[str, Any]]) -> None:
    (body,) = (record["details"] for record in records if record["event"] == "body")
    body["body"]["tool"] = [0.0, 0.0, 0.0]


def a_body_recorded_later(records: list[dict[str, Any]]) -> None:
    place = next(n for n, record in enumerate(records) if record["event"] == "body")
    records.append(records.pop(place))


def a_speed_never_stated(records: list[dict[str, Any]]) -> None:
    decisions(records)[0]["decided"]["parameters"]["speed"] = 0.125


def stated_as_impossible(records: list[dict[str, Any]]) -> None:
    encoded = {"completed": False, "reason": "too far"}
    decisions(records)[1].update(motion=encoded, motion_digest=digest_of(encoded))


LACKS = "no record before it holds the body that the motion names"
OTHER = "the motion does not match its recorded digest"
WITHOUT = "a motion must be recorded exactly if one was to be decided"


@pytest.mark.parametrize(
    ("change", "found"),
    [
        (allowed_after_all, [""]),
        (denied_by_nobody, [""]),
        (another_reason, [""]),
        (another_word_of_the_gate, [""]),
        (no_word_of_the_gate, [""]),
        (another_motion, [OTHER]),
        (another_motion_with_its_digest, [""]),
        (a_motion_in_order_with_its_digest, [""]),
        (another_digest, [OTHER]),
        (no_motion, [WITHOUT]),
        (a_motion_of_the_old_form, [OTHER]),
        (another_body, [LACKS, LACKS]),
        (a_body_recorded_later, [LACKS, LACKS]),
        (a_speed_never_stated, [""]),
        (stated_as_impossible, [""]),
    ],
)
def test_altered_records_are_found(change: Change, found: list[str], tmp_path: Path) -> None:
    log = written(tmp_path, PLAN, AWAY)
    assert replayed(log).matching_count == 2
    assert [one.reason for one in replayed(log, change).mismatches] == found


def test_an_action_that_is_no_motion_has_none(tmp_path: Path) -> None:
    one = Cart(tmp_path / "audit.jsonl", {"look": asking(act("wait", duration=1.0))}, under=with_motions())
    one.plant.values["joint_angle"] = (0.0,)
    one.start("look")
    one.ends(1)
    one.audit.close()
    assert replayed(one.log).matching_count == 1

    def add(records: list[dict[str, Any]]) -> None:
        decisions(records)[0].update(motion={"motionless": "so"}, motion_digest="")

    (found,) = replayed(one.log, add).mismatches
    assert found.reason == WITHOUT


def leaves(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the path of each value inside that holds no other one."""
    inner = value.items() if type(value) is dict else enumerate(value) if type(value) is list else ()
    found = [place for key, one in inner for place in leaves(one, (*path, key))]
    yield from found or [path]


def replaced_at(value: Any, path: tuple[Any, ...], change: Callable[[Any], Any]) -> Any:
    if not path:
        return change(value)
    again = copy.copy(value)
    again[path[0]] = replaced_at(value[path[0]], path[1:], change)
    return again


def another(value: Any) -> Any:
    match value:
        case bool():
            return not value
        case int() | float():
            return value + 0.5
        case str():
            return value[:-1] + ("0" if value[-1:] != "0" else "1")
    return {"more": 1} if value == {} else [1] if value == [] else 1


def places(records: list[dict[str, Any]]) -> list[tuple[int, tuple[Any, ...]]]:
    """Every leaf of the records that a replay looks at: which record, and where in its details."""
    looked_at = ("session-opened", "body", "decision")
    return [
        (number, path)
        for number, record in enumerate(records)
        if record["event"] in looked_at
        for path in leaves(record["details"])
    ]


def with_change(
    records: list[dict[str, Any]], number: int, path: tuple[Any, ...], change: Callable[[Any], Any]
) -> list[dict[str, Any]]:
    changed = {**records[number], "details": replaced_at(records[number]["details"], path, change)}
    return [*records[:number], changed, *records[number + 1 :]]


def test_every_other_change_of_a_record_is_found(tmp_path: Path) -> None:
    log = written(tmp_path, PLAN, AWAY)
    records = [json.loads(line) for line in log.read_bytes().splitlines()]
    replay, unfound, count = LogReplay(single_configuration(with_motions())), set(), 0
    for number, path in places(records):
        replay.mismatches.clear()
        for one in with_change(records, number, path, another):
            replay.replay_record(one)
        count += 1
        if not replay.mismatches:
            unfound.add((number, *path))
    assert unfound == set()
    assert count > 50


STRANGE: list[Any] = [
    None, True, -1, 10**400, 1e300, "", "x", [], [[]], {}, {"x": []}, {"float": "nan"}, {"unencodable": "x"},
]  # fmt: skip


@pytest.mark.parametrize("strange", STRANGE, ids=lambda value: str(value)[:20])
def test_a_malformed_record_is_a_mismatch_and_no_crash(strange: Any, tmp_path: Path) -> None:
    records = [json.loads(line) for line in written(tmp_path, PLAN).read_bytes().splitlines()]
    found = places(records)
    # Also in place of everything that holds such a leaf.
    inner = {(number, path[:cut]): None for number, path in found for cut in range(1, len(path))}
    replay, unfound = LogReplay(single_configuration(with_motions())), []
    for number, path in (*found, *inner):
        replay.mismatches.clear()
        for one in with_change(records, number, path, lambda _: strange):
            replay.replay_record(one)
        details = records[number]["details"]
        is_altered = repr(replaced_at(details, path, lambda _: strange)) != repr(details)
        if is_altered and not replay.mismatches:
            unfound.append((number, path))
    # What a record says that could not be encoded is the same as anything that cannot be.
    assert unfound == [] or strange == {"unencodable": "x"}, unfound
    assert all(path[0] in ("decided", "reasons") for _, path in unfound)
