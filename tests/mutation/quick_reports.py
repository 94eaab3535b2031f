"""Options and hooks of pytest that trials of mutants share."""

from __future__ import annotations

from typing import Any, Final

import pytest

OPTIONS: Final = (
    *("--rootdir=.", "-q", "-s", "-p", "no:cacheprovider", "-p", "no:cov", "-p", "no:xdist"),
    *("-m", "not physics and not deep", "-W", "ignore::pytest.PytestAssertRewriteWarning"),
)


class QuickReports:
    """Plugin of pytest that spends no time on the description of a failure."""

    def pytest_configure(self) -> None:
        """Let Hypothesis stop at the first failure, which need not be made small."""
        from hypothesis import Phase, settings  # not before pytest has begun, which rewrites it

        settings.register_profile("first", settings(), phases=(Phase.explicit, Phase.generate))
        settings.load_profile("first")

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_makereport(
        self, item: pytest.Item, call: pytest.CallInfo[None]
    ) -> pytest.TestReport | None:
        """Make a report without a traceback, which would take longer than most tests."""
        if call.excinfo is None:
            return None
        skipped = call.excinfo.errisinstance(pytest.skip.Exception)
        outcome: Any = "skipped" if skipped else "failed"
        reason: Any = ("", 0, "skipped") if skipped else "failed"
        return pytest.TestReport(
            item.nodeid, item.location, {}, outcome, reason, "call" if call.when == "collect" else call.when
        )
