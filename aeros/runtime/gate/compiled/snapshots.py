"""Incremental unpacking of snapshots: only values that changed since the previous snapshot are unpacked."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import compress, count
from operator import is_not
from typing import Any, NamedTuple

from aeros.runtime.gate.compiled.codegen import FunctionWriter
from aeros.runtime.gate.request_check import snapshot_columns
from aeros.runtime.gate.value_check import Scalars, ValueChecker
from aeros.runtime.ports import ColumnNames, Snapshot


class _CachedColumn(NamedTuple):
    """A column of well-formed, immutable values, with the scalars of all of them."""

    order: ColumnNames
    column: tuple[Any, ...]
    scalars: Scalars


class SnapshotCache:
    """Cache of the last unpacked snapshot of one site.

    The cached entry is replaced as a whole, so that several threads may use the cache.
    """

    def __init__(self, checkers: Mapping[str, ValueChecker]) -> None:
        self._unpackers = {name: FunctionWriter().build_unpacker(form) for name, form in checkers.items()}
        self._cached: _CachedColumn | None = None

    def scalars(self, snapshot: Snapshot) -> Scalars | None:
        """Unpack all values of a snapshot.

        Args:
            snapshot: values that were measured at one time.

        Returns:
            The scalars by scalar variable, not to be modified; None if a name is no state variable or a value
            is malformed.
        """
        columns = snapshot_columns(snapshot)
        if columns is None:
            return None
        cached, (order, column) = self._cached, columns
        if cached is None or cached.order is not order:
            places, scalars = iter(range(len(column))), {}
        elif cached.column is column:
            return cached.scalars
        else:
            places, scalars = compress(count(), map(is_not, column, cached.column)), dict(cached.scalars)
        for place in places:
            name = order.names[place]
            unpack = self._unpackers.get(name) if type(name) is str else None
            value = column[place]
            # A list could be modified before the next call, so it must not be cached.
            unpacked = None if unpack is None or type(value) is list else unpack(value)
            if unpacked is None:
                return None
            scalars.update(unpacked)
        self._cached = _CachedColumn(order, column, scalars)
        return scalars
