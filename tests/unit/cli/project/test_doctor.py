"""`aeros doctor`: each part with its state and cure, as text and as JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator

import pytest

from aeros.apps import installation
from aeros.apps.installation import InstalledPart, PartState
from aeros.cli.main import main
from aeros.exit_codes import Exit

WORKING = InstalledPart("core", PartState.WORKS, "z3-solver 5.4.0.0", "proves")
LACKING = InstalledPart("mcp", PartState.MISSING, "lacks mcp", "MCP clients", "pip install '.[mcp]'")
BROKEN = InstalledPart("core", PartState.BROKEN, "lacks z3-solver", "proves", "install it again")


@pytest.mark.parametrize(("parts", "code"), [([WORKING, LACKING], Exit.SUCCESS), ([BROKEN], Exit.REJECTED)])
def test_parts_are_shown_and_only_what_all_commands_need_is_a_failure(
    parts: list[InstalledPart],
    code: Exit,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def found() -> Iterator[InstalledPart]:
        yield from parts

    monkeypatch.setattr(installation, "examine_installation", found)
    assert main(["doctor"]) == code
    shown = capsys.readouterr().out
    assert main(["doctor", "--format", "json"]) == code
    rows = json.loads(capsys.readouterr().out)["parts"]
    for part, row in zip(parts, rows, strict=True):
        assert row == {**part._asdict(), "state": part.state.value}
        assert part.found in shown
        assert not part.cure or f"cure: {part.cure}" in shown
    assert shown.count("cure: ") == sum(bool(part.cure) for part in parts)
