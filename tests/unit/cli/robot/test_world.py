from __future__ import annotations

import json
import re
from pathlib import Path
from uuid import uuid4

import pytest

from aeros.agent.agent import MEMORY_FILE
from aeros.agent.identity import Identity
from aeros.agent.memory.sightings import Sighting
from aeros.agent.memory.store import open_memory
from aeros.cli.main import main
from aeros.cli.robot.world import _age_text
from aeros.exit_codes import Exit
from aeros.spec.model.task_parameters import instruction_of


@pytest.fixture
def state(tmp_path: Path) -> Path:
    for place in ([1.0, 0.0, 0.4], [3.0, 0.0, 0.0]):
        with open_memory(tmp_path / MEMORY_FILE, Identity(uuid4(), "chef", "", 1), "symbolic") as memory:
            memory.note_sightings(
                [
                    Sighting("cup_position", place, 1.0, "camera", 0.01),
                    Sighting("lid_on", True, 1.0, None, None),
                ]
            )
    return tmp_path


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    code = main(["world", *arguments])
    shown = capsys.readouterr()
    return code, shown.out, shown.err


def test_each_variable_has_value_age_source_uncertainty_and_usual_place(
    state: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, out, _ = run(capsys, "--state", str(state))
    assert code == Exit.SUCCESS
    cup, lid = out.splitlines()
    assert cup.startswith("cup_position  (3, 0, 0), ")
    assert cup.endswith(
        " s ago in session 2, by camera, ± 0.01 at most, at first the same in 1 of 2 sessions"
    )
    assert lid.startswith("lid_on        true, ")
    assert lid.endswith(" s ago in session 2, at first the same in 2 of 2 sessions")


def test_variables_are_selected_by_text_and_plant(state: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _, out, _ = run(capsys, "cup", "--state", str(state), "--format", "json")
    data = json.loads(out)
    assert data["schema"] == "aeros/world/1"
    (cup,) = data["variables"]
    assert (cup["variable"], cup["value"], cup["sessions"]) == ("cup_position", [3.0, 0.0, 0.0], 2)
    assert 0 <= cup["age_s"] < 600
    assert run(capsys, "--plant", "physics", "--state", str(state))[1] == "nothing was seen\n"


def test_without_memory_there_is_no_world(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, _, err = run(capsys, "--state", str(tmp_path))
    assert code == Exit.REJECTED
    assert "nothing is remembered here" in err


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.2, "0 s"), (59.0, "59 s"), (150.0, "2 min"), (7300.0, "2 h"), (200_000.0, "2 d")]
)
def test_ages_are_in_the_largest_unit(seconds: float, text: str) -> None:
    assert _age_text(seconds) == text


def test_a_thing_has_its_kind_and_place_and_each_attribute_its_age(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    earlier = [
        Sighting("thing fetch.object can position", [1.0, 0.5, 0.25], 1.0, "fetch", 0.01),
        Sighting("thing fetch.object can on tray", True, 1.0, "fetch", None),
        Sighting("thing fetch.crumb crumb count", 3, 1.0, "fetch", None),
    ]
    later = [Sighting("thing fetch.object can held", False, 1.0, "fetch", None)]
    for seen in (earlier, later):
        with open_memory(tmp_path / MEMORY_FILE, Identity(uuid4(), "chef", "", 1), "symbolic") as memory:
            memory.note_sightings(seen)
    _, out, _ = run(capsys, "--state", str(tmp_path))
    crumb, can = (re.sub(r"\d+ s ago", "0 s ago", line) for line in out.splitlines())
    assert crumb == "fetch.crumb   crumb: 3 of them, 0 s ago in session 1"
    first, second = can.removeprefix("fetch.object  can: ").split("; ")
    assert {first, second} == {
        "at (1, 0.5, 0.25) m ± 0.01 m, on tray, 0 s ago in session 1",
        "not held, 0 s ago in session 2",
    }
    _, out, _ = run(capsys, "object", "--state", str(tmp_path), "--format", "json")
    (thing,) = json.loads(out)["things"]
    assert (thing["name"], thing["kind"]) == ("fetch.object", "can")
    assert thing["attributes"]["position"]["value"] == [1.0, 0.5, 0.25]
    assert thing["attributes"]["held"]["age_s"] >= 0


def test_a_parameter_is_from_the_instruction(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with open_memory(tmp_path / MEMORY_FILE, Identity(uuid4(), "chef", "", 1), "symbolic") as memory:
        memory.note_sightings([Sighting("tea.cups", 2, 1.0, instruction_of("tea"), None)])
    assert run(capsys, "--state", str(tmp_path))[1].endswith(" ago in session 1, said by the instruction\n")
