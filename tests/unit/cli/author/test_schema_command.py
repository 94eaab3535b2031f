from __future__ import annotations

import json

import pytest

from aeros.cli.author.schema import report_schema
from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.spec.declared.json_schema import json_schema_of


@pytest.mark.parametrize("name", ["ecm", "site", "report"])
def test_the_schema_is_printed_as_ascii(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema", name]) == Exit.SUCCESS
    shown = capsys.readouterr().out
    assert shown.isascii()
    assert json.loads(shown) == (report_schema() if name == "report" else json_schema_of(name))


def test_an_unknown_schema_is_a_usage_error(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["schema", "robo"])
    assert ended.value.code == Exit.USAGE
    assert "ecm" in capsys.readouterr().err
