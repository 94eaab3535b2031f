"""A cluster of dask is an executor like any other."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from aeros.experiments.trial_runner import TlsFiles, executor_at, run_trials
from aeros.experiments.trial_store import TrialStore
from aeros.spec.diagnostics.errors import MisuseError, UserError
from tests.unit.experiments.support.common import WHERE, comparable_findings, condition

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

    with pytest.raises(UserError) as refused, dask_executor("127.0.0.1:1", None, "1s"):
        pass
    assert "no scheduler answers at `tcp://127.0.0.1:1`" in refused.value.diagnostics[0].headline


@pytest.fixture
def files(tmp_path: Path) -> TlsFiles:
    """An authority, and a certificate that it signed, which is itself."""
    security = distributed.Security.temporary()
    key, certificate = tmp_path / "key.pem", tmp_path / "certificate.pem"
    key.write_text(security.tls_client_key)
    certificate.write_text(security.tls_client_cert)
    return TlsFiles(certificate, certificate, key)


def cluster_with_tls(files: TlsFiles) -> Any:
    authority, certificate, key = map(str, files)
    security = distributed.Security(
        require_encryption=True,
        tls_ca_file=authority,
        **{
            f"tls_{role}_{kind}": path
            for role in ("scheduler", "worker", "client")
            for kind, path in (("cert", certificate), ("key", key))
        },
    )
    return distributed.LocalCluster(
        n_workers=1,
        threads_per_worker=1,
        processes=False,
        dashboard_address=None,
        protocol="tls",
        security=security,
    )


@pytest.mark.filterwarnings("default")
def test_a_cluster_is_reached_by_tls_and_by_nothing_else(files: TlsFiles) -> None:
    from aeros.experiments.cluster import dask_executor

    with cluster_with_tls(files) as cluster:
        address = cluster.scheduler_address.removeprefix("tls://")
        with executor_at(f"dask://{address}", 1, files) as (executor, workers):
            assert workers == 1
            assert executor.submit(abs, -3).result(20) == 3
        with pytest.raises(UserError, match="no scheduler answers"), dask_executor(address, None, "1s"):
            pass


@pytest.mark.parametrize("host", ["10.0.0.7", "robot.example", "192.168.1.2", "[fe80::1]", "10.0.0", ""])
def test_an_unencrypted_connection_to_another_machine_is_refused(host: str) -> None:
    with pytest.raises(MisuseError, match=r"would not be encrypted.*--tls-ca, --tls-cert and --tls-key"):
        executor_at(f"dask://{host}:8786", 1)


@pytest.mark.parametrize("host", ["localhost", "127.0.0.1", "127.1.2.3", "[::1]"])
def test_this_machine_needs_no_encryption(host: str) -> None:
    executor_at(f"dask://{host}:8786", 1)


def test_files_of_tls_are_for_a_cluster(files: TlsFiles) -> None:
    with pytest.raises(MisuseError, match="name one with `--executor`"):
        executor_at(None, 1, files)


@pytest.mark.filterwarnings("default")
def test_a_file_of_tls_that_is_none_is_reported(files: TlsFiles) -> None:
    files.key.write_text("no key")
    with pytest.raises(UserError, match=r"127\.0\.0\.1"), executor_at("dask://127.0.0.1:1", 1, files):
        pass
