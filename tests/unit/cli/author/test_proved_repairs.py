"""Proved repairs: comments stay, what does not prove is not kept, and neighbours are found."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest

from aeros.cli.author.proved_repairs import errors_without_repair, find_proved_repairs
from aeros.spec.obligations.verdicts import Conclusion
from aeros.spec.verification.reports import Report
from aeros.spec.verification.verify import Detail, verify

CORPUS = Path(__file__).parents[3] / "corpus"
SITE = CORPUS / "site" / "table.yaml"
TOO_FAST = CORPUS / "rejected" / "safety" / "a_millimetre_per_second_too_fast"
ENVELOPE = "move: target in tabletop and target not in camera_mast and speed <= 251 mm/s"


def judge(folders: Sequence[Path]) -> Report:
    return verify(folders, SITE, detail=Detail.BRIEF)


@pytest.fixture
def module(tmp_path: Path) -> Path:
    return shutil.copytree(TOO_FAST, tmp_path / "modules" / "quick")


def rewrite(module: Path, old: str, new: str) -> str:
    manifest = module / "ecm.yaml"
    text = manifest.read_text(encoding="utf-8")
    assert text.count(old) == 1
    manifest.write_text(text.replace(old, new), encoding="utf-8")
    return manifest.read_text(encoding="utf-8")


def test_comments_and_formatting_stay(module: Path) -> None:
    places, speed = "target in tabletop and target not in camera_mast", "and  speed <= 251 mm/s"
    before = rewrite(module, ENVELOPE, f"move: >-  # of the move\n        {places}\n        {speed}")
    (repaired,) = find_proved_repairs(judge([module]), judge)
    assert repaired.after == before.replace("<= 251", "<= 250")
    assert [one.code for one in repaired.repaired] == ["AE501"]
    assert (module / "ecm.yaml").read_text(encoding="utf-8") == before


def test_a_written_repair_is_proved_and_keeps_mode_and_link(module: Path, tmp_path: Path) -> None:
    (module / "ecm.yaml").chmod(0o640)
    elsewhere = (module / "ecm.yaml").rename(tmp_path / "manifest.yaml")
    (module / "ecm.yaml").symlink_to(elsewhere)
    (repaired,) = find_proved_repairs(judge([module]), judge)
    repaired.write()
    assert (module / "ecm.yaml").is_symlink()
    assert elsewhere.stat().st_mode & 0o777 == 0o640
    assert judge([module]).conclusion is Conclusion.PROVED
    assert find_proved_repairs(judge([module]), judge) == ()


def test_a_diff_applies_with_patch(module: Path) -> None:
    (repaired,) = find_proved_repairs(judge([module]), judge)
    manifest = module / "ecm.yaml"
    patched = subprocess.run(
        ["git", "apply", "-p0", "--unsafe-paths", "--directory=/", "-"],
        input=repaired.unified_diff(),
        cwd=module,
        text=True,
        capture_output=True,
        check=False,
    )
    assert patched.returncode == 0, patched.stderr
    assert manifest.read_text(encoding="utf-8") == repaired.after


def test_a_file_without_a_last_line_break_keeps_that(module: Path) -> None:
    manifest = module / "ecm.yaml"
    manifest.write_text(manifest.read_text(encoding="utf-8").rstrip("\n"), encoding="utf-8")
    (repaired,) = find_proved_repairs(judge([module]), judge)
    assert not repaired.after.endswith("\n")
    assert repaired.unified_diff().splitlines()[0] == f"--- {manifest}"


def test_line_breaks_of_windows_stay(module: Path) -> None:
    manifest = module / "ecm.yaml"
    manifest.write_bytes(manifest.read_bytes().replace(b"\n", b"\r\n"))
    (repaired,) = find_proved_repairs(judge([module]), judge)
    repaired.write()
    assert manifest.read_bytes().count(b"\r\n") == manifest.read_bytes().count(b"\n")
    assert judge([module]).conclusion is Conclusion.PROVED


def test_a_repair_that_is_not_proved_as_a_whole_is_not_kept(module: Path) -> None:
    def always_as_before(folders: Sequence[Path]) -> Report:
        for folder in folders:
            manifest = folder / "ecm.yaml"
            manifest.write_text(manifest.read_text(encoding="utf-8").replace("250", "251"), encoding="utf-8")
        return judge(folders)

    report = judge([module])
    assert find_proved_repairs(report, always_as_before) == ()
    assert [one.code for one in errors_without_repair(report, ())] == ["AE501"]


def test_no_repair_is_kept_that_makes_another_module_worse(module: Path, tmp_path: Path) -> None:
    accepted = CORPUS / "accepted" / "left_to_the_gate"
    other = shutil.copytree(accepted, tmp_path / "modules" / accepted.name)
    report = judge([module, other])

    def with_a_loss_of_the_other(folders: Sequence[Path]) -> Report:
        shutil.copytree(folders[1], folders[1].parent / "copy")
        folders[1].unlink()
        (folders[1].parent / "copy").rename(folders[1])
        rewrite(folders[1], "    gated: [slow-near-person]\n", "")
        return judge(folders)

    assert len(find_proved_repairs(report, judge)) == 1
    assert find_proved_repairs(report, with_a_loss_of_the_other) == ()


def test_an_error_without_a_repair_keeps_no_other_repair_back(module: Path) -> None:
    rewrite(module, "    risk: medium", "    risk: high")
    report = judge([module])
    (repaired,) = find_proved_repairs(report, judge)
    assert "250 mm/s" in repaired.after
    assert [one.code for one in errors_without_repair(report, [repaired])] == ["AE406"]


def test_a_module_finds_its_neighbours_while_its_repair_is_proved(tmp_path: Path) -> None:
    folder = tmp_path / "modules"
    shutil.copytree(CORPUS / "accepted" / "steps_of_a_required_module", folder)
    before = rewrite(folder / "asker", "{wait: duration <= 10 s}", "{wait: duration <= 40 s}")
    (repaired,) = find_proved_repairs(judge([folder / "asker"]), judge)
    assert repaired.after == before.replace("<= 40 s", "<= 30 s")


def test_a_file_that_changed_meanwhile_is_left_alone(module: Path) -> None:
    (repaired,) = find_proved_repairs(judge([module]), judge)
    after = rewrite(module, "<= 251", "<= 240")
    with pytest.raises(OSError, match="was changed while"):
        repaired.write()
    assert (module / "ecm.yaml").read_text(encoding="utf-8") == after
