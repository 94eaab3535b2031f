"""A test of a layer runs, is skipped, or fails, by what the host offers and what is expected of it."""

from __future__ import annotations

import pytest

from tests import host_layers
from tests.host_layers import LAYERS, VARIABLE, expected_layers, require_layers, summary_lines
from tests.repo.tree import text_of


@pytest.fixture
def lacking(monkeypatch: pytest.MonkeyPatch) -> None:
    """A host without Landlock."""
    monkeypatch.setattr(
        host_layers, "missing_reason", lambda layer: "no such kernel" if layer == "landlock" else None
    )


@pytest.mark.usefixtures("lacking")
def test_where_a_layer_is_missing_a_test_is_skipped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)
    require_layers("seccomp", "rlimits")
    with pytest.raises(pytest.skip.Exception, match=r"this host lacks \{'landlock': 'no such kernel'\}"):
        require_layers("seccomp", "landlock")
    monkeypatch.setenv(VARIABLE, "seccomp")
    with pytest.raises(pytest.skip.Exception):
        require_layers("seccomp", "landlock")


@pytest.mark.usefixtures("lacking")
def test_where_a_missing_layer_is_expected_a_test_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, "landlock, seccomp")
    with pytest.raises(pytest.fail.Exception, match="AEROS_EXPECT_LAYERS names"):
        require_layers("landlock")


def test_an_unknown_layer_is_refused() -> None:
    assert expected_layers("") == frozenset()
    with pytest.raises(pytest.UsageError, match=r"names \['limits'\]; there are landlock, seccomp"):
        expected_layers("landlock,limits")


@pytest.mark.usefixtures("lacking")
def test_a_run_reports_how_many_tests_of_layers_ran() -> None:
    assert list(summary_lines(3, ["b", "a", "a"])) == [
        "isolation layers: 3 tests ran, 3 skipped; this host offers seccomp, rlimits, bubblewrap, cgroups",
        "  2 skipped: a",
        "  1 skipped: b",
    ]


def test_the_host_is_asked_without_the_code_under_test() -> None:
    assert "from aeros" not in text_of("tests/host_layers.py")
    assert LAYERS == ("landlock", "seccomp", "rlimits", "bubblewrap", "cgroups")
