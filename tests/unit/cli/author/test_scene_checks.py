"""`aeros verify` loads the scenes of the modules that it proves."""

from __future__ import annotations

from pathlib import Path
from shutil import copytree

import pytest

from aeros.cli.author.scene_checks import add_scene_warnings
from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.spec.diagnostics.codes import Diagnostic, Severity
from aeros.spec.diagnostics.source import Source, SourceSpan
from aeros.spec.model.summary import ComposedScenes
from aeros.spec.obligations.verdicts import Conclusion
from aeros.spec.verification.reports import Report, SubjectReport
from tests.shipped_scenes import ECMS

SITE = SubjectReport("cell", Path("site.yaml"), Conclusion.PROVED, (), variables={"holding": ()})
TASK = SourceSpan(Source("ecm.yaml", "plant:"), 0, 6)
WHOLE = """schema: aeros/scene/2
description: A bed.
module: garden
robot: {mount: bench}
view: {eye: [1 m, 0 m, 1 m], target: [0 m, 0 m, 0 m]}
"""


def warnings(
    folder: Path,
    files: dict[str, str],
    names: tuple[str, ...] = (),
    measured: tuple[str, ...] = (),
    cameras: tuple[str, ...] = (),
) -> tuple[Diagnostic, ...]:
    """Warnings about a module `garden` with these scene files, whose tasks name scenes."""
    scenes = folder / "garden" / "scenes"
    scenes.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (scenes / f"{name}.yaml").write_text(text)
    module = SubjectReport(
        "garden",
        folder / "garden",
        Conclusion.PROVED,
        (),
        variables={"bed_planted": ()},
        scenes=dict.fromkeys(names, TASK),
        measured_by_site=measured,
        cameras={"garden": {"above": "tree"}},
        needed_cameras=cameras,
    )
    report = add_scene_warnings(Report(SITE, (module,), None))
    assert report.conclusion is Conclusion.PROVED
    found = report.modules[0].diagnostics
    assert all(one.severity is Severity.WARNING for one in found)
    return found


def test_a_module_with_whole_scenes_has_no_warning(tmp_path: Path) -> None:
    bed = WHOLE + "truth: {bed_planted: true, holding: true}\n"
    assert warnings(tmp_path, {"bed": bed}, ("bed",)) == ()
    assert warnings(tmp_path / "other", {}) == ()


def test_a_variable_that_nothing_in_a_tasks_scene_measures_is_a_warning(tmp_path: Path) -> None:
    measured = ("garden.tap_position", "garden.gate_position")
    bed = WHOLE + "places: {gate_position: {at: [0 m, 0 m, 0 m]}}\n"
    assert warnings(tmp_path, {"bed": bed}, (), measured) == ()
    (found,) = warnings(tmp_path, {"bed": bed}, ("bed",), measured)
    assert found.headline == (
        "`tap_position` stays unknown in the scene `bed`, which has no place or instrument for it"
    )
    assert found.help == ("add `tap_position` under `places` or `instruments` of the scene",)
    assert found.primary is not None
    assert found.primary.span == TASK


def test_a_camera_that_a_tasks_scene_lacks_is_a_warning(tmp_path: Path) -> None:
    camera = "{eye: [1 m, 0 m, 1 m], target: [0 m, 0 m, 0 m]}"
    bed = WHOLE + f"cameras: {{gate: {camera}}}\n"
    assert warnings(tmp_path, {"bed": bed}, ("bed",), (), ("gate",)) == ()
    found = warnings(tmp_path, {"bed": bed}, ("bed",), (), ("tree", "gate", "roof"))
    assert [one.headline for one in found] == [
        "the scene `bed` has no camera `above`, which the module takes pictures with",
        "the scene `bed` has no camera `roof`, which the module takes pictures with",
    ]


def test_a_scene_of_a_module_that_is_not_here_is_a_warning(tmp_path: Path) -> None:
    (found,) = warnings(tmp_path, {"bed": WHOLE.replace("garden", "gardn")})
    assert found.headline == "the scene `bed` is of the module `gardn`, which is not verified with it"
    assert found.help[0] == "did you mean `garden`?"
    assert warnings(tmp_path / "other", {"bed": WHOLE.replace("garden", "kitchen")}) == ()


def test_a_module_in_the_present_folder_is_no_exception(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (found,) = warnings(Path(), {"bed": WHOLE + "truth: {bed_plantd: true}\n"})
    assert found.code == "AE122"


def test_a_scene_that_no_task_names_is_loaded_too(tmp_path: Path) -> None:
    (found,) = warnings(tmp_path, {"bed": WHOLE + "truth: {bed_plantd: true}\n"})
    assert (found.code, found.help) == ("AE122", ("did you mean `bed_planted`?",))


def test_a_fault_of_a_file_that_two_scenes_include_is_shown_once(tmp_path: Path) -> None:
    part = "schema: aeros/scene/2\ndescription: Part.\nbodies: {box: {at: [0 m, 0 m, 0 m]}}\n"
    including = WHOLE + "include: [{scene: part}]\n"
    (found,) = warnings(tmp_path, {"part": part, "one": including, "two": including})
    assert "needs exactly one of" in found.headline


@pytest.mark.parametrize(
    ("files", "help_"), [({"bed": WHOLE}, "did you mean `bed`?"), ({}, "add `scenes/bet.yaml`")]
)
def test_a_task_that_names_no_scene_is_shown(files: dict[str, str], help_: str, tmp_path: Path) -> None:
    (found,) = warnings(tmp_path, files, ("bet",))
    assert (found.code, found.headline) == ("AE002", "there is no scene `bet`")
    assert found.help[0].startswith(help_)
    assert found.primary is not None
    assert found.primary.span is TASK


def test_a_tasks_scene_needs_a_robot_and_another_one_does_not(tmp_path: Path) -> None:
    part = {"part": "schema: aeros/scene/2\ndescription: Part.\n"}
    assert warnings(tmp_path, part) == ()
    (found,) = warnings(tmp_path, part, ("part",))
    assert found.primary is not None
    assert (found.code, found.primary.span) == ("AE208", TASK)


CAMERA = "cameras: {{top: {{eye: [0 m, 0 m, {height} m], target: [0 m, 0 m, 0 m], up: [1, 0, 0]}}}}\n"


@pytest.mark.parametrize(
    ("bound", "present", "codes"),
    [
        ({"garden": {"top": "mast"}}, True, []),
        ({}, True, ["AE121"]),
        ({}, False, []),
    ],
)
def test_the_scenes_of_a_task_that_composes_others_are_combined_as_for_a_run(
    bound: dict[str, dict[str, str]], present: bool, codes: list[str], tmp_path: Path
) -> None:
    for module, height in (("garden", 1), ("yard", 2)):
        (scenes := tmp_path / module / "scenes").mkdir(parents=True)
        whole = WHOLE.replace("garden", module) + CAMERA.format(height=height)
        (scenes / f"{module}.yaml").write_text(whole + "bodies: {bed: {sphere: 2 cm, at: [0 m, 1 m, 1 m]}}\n")
    both = ComposedScenes("both", (("garden", "garden"), ("yard" if present else "barn", "yard")), TASK)
    yard = SubjectReport("yard", tmp_path / "yard", Conclusion.PROVED, ())
    garden = SubjectReport(
        "garden", tmp_path / "garden", Conclusion.PROVED, (), composed_scenes=(both,), cameras=bound
    )
    found = add_scene_warnings(Report(SITE, (garden, yard), None)).modules[0].diagnostics
    assert [one.code for one in found] == codes
    assert all(one.primary is not None and one.primary.span is TASK for one in found)


def test_a_module_that_cannot_be_read_is_left_out(tmp_path: Path) -> None:
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes" / "bed.yaml").write_text("no scene")
    unread = SubjectReport(str(tmp_path), tmp_path, Conclusion.REJECTED, (), is_readable=False)
    assert add_scene_warnings(Report(SITE, (unread,), None)).modules == (unread,)


def test_the_command_shows_the_place_and_proves_the_module(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = copytree(ECMS / "clean_table", tmp_path / "clean_table") / "scenes" / "table.yaml"
    table.write_text(table.read_text().replace("  table_wiped: dirt", "  table_wipd: dirt"))
    assert main(["verify", str(tmp_path / "clean_table"), "--no-lock"]) == Exit.SUCCESS
    shown = capsys.readouterr().out
    assert "warning[AE122] unknown-reference: `table_wipd` is not a state variable" in shown
    assert f"{table}:" in shown
    assert "did you mean `table_wiped`?" in shown
