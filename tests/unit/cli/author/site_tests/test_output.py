"""Results for programs."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from tests.unit.cli.author.site_tests.rewriting import rewrite


def test_programs_get_json_and_junit(changed: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rewrite(changed, "expect: ALLOW", "expect: DENY\n    by: [stop-button]")
    assert main(["test", str(changed), "--format", "json"]) == Exit.REJECTED
    report = json.loads(capsys.readouterr().out)
    assert (report["schema"], report["passed"], report["failed"]) == ("aeros/test-report/1", 6, 1)
    (failed,) = (one for one in report["tests"] if not one["passed"])
    assert (failed["name"], failed["file"]) == ("fast_and_alone", str(changed))
    assert failed["problems"][0] == "expected DENY by stop-button, decided ALLOW"
    assert main(["test", str(changed), "--format", "junit"]) == Exit.REJECTED
    (suite,) = ET.fromstring(capsys.readouterr().out)  # noqa: S314  our own output
    assert (suite.attrib["tests"], suite.attrib["failures"]) == ("7", "1")
    assert [case.attrib["name"] for case in suite if len(case)] == ["fast_and_alone"]
