"""Fixtures and hooks of all tests: markers by folder, Hypothesis profile, Ctrl-C as at a terminal, proofs.

Markers choose what a target of the Makefile runs: `make quick` runs what has none of them, `make test` all
but `deep`, `make deep` everything.
"""

from __future__ import annotations

import gc
import os
import shutil
import signal
import sys
import tempfile
from collections.abc import Generator, Iterable
from fnmatch import fnmatchcase
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Final

import pytest

import tests.hypothesis_profiles  # noqa: F401 - loads the profile of this run
from tests import shipped_modules
from tests.compiled_ahead import compile_ahead
from tests.host_layers import VARIABLE, expected_layers, pytest_terminal_summary  # noqa: F401 - a hook
from tests.sampled_cases import leave_cases_to_deep
from tests.shared_answers import SharedAnswers

# Matrices here are small: more threads only wait for each other, and that is a fifth of the processor time.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# A job of a shell that is not interactive ignores Ctrl-C, and so does everything that it starts.
signal.signal(signal.SIGINT, signal.default_int_handler)

# Modules, tests and caches fill a heap of a gigabyte that lives to the end; to search it for garbage again
# and again takes a fifth of the time of all tests.
gc.set_threshold(100_000, 50, 100)

_HERE = Path(__file__).parent
_PROVING = [
    _HERE / one
    for one in (
        "corpus",
        "differential",
        "property",
        "unit/spec",
        "unit/cli/author/reports",
    )
]
_PROVING += sorted(_HERE.glob("unit/cli/author/test_verify*.py"))
"""Tests of what proves, which prove everything themselves."""

MARKED: Final = {
    "page": ("repo/pages/test_*_page.py", "repo/pages/test_readme.py", "repo/pages/test_tutorial.py"),
    "slow": (
        "corpus",
        "differential",
        "property",
        "repo/test_benchmarks.py",
        "repo/test_ci_integration.py",
        "repo/test_code.py",
        "repo/test_docstrings.py",
        "repo/test_learned_module.py",
        "repo/test_nothing_is_put_in_place.py",
        "repo/test_vocabulary.py",
        "repo/pages/test_codes.py",
        "unit/agent/planning/test_time_limited.py",
        "unit/agent/execution/test_dispatcher.py",
        "unit/agent/execution/test_progress.py",
        "unit/agent/planning/test_classical.py",
        "unit/agent/planning/test_llm.py",
        "unit/agent/planning/test_llm_client.py",
        "unit/agent/test_agent.py",
        "unit/agent/test_plan_source.py",
        "unit/agent/test_task_loop*.py",
        "unit/agent/memory/test_store_and_gate.py",
        "unit/agent/planning/test_pddl.py",
        "unit/agent/planning/test_smt.py",
        "unit/apps",
        "unit/cli",
        "unit/session",
        "unit/experiments",
        "unit/runtime/bus/test_in_process.py",
        "unit/runtime/bus/test_whole_run.py",
        "unit/runtime/isolation/twins/test_broken_layers.py",
        "unit/runtime/isolation/test_isolated_run.py",
        "unit/runtime/isolation/test_probes.py",
        "unit/runtime/isolation/test_zygote.py",
        "unit/runtime/isolation/test_zygote_pool.py",
        "unit/runtime/registry/test_archive.py",
        "unit/runtime/registry/test_past_configurations.py",
        "unit/runtime/registry/together/test_revocation.py",
        "unit/runtime/registry/together/test_transaction_kill.py",
        "unit/runtime/test_arm_and_base.py",
        "unit/runtime/audit/test_log_kills.py",
        "unit/runtime/test_decided_together.py",
        "unit/runtime/test_proving.py",
        "unit/runtime/records/test_replay.py",
        "unit/runtime/records/test_replay_motions.py",
        "unit/runtime/records/test_encode_decisions.py",
        "unit/sim",
        "unit/test_api.py",
        "unit/runtime/execution/test_resources.py",
        "unit/spec/backends/test_oracle.py",
        "unit/spec/backends/test_solver_process.py",
        "unit/spec/declared/test_json_schema_export.py",
        "unit/spec/obligations/test_claim_id.py",
        "unit/spec/obligations/test_configuration_claims.py",
        "unit/spec/difference",
        "unit/spec/verification/test_certificate.py",
        "unit/spec/verification/test_proof_cache.py",
        "unit/spec/verification/repairs/test_repair.py",
        "unit/spec/verification/test_verify_reports.py",
    ),
}
"""Marker by folder or file pattern below `tests/`: what `make quick` leaves to `make test`.

`physics` and `deep` are set in the files, by test.
"""

_STORE = "AEROS_STORE_OF_TESTS"
_ANSWERS = SharedAnswers()


def pytest_configure(config: pytest.Config) -> None:
    """A store for all processes of this run, which is new with each."""
    expected_layers(os.environ.get(VARIABLE, ""))
    if not hasattr(config, "workerinput"):
        os.environ[_STORE] = tempfile.mkdtemp(prefix="aeros-tests-")
    if config.getoption("numprocesses", None) and config.args_source is config.ArgsSource.TESTPATHS:
        compile_ahead(config)


def pytest_unconfigure(config: pytest.Config) -> None:
    """Nothing of it is left."""
    if not hasattr(config, "workerinput"):
        shutil.rmtree(os.environ.pop(_STORE))


_LACKS_PYBULLET = sys.version_info >= (3, 12) and find_spec("pybullet") is None
"""PyBullet has wheels for Python 3.11 only; there its absence is an error."""


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Skip tests of the physics plant where this Python has no PyBullet."""
    report = yield
    if not _LACKS_PYBULLET:
        return report
    reason = "PyBullet has no wheel for this Python"
    if report.failed and "No module named 'pybullet'" in str(report.longrepr):
        report.outcome = "skipped"
        report.longrepr = (str(collector.path), 0, f"Skipped: {reason}")
    for item in report.result:
        if isinstance(item, pytest.Item) and item.get_closest_marker("physics"):
            item.add_marker(pytest.mark.skip(reason=reason))
    return report


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave cases to `deep` before `-m` selects; a test that is named gets all of its cases."""
    is_whole = config.args_source is config.ArgsSource.TESTPATHS
    if config.option.markexpr:
        leave_cases_to_deep(items, is_whole=is_whole and "not slow" not in config.option.markexpr)


def pytest_collection_finish() -> None:
    """Let the garbage collector leave alone what was imported and collected."""
    gc.freeze()


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Skip unread what `-m 'not slow'` leaves out: to import it takes longer than many a fast test.

    So are tests that need the shipped modules, where these are deleted.
    """
    is_file = collection_path.suffix == ".py"
    if is_file and not shipped_modules.are_there() and shipped_modules.is_needed_by(collection_path):
        return True
    is_left_out = "not slow" in config.option.markexpr and _is_at(collection_path, MARKED["slow"])
    return True if is_left_out else None


def _is_at(found: Path, places: Iterable[str]) -> bool:
    """Check that a path is, or is in, one of the places below `tests/`."""
    if not found.is_relative_to(_HERE):
        return False
    path = found.relative_to(_HERE).as_posix()
    return any(fnmatchcase(path, place) or path.startswith(f"{place}/") for place in places)


@cache
def _markers_at(path: Path) -> tuple[str, ...]:
    return tuple(marker for marker, places in MARKED.items() if _is_at(path, places))


@cache
def _is_proving(path: Path) -> bool:
    return any(path.is_relative_to(one) for one in _PROVING)


def pytest_itemcollected(item: pytest.Item) -> None:
    """Mark a test by the folder that it is in."""
    for marker in _markers_at(item.path):
        item.add_marker(marker)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Tests that only need proved modules find what another proved in the same run, and plans likewise."""
    is_proving = _is_proving(item.path)
    os.environ["AEROS_CACHE"] = "off" if is_proving else os.environ[_STORE]
    _ANSWERS.is_on = not is_proving
