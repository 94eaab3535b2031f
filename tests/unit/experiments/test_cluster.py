"""A cluster of dask is an executor like any other."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path

import pytest

from aeros.experiments.trial_runner import executor_at, run_trials
from aeros.experiments.trial_store import TrialStore
from aeros.spec.diagnostics.errors import UserError
from tests.unit.experiments.common import WHERE, comparable_findings, condition

distributed = pytest.importorskip("distributed")


@pytest.fixture
def address() -> Iterator[str]:
    with (
        warnings.catch_warnings(),
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None, protocol="tcp"
        ) as cluster,
    ):
        yield cluster.scheduler_address.replace("tcp://", "dask://")


@pytest.mark.filterwarnings("default")
def test_a_cluster_finds_what_this_process_finds(address: str, tmp_path: Path) -> None:
    one = condition(task="fetch_object")
    found = []
    for name, at in (("there", address), ("here", None)):
        with TrialStore(tmp_path / name) as store, executor_at(at, 1) as (executor, workers):
            assert workers == 1
            run_trials([one], range(3), WHERE, executor, workers, store, lambda _: None)
            found.append({key: comparable_findings(value) for key, value in store.trials.items()})
    assert len(found[0]) == 3
    assert found[0] == found[1]


@pytest.mark.filterwarnings("default")
def test_an_unreachable_scheduler_is_reported() -> None:
    from aeros.experiments.cluster import dask_executor

    with pytest.raises(UserError) as refused, dask_executor("tcp://127.0.0.1:1", "1s"):
        pass
    assert "no scheduler answers at `tcp://127.0.0.1:1`" in refused.value.diagnostics[0].headline
