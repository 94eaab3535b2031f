"""`aeros new` lists what it creates."""

from __future__ import annotations

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit


def test_each_kind_is_listed(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["new", "--help"])
    assert end.value.code == Exit.SUCCESS
    text = capsys.readouterr().out
    for kind in ("ecm", "site", "ci", "project"):
        assert f"\n    {kind} " in text


def test_another_kind_is_refused_with_the_one_that_is_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["new", "projekt", "x"])
    assert end.value.code == Exit.USAGE
    assert "did you mean `project`?" in capsys.readouterr().err
