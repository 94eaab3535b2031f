"""A dask cluster as an executor of trials.  Sole importer of distributed."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path

from distributed import Client, Security

from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError


@contextmanager
def dask_executor(
    address: str, tls: tuple[Path, Path, Path] | None = None, timeout_s: str = "10s"
) -> Iterator[tuple[Executor, int]]:
    """Connect to a dask cluster, whose workers need the same AEROS and modules.

    Args:
        address: of the scheduler, `HOST:PORT`.
        tls: certificate of the authority, certificate and key of this client, in PEM; None for a plain
            connection.
        timeout_s: longest wait for the scheduler, as dask writes it.

    Yields:
        The executor, and the number of its workers.

    Raises:
        UserError: no scheduler answers in time, it has no worker, or a file of TLS cannot be used.
    """
    security = None
    if tls is not None:
        authority, certificate, key = map(str, tls)
        security = Security(
            require_encryption=True,
            tls_ca_file=authority,
            tls_client_cert=certificate,
            tls_client_key=key,
        )
    address = f"{'tcp' if tls is None else 'tls'}://{address}"
    try:
        client = Client(address, timeout=timeout_s, security=security)
    except (OSError, ValueError) as error:
        raise UserError([Diagnostic("AE002", f"no scheduler answers at `{address}`: {error}")]) from error
    with client:
        workers = len(client.scheduler_info(n_workers=-1)["workers"])
        if not workers:
            raise UserError([Diagnostic("AE002", f"the scheduler at `{address}` has no worker")])
        with client.get_executor() as executor:
            yield executor, workers
