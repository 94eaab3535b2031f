"""Faults of effects on quantities."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.spec.faults import messages_of_module

DONE = "done: {effects: {washed: += 1}}"
PUSHED = "sponge_position.y: in [395 mm, 420 mm]"


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        (DONE, "done: {effects: {washed: -= 1}}", []),
        (DONE, "done: {effects: {washed: += 0.5}}", ["error[AE203]"]),
        (DONE, "done: {effects: {washed: += 0}}", ["error[AE111]"]),
        (DONE, "done: {effects: {washed: += 1 mm}}", ["error[AE204]"]),
        (DONE, "done: {effects: {number: += 1}}", ["error[AE203]"]),
        (DONE, "done: {effects: {sponge_at_edge: += 1}}", ["error[AE203]"]),
        (DONE, 'done: {effects: {washed: "in [1, 2]"}}', ["error[AE203]"]),
        (DONE, "done: {effects: {load: += 1 kg}}", ["error[AE203]"]),
        (DONE, 'done: {effects: {load: "in [1 kg, 2 kg]"}}', []),
        (DONE, 'done: {effects: {load.x: "in [1 kg, 2 kg]"}}', ["error[AE203]"]),
        (DONE, 'done: {effects: {joint_angle: "in [1 rad, 2 rad]"}}', ["error[AE203]"]),
        (DONE, "done: {effects: {payload: 1 kg}}", ["error[AE122]"]),
        ("range: [0, 3], max_age", "range: [0, 64], max_age", ["error[AE111]"]),
        (PUSHED, "sponge_position.y: in [420 mm, 395 mm]", ["error[AE111]"]),
        (PUSHED, "sponge_position.y: in [395 mm, 4 m]", ["error[AE111]"]),
        (PUSHED, "sponge_position.y: in [395 mm, 2 s]", ["error[AE204]"]),
        (PUSHED, "sponge_position.w: in [395 mm, 420 mm]", ["error[AE122]"]),
        (PUSHED, "sponge_position: in [395 mm, 420 mm]", ["error[AE203]"]),
        (PUSHED, 'sponge_position: "vec(0 m, 0 m, 0 m)"', ["error[AE203]"]),
    ],
)
def test_faults_of_an_effect(tmp_path: Path, old: str, new: str, found: list[str]) -> None:
    messages = messages_of_module(tmp_path, (old, new), case="counts_and_ranges")
    assert [one.partition(" ")[0] for one in messages] == found, messages
