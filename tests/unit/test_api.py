"""The public names: lazy, typed, documented by examples that run, and clear about bad input."""

from __future__ import annotations

import doctest
import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import aeros
import aeros.api
from aeros.sim.conformance.suite import ConformanceError
from aeros.sim.fake import FakePlant
from aeros.spec.diagnostics.errors import MisuseError, UserError
from tests.repo.pages.api_page import PUBLIC, examples
from tests.repo.tree import ROOT
from tests.unit.sim.conformance.subjects import SUBJECTS

_PROGRAMS = sorted((ROOT / "tests" / "unit" / "api_programs").glob("*.py"))
_LONGEST_PROGRAM = 10


@pytest.fixture(scope="module")
def modules(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("api")
    shutil.copytree(ROOT / "ecms", folder / "ecms")
    return folder


@pytest.fixture(autouse=True)
def _where_modules_are(modules: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(modules)


# Names.


def test_there_are_at_most_twelve_names() -> None:
    assert len(PUBLIC) <= 12
    assert sorted(PUBLIC) == sorted(aeros.api.__all__)
    assert set(PUBLIC) <= set(dir(aeros))
    for name in PUBLIC:
        assert getattr(aeros, name) is getattr(aeros.api, name)


def test_another_name_is_no_attribute() -> None:
    with pytest.raises(AttributeError, match="module 'aeros' has no attribute 'absent'"):
        aeros.absent  # type: ignore[attr-defined]  # noqa: B018


def test_importing_aeros_imports_nothing_else() -> None:
    script = "import sys; before = set(sys.modules); import aeros; print(*set(sys.modules) - before)"
    found = subprocess.run(
        [sys.executable, "-c", script], check=True, capture_output=True, text=True, cwd=ROOT
    )
    assert found.stdout.split() == ["aeros"]


def test_a_command_imports_neither_the_public_names_nor_a_session() -> None:
    script = (
        "import sys\nfrom aeros.cli.main import main\n"
        "try: main(['--version'])\nfinally: print(*(one for one in sys.modules if one.startswith('aeros.')))"
    )
    found = subprocess.run(
        [sys.executable, "-c", script], check=False, capture_output=True, text=True, cwd=ROOT
    )
    assert "aeros.cli.main" in found.stdout
    assert not re.search(r"aeros\.(api|session|agent|runtime|sim)\b", found.stdout)


# Examples and programs.


@pytest.mark.parametrize(("name", "example"), examples().items(), ids=examples())
def test_the_example_shows_what_happens(name: str, example: str) -> None:
    test = doctest.DocTestParser().get_doctest(example, {"aeros": aeros}, name, None, None)
    assert test.examples
    message: list[str] = []
    found = doctest.DocTestRunner().run(test, out=message.append)
    assert found.failed == 0, "".join(message)


def test_every_public_name_has_an_example() -> None:
    assert set(PUBLIC) <= set(examples())


@pytest.mark.parametrize("path", _PROGRAMS, ids=lambda path: path.stem)
def test_the_program_runs_and_is_short(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree("ecms", tmp_path / "ecms")
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(path), run_name="__main__")
    assert capsys.readouterr().out
    assert len([line for line in path.read_text().splitlines() if line]) <= _LONGEST_PROGRAM


def test_programs_pass_mypy_strict_and_a_wrong_one_does_not(tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.py"
    wrong.write_text(
        "import aeros\n"
        "aeros.absent()\n"
        "aeros.load_gate(3)\n"
        'aeros.open_session("ecms", plant=7)\n'
        'x: str = aeros.act("wait", duration=1.0)\n'
    )
    command = [
        sys.executable,
        "-m",
        "mypy",
        "--strict",
        "--no-error-summary",
        *map(str, _PROGRAMS),
        str(wrong),
    ]
    found = subprocess.run(command, check=False, capture_output=True, text=True, cwd=ROOT)
    lines = re.findall(r"^(\S+):(\d+): error: .*\[([\w-]+)\]$", found.stdout, re.MULTILINE)
    expected = [("2", "attr-defined"), ("3", "arg-type"), ("4", "arg-type"), ("5", "assignment")]
    assert [(Path(path).name, *rest) for path, *rest in lines] == [("wrong.py", *one) for one in expected], (
        found.stdout + found.stderr
    )


# Bad input.


def test_a_refused_manifest_is_reported_with_file_line_cause_and_cure(tmp_path: Path) -> None:
    shutil.copytree("ecms/clean_table", tmp_path / "clean_table")
    manifest = tmp_path / "clean_table" / "ecm.yaml"
    text = manifest.read_text().replace("skills:", "skils:", 1)
    manifest.write_text(text)
    with pytest.raises(UserError) as refused:
        aeros.load_gate(tmp_path / "clean_table")
    message = str(refused.value)
    line = text.splitlines().index("skils:") + 1
    assert re.search(rf"ecm\.yaml:{line}:1", message)
    assert "unknown field" in message or "`skils`" in message
    assert "did you mean `skills`" in message
    assert {one.code for one in refused.value.diagnostics}


def test_files_that_are_not_there_are_named() -> None:
    with pytest.raises(UserError, match=r"there is no file or folder `nowhere`"):
        aeros.load_gate("nowhere")
    with pytest.raises(UserError, match=r"`no.yaml` cannot be read: no such file or directory"):
        aeros.load_gate("ecms", site="no.yaml")
    assert aeros.verify("ecms", site="no.yaml").conclusion.value == "rejected"


def test_a_session_needs_current_certificates(tmp_path: Path) -> None:
    shutil.copytree("ecms/clean_table", tmp_path / "clean_table")
    (tmp_path / "clean_table" / "ecm.lock").unlink()
    with (
        pytest.raises(UserError, match="has no certificate\nhelp: run `aeros verify"),
        aeros.open_session(tmp_path / "clean_table"),
    ):
        pass


def test_an_unknown_name_is_reported_with_the_known_names() -> None:
    gate = aeros.load_gate("ecms")
    action = aeros.act("wait", duration=0.5)
    with pytest.raises(MisuseError, match="no skill `wrapp`; did you mean `wrap`"):
        gate.decide(action, {}, skill="wrapp")
    with pytest.raises(MisuseError, match="several skills may ask: name one"):
        gate.decide(action, {})
    with pytest.raises(
        MisuseError, match=r"several modules have a skill `recover`: name one of clean_table\.rec"
    ):
        gate.decide(action, {}, skill="recover")
    with pytest.raises(MisuseError, match="no mode `fast`; there are compiled, z3, checked"):
        aeros.load_gate("ecms", mode="fast")  # type: ignore[arg-type]
    with pytest.raises(MisuseError, match="no plant `phisics`; did you mean `physics`"):
        aeros.open_session("ecms", plant="phisics").__enter__()
    with pytest.raises(MisuseError, match="no gate mode `fast`"):
        aeros.open_session("ecms", gate="fast").__enter__()  # type: ignore[arg-type]


# Deciding.


def test_every_malformed_request_is_denied() -> None:
    gate = aeros.load_gate("ecms/make_dumplings", skill="make_dumplings.wrap")
    look = aeros.act("look", camera="overhead")
    denials = [
        gate.decide(aeros.act("fly"), {}),
        gate.decide(look, {"estop_pressed": "no"}),
        gate.decide(look, {"estop_pressed": False}, ages={"estop_pressed": 60.0}),
        gate.decide(look, {"estop_pressed": False}, time=float("nan")),
        gate.decide(aeros.act("look", camera="attic"), {"estop_pressed": False}),
    ]
    assert [one.action for one in denials] == [None] * len(denials)
    assert all(one.reasons for one in denials)
    assert gate.decide(look, {"estop_pressed": False}, ages={"estop_pressed": 0.01}).action == look


def test_quotas_count_their_recorded_use() -> None:
    gate = aeros.load_gate("ecms/make_dumplings", skill="wrap")
    grip = aeros.act("grip", width=0.04, force=8.0)
    unused, used = gate.decide(grip, {}), gate.decide(grip, {}, usage={"grip-rate": 10_000})
    assert "grip-rate" not in {one.rule for one in unused.reasons}
    assert "grip-rate" in {one.rule for one in used.reasons}


@pytest.mark.parametrize("wrong", [None, "x", [1]])
def test_values_of_wrong_types_are_denied_and_raise_nothing(wrong: Any) -> None:
    gate, grip = (
        aeros.load_gate("ecms/make_dumplings", skill="wrap"),
        aeros.act("grip", width=0.04, force=8.0),
    )
    readings: dict[str, Any] = {"estop_pressed": False}
    other: Any = "x" if wrong is None else wrong
    for decision in (
        gate.decide(wrong, readings),
        gate.decide(grip, wrong),
        gate.decide(grip, readings, time=wrong),
        gate.decide(grip, readings, ages={"estop_pressed": wrong}),
        gate.decide(grip, readings, ages=other),
        gate.decide(grip, readings, usage=other),
    ):
        assert decision.kind.value == "DENY"


def test_a_closed_session_runs_nothing() -> None:
    with aeros.open_session("ecms/clean_table") as session:
        pass
    with pytest.raises(MisuseError, match="the session is closed"):
        session.run("clean the table")


# Conformance of plants.


def test_broken_promises_are_reported_together() -> None:
    symbolic = SUBJECTS["symbolic"]
    assert "stop_ends_everything" in aeros.check_conformance(symbolic)
    with pytest.raises(ConformanceError, match=r"^\d+ of \d+ promises are broken\n\w+: ") as broken:
        aeros.check_conformance(type(symbolic)(FakePlant, symbolic.motion_action, symbolic.parallel_action))
    assert str(broken.value).count("\n") > 1
    assert "raises KeyError: 'joint_position'" in str(broken.value)
