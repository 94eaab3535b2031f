"""A dask cluster as an executor of trials.  Sole importer of distributed."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager

from distributed import Client

from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError


@contextmanager
def dask_executor(address: str, timeout_s: str = "10s") -> Iterator[tuple[Executor, int]]:
    """Connect to a dask cluster, whose workers need the same AEROS and modules.

    Args:
        address: of the scheduler, as dask writes it (`tcp://HOST:PORT`).
        timeout_s: longest wait for the scheduler, as dask writes it.

    Yields:
        The executor, and the number of its workers.

    Raises:
        UserError: no scheduler answers in time, or it has no worker.
    """
    try:
        client = Client(address, timeout=timeout_s)
    except (OSError, ValueError) as error:
        raise UserError([Diagnostic("AE002", f"no scheduler answers at `{address}`: {error}")]) from error
    with client:
        workers = len(client.scheduler_info(n_workers=-1)["workers"])
        if not workers:
            raise UserError([Diagnostic("AE002", f"the scheduler at `{address}` has no worker")])
        with client.get_executor() as executor:
            yield executor, workers
