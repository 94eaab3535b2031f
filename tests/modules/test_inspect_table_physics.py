"""A table is inspected on physics, whether it is clean or not, and the result says which."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from tests.shipped_scenes import ECMS

pytestmark = pytest.mark.physics

DIRTY = ", ".join(
    f"clean_table.{one}"
    for one in ("table_verified = false", "wiped_fraction = 0", "clutter_on_table = true")
)
CLEAN = "clean_table.table_verified = true"


def printed_by(instruction: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> str:
    folders = ["--out", str(tmp_path / "out"), "--state", str(tmp_path / "robot"), "--no-film"]
    assert main(["run", instruction, "--ecms", str(ECMS), "--seed", "7", *folders]) == Exit.SUCCESS
    return capsys.readouterr().out


def test_a_dirty_table_is_no_failure(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    printed = printed_by("have a look at the table", tmp_path, capsys)
    assert "outcome `dirty`" in printed
    assert f"inspect_table.table_inspected = true, {DIRTY}" in printed
    assert "believed true, true in the simulator" in printed


@pytest.mark.deep
def test_a_wiped_table_is_reported_as_clean(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    printed = printed_by("clean the table, then inspect it", tmp_path, capsys)
    assert "outcome `clean`" in printed or "inspect_table.table_inspected = true" in printed
    assert CLEAN in printed
