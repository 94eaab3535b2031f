"""`aeros fmt` writes what has another layout, and leaves what it cannot read as it is."""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path

import pytest

from aeros.cli.author import fmt
from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.migrations import formats

_BEFORE = "schema: aeros/site/1\na:   {b: é,c: d} # why\n"
_AFTER = "schema: aeros/site/1\na: {b: é, c: d} # why\n"
_BROKEN = "schema: aeros/site/1\na: [\n"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder in which commands are started."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def _write(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(text.encode())
    return path


def test_files_of_a_folder_are_written_and_named(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    changed = _write(here / "cells/a.yaml", _BEFORE)
    unchanged = _write(here / "cells/b.yml", _AFTER)
    time = unchanged.stat().st_mtime_ns
    assert main(["fmt", "cells"]) == Exit.SUCCESS
    assert changed.read_text(encoding="utf-8") == _AFTER
    assert unchanged.stat().st_mtime_ns == time
    assert capsys.readouterr().out == (
        "formatted cells/a.yaml\n1 file formatted, 1 unchanged\n"
        "Certificates hold the digests of manifest and site: run `aeros verify` again.\n"
    )
    assert main(["fmt", "cells", "-q"]) == Exit.SUCCESS
    assert capsys.readouterr().out == ""


def test_other_files_links_hidden_folders_and_registries_are_skipped(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _write(here / "cells/a.yaml", _AFTER)
    skipped = [
        _write(here / name, text)
        for name, text in (
            ("cells/workflow.yaml", "on:   !tag push\n"),
            ("cells/picture.yaml", "\udcff".encode("utf-8", "surrogateescape").decode("latin-1")),
            ("cells/a.txt", _BEFORE),
            ("cells/.hidden/a.yaml", _BEFORE),
            ("cells/robot/modules/a.yaml", _BEFORE),
            ("elsewhere/a.yaml", _BEFORE),
        )
    ]
    (here / "cells/robot" / formats.REGISTRY.files[0]).touch()
    (here / "cells/link").symlink_to(here / "elsewhere")
    (here / "cells/link.yaml").symlink_to(here / "elsewhere/a.yaml")
    before = [path.read_bytes() for path in skipped]
    assert main(["fmt", "cells"]) == Exit.SUCCESS
    assert [path.read_bytes() for path in skipped] == before
    assert capsys.readouterr().out == "0 files formatted, 1 unchanged\n"


@pytest.mark.parametrize("option", ["--check", "--diff"])
def test_nothing_is_written_in_a_check(here: Path, option: str, capsys: pytest.CaptureFixture[str]) -> None:
    path = _write(here / "a.yaml", _BEFORE)
    assert main(["fmt", "a.yaml", option]) == Exit.REJECTED
    assert path.read_text(encoding="utf-8") == _BEFORE
    shown = capsys.readouterr().out
    assert ("would format a.yaml" in shown) is (option == "--check")
    path.write_bytes(_AFTER.encode())
    assert main(["fmt", "a.yaml", option]) == Exit.SUCCESS


def test_a_diff_can_be_applied(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = _write(here / "a.yaml", _BEFORE)
    assert main(["fmt", "a.yaml", "--diff"]) == Exit.REJECTED
    subprocess.run(["git", "apply", "-p0"], input=capsys.readouterr().out, text=True, check=True, cwd=here)
    assert path.read_text(encoding="utf-8") == _AFTER


def test_a_broken_file_has_its_diagnostic_and_the_others_are_formatted(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = _write(here / "cells/a.yaml", _BROKEN)
    hidden = _write(here / "cells/b.yaml", "schema: aeros/site/1\na: b\u200b\n")
    other = _write(here / "cells/c.yaml", _BEFORE)
    assert main(["fmt", "cells"]) == Exit.REJECTED
    assert broken.read_text() == _BROKEN
    assert hidden.read_text(encoding="utf-8").endswith("\u200b\n")
    assert other.read_text(encoding="utf-8") == _AFTER
    shown = capsys.readouterr().err
    assert "error[AE007]" in shown
    assert "cells/a.yaml:3:1" in shown
    assert "error[AE005]" in shown


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("a: b\n", "it is of no YAML format that AEROS knows"),
        ("schema: aeros/report/1\na:   b\n", "it is of no YAML format that AEROS knows"),
        ("schema: aeros/site/1\n? a # b\n: c\n", "a.yaml:2:3: left as it is: a comment is beside a key"),
    ],
)
def test_a_named_file_without_a_layout_is_refused(
    here: Path, text: str, reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = _write(here / "a.yaml", text)
    assert main(["fmt", "a.yaml"]) == Exit.REJECTED
    assert reason in capsys.readouterr().err
    assert path.read_text() == text


def test_a_copy_of_a_registry_is_refused(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = _write(here / "modules/it/ecm.yaml", _BEFORE.replace("site/1", "ecm/2"))
    (here / formats.REGISTRY.files[0]).touch()
    assert main(["fmt", str(path)]) == Exit.REJECTED
    assert "the registry keeps it under its digest" in capsys.readouterr().err


def test_a_folder_without_files_of_aeros_is_no_success(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _write(here / "empty/a.yaml", "a: b\n")
    _write(here / "a.yaml", _AFTER)
    assert main(["fmt", "a.yaml", "empty"]) == Exit.REJECTED
    assert "no YAML file of AEROS in or below `empty`" in capsys.readouterr().err


def test_a_file_that_cannot_be_written_is_named(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    _write(here / "a.yaml", _BEFORE)

    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(fmt, "replace_text", fail)
    assert main(["fmt", "a.yaml"]) == Exit.REJECTED
    assert capsys.readouterr().err == "aeros: a.yaml: left as it is: No space left on device\n"


def test_a_wrong_layout_is_a_bug_of_aeros(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = _write(here / "a.yaml", _BEFORE)

    def fail(_: object) -> str:
        raise InternalError("the layout of `a.yaml` would change what it says")

    monkeypatch.setattr(fmt, "format_yaml", fail)
    assert main(["fmt", "a.yaml"]) == Exit.INTERNAL_ERROR
    assert "a bug in aeros" in capsys.readouterr().err
    assert path.read_text(encoding="utf-8") == _BEFORE


@pytest.mark.parametrize("paths", [["nowhere"], ["-", "a.yaml"], []])
def test_wrong_paths_are_usage_errors(here: Path, paths: list[str]) -> None:
    _write(here / "a.yaml", _BEFORE)
    try:
        code = main(["fmt", *paths])
    except SystemExit as left:
        code = int(left.code or 0)
    assert code == Exit.USAGE


@pytest.mark.parametrize(
    ("text", "options", "code", "shown"),
    [
        (_BEFORE, [], Exit.SUCCESS, _AFTER),
        (_BEFORE.replace("\n", "\r\n"), [], Exit.SUCCESS, _AFTER),
        (_BROKEN, [], Exit.REJECTED, ""),
        ("a:   b\n", [], Exit.REJECTED, ""),
        (_BEFORE, ["--check"], Exit.REJECTED, "would format -\n"),
        (_AFTER, ["--check"], Exit.SUCCESS, ""),
    ],
)
def test_standard_input_is_formatted_to_standard_output(
    text: str,
    options: list[str],
    code: Exit,
    shown: str,
    monkeypatch: pytest.MonkeyPatch,
    capsysbinary: pytest.CaptureFixture[bytes],
) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
    assert main(["fmt", "-", *options]) == code
    assert capsysbinary.readouterr().out == shown.encode()


def test_templates_have_the_layout(here: Path) -> None:
    assert main(["new", "site", "cell"]) == Exit.SUCCESS
    assert main(["new", "ecm", "tidy"]) == Exit.SUCCESS
    assert main(["fmt", "cell.yaml", "tidy", "--check"]) == Exit.SUCCESS
