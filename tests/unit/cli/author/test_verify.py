from __future__ import annotations

import json
import shutil
import time
from pathlib import Path
from typing import Any

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.spec.diagnostics.codes import CODES
from aeros.spec.verification.certificate import LOCK

CORPUS = Path(__file__).parents[3] / "corpus"
SITE = str(CORPUS / "site" / "table.yaml")


@pytest.fixture
def module(tmp_path: Path) -> Path:
    return Path(shutil.copytree(CORPUS / "accepted" / "left_to_the_gate", tmp_path / "left_to_the_gate"))


def verify(*arguments: object) -> int:
    return main(["verify", *map(str, arguments), "--site", SITE])


def report_of(capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    report = json.loads(capsys.readouterr().out)
    assert isinstance(report, dict)
    return report


def test_exit_codes_are_as_documented() -> None:
    assert [code.value for code in Exit] == [0, 1, 2, 3, 4, 130, 141]
    assert Exit(3).name == "UNDECIDED"


def test_a_proved_module_gets_its_certificate(module: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert verify(module) == Exit.SUCCESS
    assert json.loads((module / LOCK).read_text())["module"] == "left_to_the_gate"
    assert "obligations, 2 runtime-checked\n" in capsys.readouterr().out


def test_a_rejected_module_gets_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    module = shutil.copytree(CORPUS / "rejected" / "safety" / "fast_near_a_person", tmp_path / "module")
    assert verify(module) == Exit.REJECTED
    assert not (module / LOCK).exists()


def test_the_certificate_of_a_module_that_is_now_rejected_is_stale(module: Path) -> None:
    verify(module)
    before = (module / LOCK).read_bytes()
    manifest = module / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace("    gated: [slow-near-person]\n", ""))
    assert verify(module) == Exit.REJECTED
    assert (module / LOCK).read_bytes() == before
    assert verify(module, "--check") == Exit.REJECTED


def test_no_lock_neither_writes_nor_requires_one(module: Path) -> None:
    assert verify(module, "--no-lock") == Exit.SUCCESS
    assert verify(module, "--no-lock", "--check") == Exit.SUCCESS
    assert not (module / LOCK).exists()


def test_check_writes_nothing_and_requires_a_current_one(
    module: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert verify(module, "--check") == Exit.REJECTED
    assert "error[AE901] certificate-missing: `left_to_the_gate`" in capsys.readouterr().out
    assert not (module / LOCK).exists()
    verify(module)
    assert verify(module, "--check") == Exit.SUCCESS
    (module / "skills.py").write_text((module / "skills.py").read_text() + "\n")
    capsys.readouterr()
    assert verify(module, "--check") == Exit.REJECTED
    assert "is stale: code differs" in capsys.readouterr().out


def test_an_unchanged_certificate_is_not_written_again(module: Path) -> None:
    verify(module)
    (module / LOCK).chmod(0o444)
    before = (module / LOCK).stat().st_mtime_ns
    assert verify(module) == Exit.SUCCESS
    assert (module / LOCK).stat().st_mtime_ns == before


def test_a_certificate_that_cannot_be_written_is_a_warning(
    module: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (module / LOCK).mkdir()  # stands in for a folder without permission to write, as root has every one
    assert verify(module) == Exit.SUCCESS
    shown = capsys.readouterr().out
    assert "warning[AE904] certificate-unwritable" in shown
    assert "use `--no-lock`" in shown


def test_a_spent_budget_is_undecided_and_never_a_pass(
    module: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert verify(module, "--rlimit", 1) == Exit.UNDECIDED
    shown = capsys.readouterr().out
    assert "error[AE509] undecided" in shown
    assert "raise `--rlimit`" in shown
    assert not (module / LOCK).exists()


def _ten_parameters(folder: Path) -> None:
    """Write a site and a module whose one question is on products of two times five numbers."""
    a, b = [f"a{n}" for n in range(5)], [f"b{n}" for n in range(5)]
    parameters = ", ".join(f"{name}: {{type: real, unit: m, range: [-2, 2]}}" for name in a + b)
    site = (CORPUS / "accepted/integer_with_one_value_left/site.yaml").read_text()
    site = site.replace("speed: {type: real, unit: m/s, range: [0, 5]}", "_").replace(
        "parameters:\n      _", f"parameters: {{{parameters}}}"
    )
    products = " + ".join("*".join(one) for one in (a, b))
    (folder / "site.yaml").write_text(site.replace("pieces < 1", f"{products} <= 0.05 m^5"))
    manifest = (CORPUS / "rejected/form/code_opens_a_connection/ecm.yaml").read_text()
    lengths = " and ".join(" + ".join(f"{x}*{x}" for x in one) + " <= 1 m*m" for one in (a, b))
    for old, new in (
        ("      wait: duration <= 10 s", f"      move: {lengths}"),
        ("    wait: true", "    move: true"),
        ("table_tidy: true", "person_near: false"),
        ("    resources: [arm]\n", ""),
        ("[camera]", "[scanner]"),
    ):
        manifest = manifest.replace(old, new)
    (folder / "m").mkdir()
    (folder / "m" / "ecm.yaml").write_text(manifest)
    (folder / "m" / "skills.py").write_text(
        "from aeros.skill import act\n\n\ndef tidy(observed, inputs):\n    yield act('move', "
        + ", ".join(f"{one}{n}=0.0" for one in "ab" for n in range(5))
        + ")\n"
    )


def test_a_question_that_takes_too_long_is_undecided_and_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _ten_parameters(tmp_path)
    arguments = [
        "--site",
        str(tmp_path / "site.yaml"),
        "--no-lock",
        "--no-cache",
        "--question-timeout",
        "0.5",
    ]
    started = time.monotonic()
    assert main(["verify", str(tmp_path / "m"), *arguments]) == Exit.UNDECIDED
    assert time.monotonic() - started < 30
    shown = capsys.readouterr().out
    assert "error[AE509] undecided: undecided, so refused: safety/tidy/move/few" in shown
    assert f"--> {tmp_path}/m/ecm.yaml:19:13" in shown
    assert "note: the solver said: no answer within 0.5 s (rlimit 1000000)" in shown
    assert "`--question-timeout`" in shown


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "3601", "soon"])
def test_a_time_limit_that_is_no_number_of_seconds_is_refused(module: Path, text: str) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["verify", str(module), f"--question-timeout={text}"])
    assert ended.value.code == Exit.USAGE


def test_rejected_outweighs_undecided(module: Path) -> None:
    assert verify(module, CORPUS / "rejected" / "form" / "timeout_in_metres", "--rlimit", 1) == Exit.REJECTED


@pytest.mark.parametrize(
    "arguments",
    [
        ["verify", "m", "--rlimit", "0"],
        ["verify", "m", "--rlimit", "-1"],
        ["verify", "m", "--rlimit", "many"],
        ["verify", "m", "--rlimit", "4294967296"],
        ["verify", "m", "--rlimit", "²"],
        ["verify", "m", "--format", "xml"],
        ["verify", "m", "--unknown"],
        ["verify", "m", "--site"],
        ["verified", "m"],
    ],
    ids=str,
)
def test_a_wrong_command_line_is_a_usage_error(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == Exit.USAGE
    assert "usage: aeros" in capsys.readouterr().err


def test_a_path_without_a_module_is_rejected(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert verify(tmp_path) == Exit.REJECTED
    (tmp_path / "skills.py").touch()
    assert verify(tmp_path / "skills.py") == Exit.REJECTED
    assert capsys.readouterr().out.count("error[AE130]") == 2


def test_a_path_that_is_not_there_is_a_usage_error(module: Path, capsys: pytest.CaptureFixture[str]) -> None:
    nowhere = str(module / "nowhere.yaml")
    for arguments in (["verify", nowhere], ["verify", str(module), "--site", nowhere]):
        with pytest.raises(SystemExit) as ended:
            main(arguments)
        assert ended.value.code == Exit.USAGE
        assert f"no file or folder `{nowhere}`" in capsys.readouterr().err
    assert not (module / LOCK).exists()


def test_a_site_that_cannot_be_read_is_rejected(module: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", str(module), "--site", str(module)]) == Exit.REJECTED
    assert "error[AE002]" in capsys.readouterr().out
    assert not (module / LOCK).exists()


def test_one_module_that_fails_does_not_keep_another_from_its_certificate(
    module: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert verify(module, CORPUS / "rejected" / "form" / "timeout_in_metres") == Exit.REJECTED
    assert (module / LOCK).exists()
    assert "left_to_the_gate" in capsys.readouterr().out


def test_a_folder_of_modules_is_searched_and_hidden_ones_are_not(
    module: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(module, module.parent / ".backup" / "module")
    shutil.copytree(CORPUS / "accepted" / "always_slow", module.parent / "deep" / "below")
    assert verify(module.parent, "--format", "json") == Exit.SUCCESS
    assert [one["name"] for one in report_of(capsys)["modules"]] == ["always_slow", "left_to_the_gate"]


def test_a_module_given_twice_is_verified_once(module: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert verify(module, module / "ecm.yaml", "--format", "json") == Exit.SUCCESS
    assert len(report_of(capsys)["modules"]) == 1


def test_json_of_a_proved_module(module: Path, capsys: pytest.CaptureFixture[str]) -> None:
    verify(module, "--format", "json")
    report = report_of(capsys)
    assert report.keys() == {"schema", "conclusion", "site", "modules", "certificates"}
    assert report["schema"] == "aeros/report/1"
    assert report["conclusion"] == "proved"
    assert report["certificates"] == []
    (found,) = report["modules"]
    assert found.keys() == {"name", "path", "conclusion", "obligations", "diagnostics"}
    assert found["diagnostics"] == []
    verdicts = {one["id"]: one for one in found["obligations"]}
    assert len(verdicts) == len(found["obligations"])
    rule = verdicts["safety/tidy/approach/slow-near-person"]
    assert rule["verdict"] == "REFUTED"
    assert rule["guarded"] is True
    assert verdicts["form/tidy/entry"] == {"id": "form/tidy/entry", "verdict": "PROVED", "guarded": False}


def test_json_of_a_rejected_module(capsys: pytest.CaptureFixture[str]) -> None:
    case = CORPUS / "rejected" / "safety" / "fast_near_a_person"
    assert verify(case, "--format", "json", "--no-lock") == Exit.REJECTED
    report = report_of(capsys)
    assert report["conclusion"] == "rejected"
    assert report["site"]["conclusion"] == "proved"
    (found,) = report["modules"][0]["diagnostics"]
    assert found["code"] == "AE501"
    assert found["slug"] == CODES["AE501"].slug
    assert found["severity"] == "error"
    source = (case / "ecm.yaml").read_text()
    place = found["primary"]
    assert source[place["start"] : place["end"]] == "pace <= 200 mm/s"
    assert place["path"] == str(case / "ecm.yaml")
    (refuted,) = [
        one for one in report["modules"][0]["obligations"] if one["id"].endswith("/slow-near-person")
    ]
    assert refuted["verdict"] == "REFUTED"
    assert refuted["guarded"] is False
    assert [line.partition(" ")[0] for line in refuted["witness"]] == ["person_near", "pace"]


def test_json_of_an_unreadable_module_and_of_a_missing_certificate(
    module: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    verify(module, CORPUS / "rejected" / "form" / "key_written_twice", "--check", "--format", "json")
    report = report_of(capsys)
    assert [one["code"] for one in report["certificates"]] == ["AE901"]
    unreadable = next(one for one in report["modules"] if one["conclusion"] == "rejected")
    assert unreadable["obligations"] == []
    assert [one["code"] for one in unreadable["diagnostics"]] == ["AE001"]


def test_json_is_ascii_for_all_contents_of_files(module: Path, capsys: pytest.CaptureFixture[str]) -> None:
    manifest = module / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace("version: 1.0.0", "version: größer"))
    verify(module, "--format", "json")
    shown = capsys.readouterr().out
    assert shown.isascii()
    assert "`größer`" in json.loads(shown)["modules"][0]["diagnostics"][0]["headline"]


def test_a_hostile_folder_name_does_not_reach_the_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "x\x1b]0;title\x07"
    shutil.copytree(CORPUS / "rejected" / "form" / "timeout_in_metres", folder)
    assert verify(folder) == Exit.REJECTED
    shown = capsys.readouterr().out
    assert "\x1b" not in shown
    assert "x\\x1b]0;title\\x07" in shown


def test_an_internal_fault_is_our_bug_and_shows_no_traceback(
    module: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise AssertionError("not in the scalar core")

    monkeypatch.setattr("aeros.cli.author.verify.verify", broken)
    monkeypatch.delenv("AEROS_DEBUG", raising=False)
    assert verify(module) == Exit.INTERNAL_ERROR
    shown = capsys.readouterr().err
    assert "a bug in aeros, not in your files: AssertionError: not in the scalar core" in shown
    assert "Traceback" not in shown


def test_a_site_is_proved_alone_if_it_is_given_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["verify", "--site", str(CORPUS / "site" / "table.yaml")]) == Exit.SUCCESS
    assert capsys.readouterr().out == "table  proved       78 obligations\n"
    assert main(["verify"]) == Exit.USAGE
    assert "`--site FILE` alone proves a site" in capsys.readouterr().err
    (tmp_path / "aeros.toml").write_text(f'site = "{CORPUS / "site" / "table.yaml"}"\n')
    assert main(["verify"]) == Exit.USAGE


def test_a_site_file_in_place_of_a_module_gets_a_cure(
    capsys: pytest.CaptureFixture[str],
) -> None:
    site = str(CORPUS / "site" / "table.yaml")
    assert main(["verify", site, "--site", site]) == Exit.REJECTED
    assert f"help: if it is a site file, give it by `--site {site}`" in capsys.readouterr().out
