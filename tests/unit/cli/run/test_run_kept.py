"""Recordings of a run: a film and an MCAP file; and a window while it runs."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections import defaultdict
from itertools import pairwise
from math import nextafter
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import fromstring

import msgspec
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.rosbag2 import Reader

from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.runtime.audit.log import verify_log
from aeros.runtime.bus import messages
from aeros.runtime.bus.messages import Message, Time
from aeros.sim.film.recording import read_recording
from tests.unit.runtime.bus.test_messages import STORE, plain

REPOSITORY = Path(__file__).parents[4]
KINDS = {
    one.ros: one
    for one in vars(messages).values()
    if isinstance(one, type) and issubclass(one, Message) and one is not Message
}


def arguments(folder: Path, *more: str, task: str = "make dumplings") -> list[str]:
    return ["run", task, "--ecms", str(REPOSITORY / "ecms"), "--state", str(folder / "state"),
            "--out", str(folder / "out"), *more]  # fmt: skip


def messages_in(file: Path) -> dict[str, list[tuple[int, Any]]]:
    """Every message by topic, with the time under which it is kept, ns."""
    found: dict[str, list[tuple[int, Any]]] = defaultdict(list)
    with Reader(file) as reader:
        for connection, time_, data in reader.messages():
            if connection.msgtype.startswith("foxglove_msgs/"):
                continue  # Topics for viewers, which `test_live_view` decodes.
            there = STORE.deserialize_cdr(data, connection.msgtype)
            message = msgspec.convert(plain(there), KINDS[connection.msgtype])
            found[connection.topic].append((time_, message))
    return found


def lines_of(file: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]


def seconds(time_: Time) -> float:
    return time_.sec + time_.nanosec / 1e9


def state_topic(name: str) -> str:
    """Return the topic of a state variable."""
    return f"/aeros/state/{name.replace('.', '/')}"


_JOINT_STATES = ("joint_position", "joint_velocity", "joint_torque")
"""Names in the vocabulary of what a message of /joint_states has."""


FIRST_NUMBERS = {"make_dumplings.count": 1.0, "make_dumplings.dumplings_cooked": 0.0}
"""Values of the numbers in goals at the start of a run."""


def value_of(message: Any, name: str) -> Any:
    """Return the value that the message has of a name in the site's vocabulary."""
    if name in _JOINT_STATES:
        return list(getattr(message, {"p": "position", "v": "velocity", "t": "effort"}[name[6]]))
    return [message.point.x, message.point.y, message.point.z] if "point" in dir(message) else message.value


def check_against_the_records(
    file: Path, out: Path, least: int, goal: str
) -> dict[str, list[tuple[int, Any]]]:
    """Check the file, with over `least` decisions, against trace and audit log; return its messages."""
    received, records, trace = messages_in(file), lines_of(out / "audit.jsonl"), lines_of(out / "trace.jsonl")
    events = [message for _, message in received["/aeros/events"]]
    assert [(one.record, one.event, json.loads(one.details)) for one in events] == [
        (record["sequence"], record["event"], record["details"]) for record in records
    ]
    decided = [record for record in records if record["event"] == "decision"]
    assert len(decided) > least
    text = [
        (one.record, one.module, one.skill, one.verdict, json.loads(one.action), json.loads(one.reasons))
        for _, one in received["/aeros/decisions"]
    ]
    names = ("module", "skill", "verdict", "decided", "reasons")
    assert text == [(record["sequence"], *(record["details"][name] for name in names)) for record in decided]
    compared = set()
    at: dict[tuple[str, int], list[Any]] = defaultdict(
        list
    )  # several, where a plant is at two places at once
    for topic, kept in received.items():
        for time_, message in kept:
            at[topic, time_].append(message)
    for record in decided:
        for name, (value, measured) in record["details"]["state"].items():
            if name == "joint_torque_rate":
                continue  # no message of ROS has it
            topic = "/joint_states" if name in _JOINT_STATES else state_topic(name)
            there = at[topic, max(0, round(measured * 1e9))]
            assert value in [value_of(message, name) for message in there], (topic, measured)
            compared.add(name)
    assert {"joint_position", "tool_position", "tool_speed", "estop_pressed", goal} <= compared
    notes = [json.loads(one.details) for one in events if one.event == "note"]
    assert [(one["event"], one["details"]) for one in notes] == [
        (line["kind"], line["details"]) for line in trace
    ]
    ended = trace[-1]
    assert ended["kind"] == "run-ended"
    for name, value in ended["details"]["measured"].items():
        values = [message for _, message in received[state_topic(name)]]
        first = False if isinstance(values[0].value, bool) else FIRST_NUMBERS[name]
        assert (values[0].value, values[-1].value) == (first, value)
        assert seconds(values[-1].header.stamp) <= nextafter(ended["time"], 1e9) + 1e-9
    return received


@pytest.mark.parametrize(
    ("plant", "task", "least", "goal"),
    [
        ("symbolic", "make dumplings", 50, "make_dumplings.dumpling_wrapped"),
        pytest.param(
            "kinematic", "fetch the object", 20, "fetch_object.object_delivered", marks=pytest.mark.deep
        ),
        pytest.param(
            "physics",
            "fetch the object",
            20,
            "fetch_object.object_delivered",
            marks=[pytest.mark.physics, pytest.mark.deep],
        ),
    ],
)
def test_an_mcap_file_says_what_trace_and_audit_log_say(
    plant: str, task: str, least: int, goal: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "kept" / "run.mcap"
    given = ["--plant", plant, "--mcap", str(file)] + (["--no-film"] if plant == "physics" else [])
    assert main(arguments(tmp_path, *given, task=task)) == Exit.SUCCESS
    assert f"mcap       {file}\n" in capsys.readouterr().out
    assert list(file.parent.iterdir()) == [file]
    received = check_against_the_records(file, tmp_path / "out", least, goal)
    simulated = lines_of(tmp_path / "out" / "trace.jsonl")[-1]["time"]
    if plant == "symbolic":
        assert "/tf" not in received
        return
    ticks = round(simulated * 240)
    assert len(received["/joint_states"]) == ticks + 1
    # The chain is known from the first motion on; a look of 24 ticks comes before it.
    assert ticks - 25 <= len({time_ for time_, _ in received["/tf"]}) <= ticks + 1
    # More than one at a time only where a plan came from another chain.
    assert len(received["/tf"]) <= ticks + 2 + len(received["/aeros/decisions"])
    ((_, fixed),) = received["/tf_static"]
    assert [one.child_frame_id for one in fixed.transforms] == ["tool"]
    for time_, message in received["/tf"][:: ticks // 50]:
        frames = [one.child_frame_id for one in message.transforms]
        assert frames[-7:] == [f"j{joint}_link" for joint in range(1, 8)]
        assert round(seconds(message.transforms[0].header.stamp) * 1e9) == time_


def test_the_file_alone_says_how_to_read_it(tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    assert main(arguments(tmp_path, "--plant", "symbolic", "--mcap", str(file))) == Exit.SUCCESS
    ours = messages_in(file)
    counts: dict[str, int] = defaultdict(int)
    with file.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        assert summary is not None
        assert {schema.encoding for schema in summary.schemas.values()} == {"ros2msg"}
        assert all(schema.data for schema in summary.schemas.values())
        for schema, channel, message, there in reader.iter_decoded_messages():
            if schema is not None and schema.name.startswith("foxglove_msgs/"):
                continue
            time_, own = ours[channel.topic][counts[channel.topic]]
            counts[channel.topic] += 1
            assert message.log_time == time_
            for field in ("value", "verdict", "details", "event"):
                if hasattr(own, field):
                    assert repr(getattr(there, field)) == repr(getattr(own, field))  # NaN is NaN
    assert counts == {topic: len(received) for topic, received in ours.items()}


@pytest.mark.deep
def test_only_the_chosen_topics_are_kept_and_they_show_the_arm(tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    chosen = ["/robot_description", "/tf_static", "/tf=5", "/aeros/[dl]*"]
    options = [word for topic in chosen for word in ("--keep", topic)]
    given = ["--plant", "kinematic", "--mcap", str(file), *options]
    assert main(arguments(tmp_path, *given, task="fetch the object")) == Exit.SUCCESS
    kept = messages_in(file)
    assert set(kept) == {"/robot_description", "/tf_static", "/tf", "/aeros/decisions", "/aeros/log"}
    times = [time_ for time_, _ in kept["/tf"]]
    assert all(later - one > 0.2e9 - 1e4 for one, later in pairwise(times))
    assert len(times) > 0.9 * 5.0 * (times[-1] - times[0]) * 1e-9
    # Each link of the description has a place in the world, by the transforms that the file has.
    ((_, description),) = kept["/robot_description"]
    links = {link.attrib["name"] for link in fromstring(description.data).findall("link")}  # noqa: S314
    ((_, fixed),) = kept["/tf_static"]
    assert any(moving.transforms[0].child_frame_id == "base" for _, moving in kept["/tf"])
    for _, moving in kept["/tf"]:
        known = {"world"}
        for one in (*moving.transforms, *fixed.transforms):
            if one.header.frame_id in known:
                known.add(one.child_frame_id)
        assert links <= known or moving.transforms[0].child_frame_id != "base"


def test_a_topic_that_does_not_exist_is_refused_before_anything_moves(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "run.mcap"
    given = ["--plant", "symbolic", "--mcap", str(file), "--keep", "/joint_state"]
    assert main(arguments(tmp_path, *given)) == Exit.REJECTED
    assert (
        "--keep: no topic is called `/joint_state`: did you mean `/joint_states`?" in capsys.readouterr().err
    )
    assert not file.exists()
    assert not (tmp_path / "out").exists()  # nor is an empty folder left


def test_topics_are_chosen_for_a_recording_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments(tmp_path, "--plant", "symbolic", "--keep", "/tf")) == Exit.USAGE
    assert "--keep chooses topics of a recording: give --bag FOLDER or --mcap FILE" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("given", "text"),
    [
        (["--film", "run.avi"], "`run.avi`: expected a file named *.mp4, *.webp, *.gif"),
        (["--film", "run"], "`run`: expected a file named *.mp4, *.webp, *.gif"),
        (["--mcap", "run.bag"], "`run.bag`: expected a file named *.mcap"),
        (["--film", "run.gif", "--no-film"], "not allowed with argument --film"),
        (["--mcap", "run.mcap", "--bag", "bag"], "not allowed with argument --mcap"),
        (["--mcap", "run.mcap", "--keep", "tf"], "`tf` is no topic: names begin with `/`"),
        (["--mcap", "run.mcap", "--keep", "/tf=0"], "`0` is no rate: give messages in a second, as `/tf=10`"),
    ],
)
def test_contradictory_options_are_refused(
    given: list[str], text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments(tmp_path, *given))
    assert ended.value.code == Exit.USAGE
    assert text in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("plant", ["symbolic", "kinematic"])
@pytest.mark.parametrize("given", [["--film", "run.gif"], ["--view"]])
def test_a_plant_in_which_there_is_nothing_to_be_seen_refuses_to_show_it(
    plant: str, given: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments(tmp_path, "--plant", plant, *given)) == Exit.REJECTED
    assert f"`{given[0]}` needs the physics plant: the {plant} plant has no image" in capsys.readouterr().err
    assert not (tmp_path / "out" / "audit.jsonl").exists()


def test_a_file_that_is_there_is_refused_before_anything_moves(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "run.mcap"
    file.write_bytes(b"mine")
    assert main(arguments(tmp_path, "--plant", "symbolic", "--mcap", str(file))) == Exit.REJECTED
    assert f"`{file}` exists already; give a new file with --mcap" in capsys.readouterr().err
    assert file.read_bytes() == b"mine"
    assert not (tmp_path / "out" / "audit.jsonl").exists()


@pytest.mark.physics
def test_a_film_that_is_there_is_refused_before_anything_moves(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    film = tmp_path / "run.gif"
    film.write_bytes(b"mine")
    assert main(arguments(tmp_path, "--film", str(film))) == Exit.REJECTED
    assert f"`{film}` exists already; give another file with --film" in capsys.readouterr().err
    assert film.read_bytes() == b"mine"
    assert not (tmp_path / "out" / "audit.jsonl").exists()


@pytest.mark.physics
def test_without_a_display_a_view_is_refused_before_anything_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    assert main(arguments(tmp_path, "--view")) == Exit.REJECTED
    assert "--view: there is no display: DISPLAY is not set" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def moving(folder: Path, decisions: int) -> subprocess.Popen[bytes]:
    """A run that is recorded and kept, so many decisions into its task."""
    given = ["--mcap", str(folder / "run.mcap")]
    command = [sys.executable, "-m", "aeros", *arguments(folder, *given)]
    run = subprocess.Popen(command, cwd=REPOSITORY, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    audit, late = folder / "out" / "audit.jsonl", time.monotonic() + 120.0
    while not audit.exists() or audit.read_bytes().count(b'"event":"decision"') < decisions:
        assert time.monotonic() < late
        assert run.poll() is None
        time.sleep(0.02)
    return run


@pytest.mark.physics
def test_an_interrupted_run_leaves_a_recording_and_a_file_up_to_there(tmp_path: Path) -> None:
    run = moving(tmp_path, 6)
    run.send_signal(signal.SIGINT)
    _, text = run.communicate(timeout=120.0)
    assert b"stopping the robot; press Ctrl-C again to exit at once" in text
    assert run.returncode == Exit.INTERRUPTED
    assert len(read_recording(tmp_path / "out" / "poses.jsonl").samples) > 30
    received = messages_in(tmp_path / "run.mcap")
    recorded = verify_log(tmp_path / "out" / "audit.jsonl").records
    assert len(received["/aeros/events"]) == recorded
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "run.mcap", "state"]


@pytest.mark.physics
def test_a_killed_run_leaves_of_the_messages_what_was_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = moving(tmp_path, 2)
    run.kill()
    run.communicate(timeout=60.0)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "run.mcap.part", "state"]
    again = ["--plant", "symbolic", "--mcap", str(tmp_path / "run.mcap"), "--out", str(tmp_path / "again")]
    assert main(arguments(tmp_path, *again)) == Exit.REJECTED
    assert "run.mcap.part" in (text := capsys.readouterr().err)
    assert "exists already" in text
