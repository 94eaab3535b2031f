"""`aeros verify --diff` and `--fix`, from the command line to the file."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from aeros.cli.author.proved_repairs import RepairedManifest
from aeros.cli.main import main
from aeros.exit_codes import Exit

CORPUS = Path(__file__).parents[3] / "corpus"
SITE = str(CORPUS / "site" / "table.yaml")


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    shutil.copytree(CORPUS / "rejected" / "safety" / "a_millimetre_per_second_too_fast", "quick")
    return Path("quick")


def run(*arguments: object) -> int:
    return main(["verify", *map(str, arguments), "--site", SITE])


def test_diff_prints_the_diff_alone_and_writes_nothing(
    module: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = (module / "ecm.yaml").read_bytes()
    assert run(module, "--diff") == Exit.REJECTED
    shown = capsys.readouterr()
    changed = [line for line in shown.out.splitlines() if line[:1] in "+-"]
    assert [line.split("speed")[-1] for line in changed[2:]] == [" <= 251 mm/s", " <= 250 mm/s"]
    assert changed[0] == "--- quick/ecm.yaml"
    first, second = shown.err.splitlines()
    assert first == "would repair 1 error in 1 file"
    assert second.lstrip().startswith("quick/ecm.yaml:19:66: AE501 ")
    assert (module / "ecm.yaml").read_bytes() == before
    assert not (module / "ecm.lock").exists()


def test_fix_writes_proves_again_and_makes_the_certificate(
    module: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(module, "--fix") == Exit.SUCCESS
    shown = capsys.readouterr().out
    assert "quick" not in shown.partition("repaired 1 error in 1 file\n")[0]
    assert "error[" not in shown
    assert (module / "ecm.lock").exists()
    assert run(module, "--fix") == Exit.SUCCESS
    assert "repaired 0 errors in 0 files" in capsys.readouterr().out
    assert run(module, "--diff") == Exit.SUCCESS
    assert capsys.readouterr().out == ""


def test_an_error_without_a_repair_is_listed_and_rejected(
    module: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    manifest = module / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace("risk: medium", "risk: high"))
    assert run(module, "--fix") == Exit.REJECTED
    shown = capsys.readouterr().out
    assert "250 mm/s" in manifest.read_text()
    assert "1 error without a proved repair:\n  quick/ecm.yaml:" in shown
    assert shown.rstrip().splitlines()[-1].lstrip().partition(": ")[2].startswith("AE406 ")
    assert not (module / "ecm.lock").exists()


def test_a_repair_of_the_site_is_shown_and_never_written(
    module: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    quota = "    - {id: longer, on: [wipe], at_most: 90, within: 90 s, rationale: wear}\n"
    first, before, after = Path(SITE).read_text().partition("  quotas:\n")
    site = Path("site.yaml")
    site.write_text(text := f"{first}{before}{quota}{after}")
    assert main(["verify", str(module), "--site", str(site), "--fix"]) == Exit.SUCCESS
    shown = capsys.readouterr().out
    assert site.read_text() == text
    assert "repaired 1 error in 1 file\n" in shown
    assert "1 warning of the site with a proved repair, for its operator (`--diff` shows it):\n" in shown
    assert main(["verify", str(module), "--site", str(site), "--diff"]) == Exit.REJECTED
    shown = capsys.readouterr().out
    assert [line for line in shown.splitlines() if line[:1] in "+-"][2:] == [f"-{quota.rstrip()}"]


def test_a_report_for_programs_stays_readable(module: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(module, "--fix", "--format", "json", "--no-lock") == Exit.SUCCESS
    shown = capsys.readouterr()
    assert json.loads(shown.out)["conclusion"] == "proved"
    assert shown.err.startswith("repaired 1 error in 1 file")


@pytest.mark.parametrize(
    "options",
    [["--fix", "--diff"], ["--fix", "--check"], ["--diff", "--format", "json"], ["--diff", "--output", "x"]],
    ids=" ".join,
)
def test_options_that_contradict_each_other_are_a_usage_error(
    module: Path, options: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    before = (module / "ecm.yaml").read_bytes()
    try:
        status: object = run(module, *options)
    except SystemExit as ended:
        status = ended.code
    assert status == Exit.USAGE
    assert "--" in capsys.readouterr().err
    assert (module / "ecm.yaml").read_bytes() == before


def test_a_file_that_cannot_be_written_is_named_and_rejected(
    module: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(_: RepairedManifest) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(RepairedManifest, "write", full)
    assert run(module, "--fix") == Exit.REJECTED
    shown = capsys.readouterr().out
    assert "cannot write `quick/ecm.yaml`: No space left on device" in shown
    assert "1 error without a proved repair:" in shown
