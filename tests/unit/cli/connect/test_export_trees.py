"""`aeros export bt` as people run it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit

CORPUS = Path(__file__).parents[3] / "corpus"
SITE = ("--site", str(CORPUS / "site" / "table.yaml"))


def test_a_composition_is_exported_and_imported_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    module, file = str(CORPUS / "accepted" / "alternatives_and_tries"), tmp_path / "tree.xml"
    assert main(["export", "bt", module, *SITE, "--output", str(file)]) == Exit.SUCCESS
    assert main(["export", "bt", module, *SITE]) == Exit.SUCCESS
    assert capsys.readouterr().out == file.read_text()
    assert main(["import", "bt", str(file)]) == Exit.SUCCESS
    assert capsys.readouterr().out == (
        'compositions:\n  thorough:\n    description: "the behaviour tree thorough"\n    do:\n      seq:\n'
        '        - {check: "not table_tidy"}\n        - seq:\n            - retry: 1\n'
        "              any:\n                - {check: table_tidy}\n                - {skill: sweep}\n"
        "                - {skill: scrub}\n            - tolerate: {skill: put_away}\n"
    )


def test_only_regular_files_are_replaced(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    module, pipe = str(CORPUS / "accepted" / "alternatives_and_tries"), tmp_path / "pipe"
    os.mkfifo(pipe)
    (tmp_path / "link").symlink_to("/dev/null")
    for path in (pipe, tmp_path / "link"):
        with pytest.raises(SystemExit, match=str(Exit.USAGE.value)):
            main(["export", "bt", module, *SITE, "--output", str(path)])
        assert "is not a regular file" in capsys.readouterr().err
    assert pipe.is_fifo()


def test_a_module_without_compositions_has_nothing_to_export(capsys: pytest.CaptureFixture[str]) -> None:
    module = str(CORPUS / "accepted" / "asks_for_the_stop")
    assert main(["export", "bt", module, *SITE]) == Exit.USAGE
    assert "composition" in capsys.readouterr().err


def test_handlers_that_lead_back_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    module = str(CORPUS / "rejected" / "composition" / "handlers_in_a_circle")
    assert main(["export", "bt", module, *SITE]) == Exit.REJECTED
    assert "lead back to each other" in capsys.readouterr().err
