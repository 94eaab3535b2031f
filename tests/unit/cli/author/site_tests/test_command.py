"""`aeros test`, from the file to exit code and report; the example is of a module in `ecms`."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from tests.repo.tree import ROOT
from tests.unit.cli.author.site_tests.rewriting import CORPUS, TABLE, rewrite


def test_the_example_of_the_reference_site_passes(capsys: pytest.CaptureFixture[str]) -> None:
    example = ROOT / "docs" / "examples" / "panda_cell_tests.yaml"
    assert main(["test", str(example)]) == Exit.SUCCESS
    shown = capsys.readouterr().out
    assert (
        f"$ aeros test docs/examples/panda_cell_tests.yaml\n{shown}"
        in (ROOT / "docs/site-tests.md").read_text()
    )


def test_every_form_of_test_passes(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["test", str(TABLE), "--verbose"]) == Exit.SUCCESS
    shown = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in shown] == ["pass"] * 7 + ["7"]
    line = next(i for i, one in enumerate(TABLE.read_text().splitlines(), 1) if "fast_and_alone" in one)
    assert shown[0].split()[1:] == [f"{TABLE}:{line}", "fast_and_alone"]


def test_tests_are_chosen_by_name(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["test", str(TABLE), "--only", "module_*"]) == Exit.SUCCESS
    assert capsys.readouterr().out == "2 passed, 0 failed\n"
    assert main(["test", str(TABLE), "--only", "nothing_like_it"]) == Exit.USAGE
    assert "no test has a name like `nothing_like_it`" in capsys.readouterr().err


def test_another_site_can_be_tried(changed: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    site = tmp_path / "cell.yaml"
    site.write_text(
        (CORPUS / "site" / "table.yaml").read_text().replace("pace <= slow", "pace <= 2 * slow", 1)
    )
    assert main(["test", str(changed), "--site", str(site), "--only", "fast_near_a_person"]) == Exit.REJECTED
    assert "expected ATTENUATE by slow-near-person, decided ALLOW" in capsys.readouterr().out


def test_a_module_that_is_not_proved_runs_no_test(changed: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rewrite(
        changed,
        f"modules: [{CORPUS}/accepted/left_to_the_gate]",
        f"modules: [{CORPUS}/rejected/safety/fast_near_a_person]",
    )
    assert main(["test", str(changed)]) == Exit.REJECTED
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "error[AE501]" in shown.err


def test_a_folder_is_no_file_of_tests(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["test", str(tmp_path)]) == Exit.USAGE
    assert f"`{tmp_path}` is a folder: name a YAML file of expected decisions" in capsys.readouterr().err
