"""A wrong expectation fails, and the result shows the difference."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from tests.unit.cli.author.site_tests.rewriting import rewrite


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        (
            "expect: ALLOW",
            "expect: DENY\n    by: [slow-near-person]",
            "expected DENY by slow-near-person, decided ALLOW",
        ),
        ("by: [slow-near-person]", "by: [stop-button]", "ATTENUATE, but no reason names stop-button"),
        ("becomes: {pace: 100 mm/s}", "becomes: {pace: 99 mm/s}", "expected pace = 0.099, became 0.1"),
        ("by: [AE730]", "by: [AE706]", "reason: AE730 "),
        ("\n    by: [AE703]", "", "DENY, but only because the request or the state is incomplete"),
        ("codes: [AE501]", "codes: [AE403]", "expected error AE403, which is absent"),
        ("codes: [AE501]", "codes: []", "error: AE501 `tidy` may ask for"),
        ("expect: proved\n    codes: []", "expect: rejected", "expected rejected, is proved"),
    ],
)
def test_a_wrong_expectation_fails_and_shows_the_difference(
    changed: Path, old: str, new: str, problem: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["test", str(rewrite(changed, old, new))]) == Exit.REJECTED
    shown = capsys.readouterr().out
    assert shown.count("FAIL") == 1
    assert problem in shown
    assert shown.splitlines()[-1] == "6 passed, 1 failed"
