from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from rosbags.rosbag2 import Reader

from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.runtime.audit.log import verify_log
from aeros.runtime.isolation.layers import IsolationLayer
from aeros.runtime.isolation.zygote_pool import ZygotePool
from aeros.sim.film.recording import read_recording
from aeros.spec.text.discovery import reference_site_path

REPOSITORY = Path(__file__).parents[4]


def _run(folder: Path, *arguments: str, instruction: str = "make dumplings") -> int:
    modules = () if "--ecms" in arguments else ("--ecms", str(REPOSITORY / "ecms"))
    return main(
        ["run", instruction, *modules, "--state", str(folder / "state"), "--out", str(folder / "out"),
         *arguments]
    )  # fmt: skip


@pytest.mark.parametrize("gate", ["compiled", "z3", "checked"])
def test_the_same_seed_ends_the_same_under_every_gate(
    gate: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _run(tmp_path, "--plant", "symbolic", "--seed", "7", "--gate", gate) == Exit.SUCCESS
    message = capsys.readouterr().out
    assert "goal reached" in message
    assert "steps      6 run, 0 retries, 1 recovery, 2 re-plans" in message
    assert "0 denied" in message


@pytest.mark.deep  # tests/modules/test_kinematic.py does the tasks without the command
@pytest.mark.parametrize("instruction", ["fetch the object", "clean the table", "make dumplings"])
def test_every_task_is_done_on_the_kinematic_plant(
    instruction: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _run(tmp_path, "--plant", "kinematic", instruction=instruction) == Exit.SUCCESS
    message = capsys.readouterr().out
    assert "(kinematic plant)" in message
    assert "0 attenuated, 0 denied" in message


@pytest.mark.parametrize("plant", ["kinematic", "physics"])
def test_a_scene_that_is_not_there_is_refused(
    plant: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    module = tmp_path / "ecms" / "make_dumplings"
    shutil.copytree(REPOSITORY / "ecms" / "make_dumplings", module)
    manifest = module / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace("scene: dumpling_bench", "scene: kitchen"))
    assert main(["verify", str(module), "--no-cache"]) == Exit.SUCCESS
    assert _run(tmp_path, "--plant", plant, "--ecms", str(module)) == Exit.REJECTED
    assert (
        "the scene of `make_dumplings` is `kitchen`, but there is only bare, box_on_the_bench, "
        "dumpling_bench, shelf_behind" in capsys.readouterr().err
    )


def test_a_run_leaves_a_trace_and_a_sound_log_that_says_where_skill_code_ran(tmp_path: Path) -> None:
    assert _run(tmp_path, "--plant", "symbolic") == Exit.SUCCESS
    events = [json.loads(line) for line in (tmp_path / "out" / "trace.jsonl").read_text().splitlines()]
    assert [event["kind"] for event in events][:2] == ["task-selected", "lifecycle"]
    assert events[-1]["kind"] == "run-ended"
    report = verify_log(tmp_path / "out" / "audit.jsonl")
    assert report.bad_record is None
    assert report.decisions.allowed > 50
    assert report.decisions.denied == 0
    lines = (tmp_path / "out" / "audit.jsonl").read_text().splitlines()
    (record,) = [json.loads(line) for line in lines if '"event":"isolation"' in line]
    modules = ["clean_table", "fetch_object", "inspect_table", "make_dumplings", "serve_table"]
    assert record["details"]["isolated"] == modules
    assert record["details"]["trusted"] == []
    assert set(record["details"]["layers"]) == {one.value for one in IsolationLayer}


def test_an_instruction_that_nobody_can_carry_out_is_refused_by_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _run(tmp_path, "--plant", "symbolic", instruction="paint the wall") == Exit.REJECTED
    assert "no installed module provides `paint the wall`" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_folder_that_holds_another_run_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "audit.jsonl").write_text("")
    assert _run(tmp_path, "--plant", "symbolic") == Exit.REJECTED
    assert "is not empty" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("file", "old", "new", "code"),
    [
        ("ecm.yaml", "description: Makes", "description: makes", "AE902"),
        ("skills.py", '"""', '"""Edited. ', "AE902"),
        ("ecm.lock", "PROVED", "proved", "AE903"),
    ],
)
def test_nothing_runs_that_was_edited_after_it_was_certified(
    file: str, old: str, new: str, code: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    module = tmp_path / "ecms" / "make_dumplings"
    shutil.copytree(REPOSITORY / "ecms" / "make_dumplings", module)
    text = (module / file).read_text()
    assert old in text
    (module / file).write_text(text.replace(old, new, 1))
    assert _run(tmp_path, "--plant", "symbolic", "--ecms", str(module)) == Exit.REJECTED
    assert code in capsys.readouterr().err


def test_nothing_runs_without_a_certificate(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    module = tmp_path / "ecms" / "make_dumplings"
    shutil.copytree(REPOSITORY / "ecms" / "make_dumplings", module)
    (module / "ecm.lock").unlink()
    assert _run(tmp_path, "--plant", "symbolic", "--ecms", str(module)) == Exit.REJECTED
    assert "AE901" in capsys.readouterr().err


def test_a_skill_that_asks_for_more_than_it_declares_is_denied_and_nothing_moves(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    module = tmp_path / "ecms" / "make_dumplings"
    shutil.copytree(REPOSITORY / "ecms" / "make_dumplings", module)
    code = (module / "skills.py").read_text()
    (module / "skills.py").write_text(code.replace("pace = inputs", "pace = 2 * inputs"))
    assert main(["verify", str(module)]) == Exit.SUCCESS
    assert _run(tmp_path, "--plant", "symbolic", "--ecms", str(module)) == Exit.REJECTED
    assert "AE730" in capsys.readouterr().out
    lines = (tmp_path / "out" / "audit.jsonl").read_text().splitlines()
    decisions = [json.loads(line) for line in lines if '"event":"decision"' in line]
    assert decisions[-1]["details"]["verdict"] == "DENY"


def _lacking_host(preload: object) -> ZygotePool:
    host = ZygotePool(["math"])
    host.missing = {**host.missing, IsolationLayer.LANDLOCK: "left out by a test"}
    return host


def _strict_site(folder: Path) -> Path:
    text = Path(reference_site_path()).read_text()
    warns = next(line for line in text.splitlines() if "missing: warn" in line)
    (folder / "site.yaml").write_text(text.replace(warns, "    missing: refuse"))
    return folder / "site.yaml"


def test_isolated_or_trusted_the_same_seed_makes_the_same_decisions(tmp_path: Path) -> None:
    trusting = tmp_path / "trusting.yaml"
    text = Path(reference_site_path()).read_text()
    warns = next(line for line in text.splitlines() if "missing: warn" in line)
    trusting.write_text(text.replace(warns, "    trusted: [clean_table, fetch_object, make_dumplings]"))
    shutil.copytree(REPOSITORY / "ecms", tmp_path / "ecms")
    assert main(["verify", str(tmp_path / "ecms"), "--site", str(trusting)]) == Exit.SUCCESS
    ways = {
        "isolated": [],
        "trusted": ["--site", str(trusting), "--ecms", str(tmp_path / "ecms")],
    }
    for way, arguments in ways.items():
        assert _run(tmp_path / way, "--plant", "symbolic", "--seed", "7", *arguments) == Exit.SUCCESS
    isolated, trusted = (_decided(tmp_path / way / "out" / "audit.jsonl") for way in ways)
    assert isolated == trusted
    assert len(isolated) > 50


def _decided(log: Path) -> list[dict[str, object]]:
    """Return the decisions with their readings, without the configuration's digest."""
    records = [json.loads(line) for line in log.read_text().splitlines()]
    details = [record["details"] for record in records if record["event"] == "decision"]
    return [{name: value for name, value in one.items() if name != "configuration"} for one in details]


def test_less_isolation_than_the_site_requires_is_reported_loudly(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("aeros.runtime.isolation.run_factory.ZygotePool", _lacking_host)
    assert _run(tmp_path, "--plant", "symbolic") == Exit.SUCCESS
    assert "isolated less than the site requires (landlock: left out by a test" in capsys.readouterr().err
    assert "missing: left out by a test" in (tmp_path / "out" / "audit.jsonl").read_text()


def test_less_isolation_than_the_site_requires_is_refused_before_anything_starts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    site = str(_strict_site(tmp_path))
    shutil.copytree(REPOSITORY / "ecms", tmp_path / "ecms")
    assert main(["verify", str(tmp_path / "ecms"), "--site", site]) == Exit.SUCCESS
    monkeypatch.setattr("aeros.runtime.isolation.run_factory.ZygotePool", _lacking_host)
    arguments = ["--plant", "symbolic", "--site", site, "--ecms", str(tmp_path / "ecms")]
    assert _run(tmp_path, *arguments) == Exit.REJECTED
    assert "this host lacks (landlock: left out by a test)" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.deep  # tests/repo/pages/test_readme.py and test_plants_page.py run and record the same
@pytest.mark.physics
def test_an_object_is_fetched_on_physics_and_recorded(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _run(tmp_path, "--seed", "3", instruction="fetch the object") == Exit.SUCCESS
    assert "measured   fetch_object.object_delivered = true (physics plant)" in capsys.readouterr().out
    assert len(read_recording(tmp_path / "out" / "poses.jsonl").samples) > 300


def test_a_bag_holds_each_decision_and_where_the_joints_were(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = tmp_path / "bag"
    assert _run(tmp_path, "--plant", "symbolic", "--bag", str(bag)) == Exit.SUCCESS
    assert f"bag        {bag}/\n" in capsys.readouterr().out
    with Reader(bag) as reader:
        counts = {one.topic: one.msgcount for one in reader.connections}
    report = verify_log(tmp_path / "out" / "audit.jsonl")
    assert counts["/aeros/events"] == report.records
    assert counts["/aeros/decisions"] == report.decisions.allowed > 50
    assert counts["/joint_states"] > 50
    assert counts["/aeros/state/tool_position"] > 10


def test_a_bag_in_a_folder_that_is_there_is_refused_before_anything_moves(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _run(tmp_path, "--plant", "symbolic", "--bag", str(tmp_path)) == Exit.REJECTED
    message = capsys.readouterr().err
    assert "exists already" in message
    assert "give a new folder with --bag" in message
    assert not (tmp_path / "out" / "audit.jsonl").exists()


def test_a_bag_needs_what_writes_bags(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "aeros.runtime.bus.recording.bag", None)
    assert _run(tmp_path, "--plant", "symbolic", "--bag", str(tmp_path / "bag")) == Exit.REJECTED
    assert "--bag needs `pip install '.[ros]'`" in capsys.readouterr().err


def test_without_a_bag_nothing_of_ros_is_imported() -> None:
    script = (  # `--help` ends by SystemExit(0)
        "import sys; from aeros.cli.main import main\n"
        "try: main(['run', '--help'])\n"
        "finally: assert not {'rosbags', 'numpy'} & set(sys.modules)\n"
    )
    ran = subprocess.run([sys.executable, "-c", script], cwd=REPOSITORY, capture_output=True, check=False)
    assert ran.returncode == 0, ran.stderr


def test_a_plant_without_people_refuses_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert _run(tmp_path, "--plant", "symbolic", "--people", "at_the_bench") == Exit.REJECTED
    assert "`--people` needs the physics plant" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.physics
def test_people_that_cannot_be_are_refused_with_the_line_before_anything_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "people.yaml"
    file.write_text("schema: aeros/people/1\ndescription: x\npeople: {guest: {path: [{at: [1 m, 2 kg]}]}}\n")
    assert _run(tmp_path, "--people", str(file)) == Exit.REJECTED
    assert "error[AE204]" in (message := capsys.readouterr().err)
    assert "people.yaml:3:" in message
    assert not (tmp_path / "out").exists()
