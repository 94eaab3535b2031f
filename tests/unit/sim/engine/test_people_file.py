"""A people file is read whole, or refused with every problem at its place."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.sim.engine.people import DEFAULT_HEIGHT, DEFAULT_RADIUS, Person, Waypoint
from aeros.sim.engine.people_file import read_people, shipped_people
from aeros.spec.diagnostics.errors import UserError

pytestmark = pytest.mark.physics


def test_every_shipped_file_is_read_by_its_name_and_by_its_path() -> None:
    assert len(shipped_people()) >= 3
    for name, path in shipped_people().items():
        assert read_people(name) == read_people(str(path))


def write(folder: Path, body: str) -> str:
    path = folder / "people.yaml"
    path.write_text(f"schema: aeros/people/1\ndescription: Somebody.\npeople:\n  guest:\n{body}")
    return str(path)


def test_a_file_says_all_of_a_person(tmp_path: Path) -> None:
    body = """\
    height: 160 cm
    radius: 200 mm
    floor: -0.5 m
    spread: 5 cm
    delay: 500 ms
    path:
      - {at: [1 m, -2 m], stay: 3 s}
      - {at: [100 cm, 0 m], speed: 1.5 m/s}
      - {at: [0 m, 0 m], arrive: 9 s, stay: 1 s}
"""
    path = (
        Waypoint((1.0, -2.0), dwell=3.0),
        Waypoint((1.0, 0.0), speed=1.5),
        Waypoint((0.0, 0.0), arrival_time=9.0, dwell=1.0),
    )
    assert read_people(write(tmp_path, body)) == (Person("guest", path, 1.6, 0.2, -0.5, 0.05, 0.5),)


@pytest.mark.parametrize(
    ("path", "more", "code", "message"),
    [
        ("[{at: [1 m, 0 m], speed: 1 m/s}]", "", "AE208", "the first waypoint is the start"),
        ("[{at: [1 m, 0 m]}, {at: [2 m, 0 m]}]", "", "AE208", "either `speed` or `arrive`"),
        ("[{at: [1 m, 0 m]}, {at: [2 m, 0 m], speed: 1 m/s, arrive: 1 s}]", "", "AE208", "either"),
        (
            "[{at: [1 m, 0 m]}, {at: [2 m, 0 m], speed: 0 m/s}]",
            "",
            "AE208",
            "walking speed 0 m/s is out of range",
        ),
        (
            "[{at: [1 m, 0 m]}, {at: [2 m, 0 m], speed: 40 m/s}]",
            "",
            "AE208",
            "walking speed 40 m/s is out of range",
        ),
        (
            "[{at: [1 m, 0 m]}, {at: [9 m, 0 m], arrive: 0.1 s}]",
            "",
            "AE208",
            "walking speed 80 m/s is out of range",
        ),
        ("[{at: [1 m, 0 m], stay: 5 s}, {at: [2 m, 0 m], arrive: 4 s}]", "", "AE208", "at 5 s"),
        ("[{at: [1 m, 0 m], stay: -1 s}]", "", "AE208", "is negative"),
        ("[{at: [1 m, 0 m], stay: 1e300 s}]", "", "AE208", "is larger than the limit"),
        ("[{at: [1 m, -1e999 m]}]", "", "AE207", "is beyond"),
        ("[{at: [1 m, 0 m]}]", "height: 1 m\n    radius: 0.6 m", "AE208", "1 m tall, 1.2 m wide"),
        ("[{at: [1 m, 0 m]}]", "radius: 0 m", "AE208", "0 m wide"),
        ("[{at: [1 m, 0 m, 0 m]}]", "", "AE112", "3 entries"),
        ("[]", "", "AE112", "0 entries"),
        ("[{at: [1, 0 m]}]", "", "AE204", "expected a value in m"),
        ("[{at: [1 m, 0 s]}]", "", "AE204", "expected a value in m"),
        ("[{at: [1 m, 0 m], waits: 1 s}]", "", "AE101", "unknown field `waits`"),
    ],
)
def test_an_impossible_walk_is_reported_at_its_place(
    path: str, more: str, code: str, message: str, tmp_path: Path
) -> None:
    with pytest.raises(UserError) as refused:
        read_people(write(tmp_path, f"    path: {path}\n" + (f"    {more}\n" if more else "")))
    (found,) = refused.value.diagnostics
    assert found.code == code
    assert message in found.headline
    assert found.primary is not None


def test_an_unknown_people_file_is_refused_with_the_shipped_names() -> None:
    with pytest.raises(UserError) as refused:
        read_people("at_the_tabel")
    (found,) = refused.value.diagnostics
    assert found.code == "AE002"
    assert found.help == ("did you mean `at_the_table`?",)


def test_a_person_without_more_is_of_usual_size_on_the_floor_of_the_cell(tmp_path: Path) -> None:
    (found,) = read_people(write(tmp_path, "    path: [{at: [1 m, 0 m]}]\n"))
    assert found == Person("guest", (Waypoint((1.0, 0.0)),))
    assert (found.height, found.radius) == (DEFAULT_HEIGHT, DEFAULT_RADIUS)
    assert (found.floor, found.position_spread, found.max_delay) == (None, 0.0, 0.0)


@pytest.mark.parametrize(
    ("more", "height", "radius"),
    [
        ("height: 3 m\n    radius: 1.5 m", 3.0, 1.5),
        ("height: 0.6 m", 0.6, DEFAULT_RADIUS),
        ("radius: 1 mm", DEFAULT_HEIGHT, 0.001),
    ],
)
def test_a_person_may_be_as_wide_as_tall_up_to_3_metres(
    more: str, height: float, radius: float, tmp_path: Path
) -> None:
    (found,) = read_people(write(tmp_path, f"    {more}\n    path: [{{at: [1 m, 0 m]}}]\n"))
    assert (found.height, found.radius) == (height, radius)


@pytest.mark.parametrize(
    "more", ["height: 3.01 m", "height: 1 m\n    radius: 501 mm", "height: -1 m", "delay: -1 s"]
)
def test_an_implausible_person_is_refused(more: str, tmp_path: Path) -> None:
    with pytest.raises(UserError):
        read_people(write(tmp_path, f"    {more}\n    path: [{{at: [1 m, 0 m]}}]\n"))


FIRST = "{at: [0 m, 0 m], stay: 2 s}, {at: [3 m, 0 m], speed: 1 m/s, stay: 1 s}"


@pytest.mark.parametrize(
    ("path", "problem"),
    [
        # 3 m at 1 m/s after 2 s: there at 5 s, left at 6 s.
        (f"[{FIRST}, {{at: [3 m, 3 m], arrive: 7 s}}]", None),
        (
            f"[{FIRST}, {{at: [3 m, 3 m], arrive: 6 s}}]",
            "`arrive` is before the previous waypoint is left, at 6 s",
        ),
        # 3 m in the 0.2 s after an arrival at 5 s and a stay of 1 s.
        (
            "[{at: [0 m, 0 m]}, {at: [3 m, 0 m], arrive: 5 s, stay: 1 s}, {at: [3 m, 3 m], arrive: 6.2 s}]",
            "walking speed 15 m/s is out of range",
        ),
        ("[{at: [0 m, 0 m]}, {at: [3 m, 0 m], speed: 12 m/s}]", None),
        ("[{at: [0 m, 0 m]}, {at: [3 m, 0 m], arrive: 0.25 s}]", None),
        ("[{at: [0 m, 0 m]}, {at: [3 m, 0 m], speed: 12.01 m/s}]", "walking speed 12.01 m/s is out of range"),
        ("[{at: [0 m, 0 m]}, {at: [3 m, 0 m], speed: -1 m/s}]", "`-1 m/s` is negative"),
        ("[{at: [1000 km, 0 m]}]", None),
        ("[{at: [1001 km, 0 m]}]", "`1001 km` is larger than the limit of 1000000"),
    ],
)
def test_a_walk_is_possible_up_to_the_greatest_speed(path: str, problem: str | None, tmp_path: Path) -> None:
    file = write(tmp_path, f"    path: {path}\n")
    if problem is None:
        assert len(read_people(file)) == 1
        return
    with pytest.raises(UserError) as refused:
        read_people(file)
    assert problem in [one.headline for one in refused.value.diagnostics]


def test_all_people_of_a_file_are_checked(tmp_path: Path) -> None:
    body = "    path: [{at: [1 m, 0 m], speed: 1 m/s}]\n  host:\n    path: [{at: [1 m, 0 s]}]\n"
    with pytest.raises(UserError) as refused:
        read_people(write(tmp_path, body))
    assert [one.code for one in refused.value.diagnostics] == ["AE208", "AE204"]
