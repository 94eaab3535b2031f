from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.spec.text.discovery import reference_site_path

REPOSITORY = Path(__file__).parents[5]
OTHER_SITE = REPOSITORY / "tests" / "corpus" / "site" / "table.yaml"
FILES = [
    "test_tidy.py",
    "tidy",
    "tidy/ecm.yaml",
    "tidy/perceivers.py",
    "tidy/scenes",
    "tidy/scenes/table.yaml",
    "tidy/skills.py",
]


def _new(folder: Path, *arguments: str, name: str = "tidy") -> int:
    return main(["new", "ecm", name, "--parent", str(folder), *arguments])


def _usage(folder: Path, *arguments: str, name: str = "tidy") -> int:
    with pytest.raises(SystemExit) as left:
        _new(folder, *arguments, name=name)
    assert isinstance(left.value.code, int)
    return left.value.code


def _below(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def _run(folder: Path, words: str, *arguments: str) -> int:
    return main(
        ["run", words, "--ecms", str(folder / "tidy"), "--state", str(folder / "state"),
         "--out", str(folder / "out"), *arguments]
    )  # fmt: skip


def test_a_new_module_is_proved_and_runs_at_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert _new(tmp_path) == Exit.SUCCESS
    assert _below(tmp_path) == FILES
    assert main(["verify", str(tmp_path / "tidy")]) == Exit.SUCCESS
    shown = capsys.readouterr().out
    assert "warning" not in shown
    assert _run(tmp_path, "tidy", "--plant", "symbolic") == Exit.SUCCESS
    shown = capsys.readouterr().out
    assert "measured   holding = true (symbolic plant)" in shown
    assert "0 denied" in shown


@pytest.mark.physics
def test_a_new_module_runs_in_physics_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _new(tmp_path)
    main(["verify", str(tmp_path / "tidy")])
    assert _run(tmp_path, "tidy", "--no-film") == Exit.SUCCESS
    assert "measured   holding = true (physics plant)" in capsys.readouterr().out


def test_the_commands_it_names_next_are_those_that_work(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "my modules"
    folder.mkdir()
    assert _new(folder, "--instruction", "Pick it-up") == Exit.SUCCESS
    message = capsys.readouterr().out.splitlines()
    commands = [line.strip() for line in message[message.index("next:") + 1 :]]
    assert len(commands) == 2
    monkeypatch.setenv("PATH", str(Path(sys.executable).parent), prepend=os.pathsep)
    for command in commands:
        ran = subprocess.run(["/bin/sh", "-c", command], cwd=tmp_path, capture_output=True, text=True)
        assert ran.returncode == 0, ran.stdout + ran.stderr


def test_the_tests_it_makes_pass_and_fail_when_the_module_is_no_longer_proved(tmp_path: Path) -> None:
    _new(tmp_path)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_tidy.py"]
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert "2 passed" in ran.stdout
    manifest = tmp_path / "tidy" / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace("speed <= 200 mm/s", "speed <= 201 mm/s"))
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert "1 failed, 1 passed" in ran.stdout


def test_the_result_is_well_formatted_python(tmp_path: Path) -> None:
    _new(tmp_path)
    tools = Path(sys.executable).parent
    for command in (["check", "--select", "B,E,F,I,N,UP"], ["format", "--check"]):
        arguments = [str(tools / "ruff"), *command, "--line-length", "110", "."]
        ran = subprocess.run(arguments, cwd=tmp_path, capture_output=True, text=True)
        assert ran.returncode == 0, ran.stdout + ran.stderr


@pytest.mark.parametrize("name", ["yes", "json", "x_1"])
def test_any_name_of_the_right_form_will_do(name: str, tmp_path: Path) -> None:
    assert _new(tmp_path, name=name) == Exit.SUCCESS
    assert main(["verify", str(tmp_path / name)]) == Exit.SUCCESS


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("Pick-Up", "a lower-case letter, then letters, digits and `_`, as in `move_tool`, or `pick_up`"),
        ("1st", "or `st`"),
        ("../out", "or `out`"),
        ("a/b", "or `a_b`"),
        ("", "`` is not a name"),
        ("é", "`é` is not a name"),
        ("a\n", "`a\\n` is not a name"),
        ("$name", "or `name`"),
        ("aeros", "`aeros` is reserved; choose another name"),
        ("null", "`null` is reserved; choose another name"),
        ("true", "`true` is reserved; choose another name"),
        ("and", "`and` is reserved; choose another name"),
        ("a" * 61, "a name has at most 60 characters"),
    ],
)
def test_a_bad_name_is_refused_with_a_better_one(
    name: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _usage(tmp_path, name=name) == Exit.USAGE
    assert message in capsys.readouterr().err
    assert _below(tmp_path) == []


@pytest.mark.parametrize(
    "words", ["", " ", "a  b", "a]", 'a"', "a: b", "#a", "-a", "1.", "a\n", "_", "x" * 61]
)
def test_words_that_could_not_ask_for_a_task_are_refused(
    words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _usage(tmp_path, f"--instruction={words}") == Exit.USAGE
    assert 'as in "pick up"' in capsys.readouterr().err
    assert _below(tmp_path) == []


@pytest.mark.parametrize("words", ["null", "12", "Räum auf"])
def test_words_that_yaml_might_misread_still_ask_for_the_task(words: str, tmp_path: Path) -> None:
    assert _new(tmp_path, f"--instruction={words}") == Exit.SUCCESS
    assert main(["verify", str(tmp_path / "tidy")]) == Exit.SUCCESS
    assert _run(tmp_path, f"please {words} now", "--plant", "symbolic") == Exit.SUCCESS


def test_a_name_that_the_policy_grants_something_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _new(tmp_path, name="fetch_object") == Exit.REJECTED
    assert "the policy of `panda_cell` already speaks of a module `fetch_object`" in capsys.readouterr().err
    assert _below(tmp_path) == []


@pytest.mark.parametrize("taken", ["tidy", "test_tidy.py"])
@pytest.mark.parametrize("kind", ["file", "folder", "dangling link"])
def test_existing_files_stay(
    taken: str, kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / taken
    match kind:
        case "file":
            path.write_text("mine")
        case "folder":
            path.mkdir()
        case _:
            path.symlink_to("nowhere")
    assert _new(tmp_path) == Exit.REJECTED
    message = capsys.readouterr().err
    assert f"`{path}` exists already; choose another name, or another folder with --parent" in message
    assert _below(tmp_path) == [taken]


def test_a_place_that_is_not_there_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert _usage(tmp_path / "nowhere") == Exit.USAGE
    assert "no file or folder" in capsys.readouterr().err


def test_a_file_is_no_place_for_a_module(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("")
    assert _usage(tmp_path / "file") == Exit.USAGE
    assert "is a file; give a folder" in capsys.readouterr().err


def test_a_place_that_cannot_be_written_to_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert _new(Path("/proc")) == Exit.REJECTED
    message = capsys.readouterr().err
    assert "cannot write to `/proc`" in message
    assert "choose another with --parent" in message


def test_for_a_site_of_ones_own_its_tests_verify_under_that_site(tmp_path: Path) -> None:
    site = tmp_path / "sites" / "cell.yaml"
    site.parent.mkdir()
    site.write_text(reference_site_path().read_text().replace("id: panda_cell", "id: my_cell"))
    folder = tmp_path / "ecms"
    folder.mkdir()
    assert _new(folder, "--site", str(site)) == Exit.SUCCESS
    made = (folder / "test_tidy.py").read_text()
    assert (
        'main(["verify", str(HERE / "tidy"), "--no-lock", "--site", str(HERE / "../sites/cell.yaml")])'
        in made
    )


def test_needs_that_a_site_leaves_open_are_listed_with_the_way_to_bind_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _new(tmp_path, "--site", str(OTHER_SITE)) == Exit.SUCCESS
    message = capsys.readouterr().out
    assert "`tidy` needs `grip`, an action kind with `width`, `force`, and this site has none" in message
    assert (
        "`tidy` needs `cell_survey`, a sensor that offers `fixture_places`, and this site has none" in message
    )
    assert "as in `modules: {tidy: {bind: {NEED: THING}}}`" in message
    assert _below(tmp_path) == FILES


def test_a_module_for_a_site_with_other_names_is_proved_once_it_is_bound(tmp_path: Path) -> None:
    text = reference_site_path().read_text()
    for name in ("workspace", "own_base", "base_position", "overhead"):
        text = re.sub(rf"\b{name}\b", f"other{name}", text)
    site = tmp_path / "cell.yaml"
    site.write_text(text)
    arguments = ["verify", str(tmp_path / "tidy"), "--no-lock", "--site", str(site)]
    assert _new(tmp_path, "--site", str(site)) == Exit.SUCCESS
    assert main([*arguments, "--bind=tidy.overhead=otheroverhead"]) == Exit.SUCCESS


def test_a_broken_site_is_refused_for_what_is_wrong_with_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    site = tmp_path / "cell.yaml"
    shutil.copy(reference_site_path(), site)
    site.write_text(site.read_text().replace("require: not estop_pressed", "require: not estop_presed"))
    assert _new(tmp_path, "--site", str(site)) == Exit.REJECTED
    assert "AE202" in capsys.readouterr().err
    assert _below(tmp_path) == ["cell.yaml"]


def test_help_has_examples_and_exit_codes(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        main(["new", "--help"])
    assert left.value.code == 0
    message = capsys.readouterr().out
    assert "aeros new ecm tidy --site cell.yaml" in message
    assert "exit codes:" in message
