"""Unpacking of snapshots: values that were measured at one time, as the scalars that conditions read."""

from __future__ import annotations

from collections.abc import Mapping

from aeros.runtime.gate.compiled.codegen import FunctionWriter
from aeros.runtime.gate.request_check import snapshot_columns
from aeros.runtime.gate.value_check import Scalars, ValueChecker
from aeros.runtime.ports import Snapshot


class SnapshotUnpacker:
    """Unpacker of snapshots of one site's state."""

    def __init__(self, checkers: Mapping[str, ValueChecker]) -> None:
        self._unpackers = {name: FunctionWriter().build_unpacker(form) for name, form in checkers.items()}

    def scalars(self, snapshot: Snapshot) -> Scalars | None:
        """Unpack all values of a snapshot.

        Args:
            snapshot: values that were measured at one time.

        Returns:
            The scalars by scalar variable; None if a name is no state variable or a value is malformed.
        """
        columns = snapshot_columns(snapshot)
        if columns is None:
            return None
        order, column = columns
        scalars: Scalars = {}
        for name, value in zip(order.names, column, strict=True):
            unpack = self._unpackers.get(name) if type(name) is str else None
            unpacked = None if unpack is None else unpack(value)
            if unpacked is None:
                return None
            scalars.update(unpacked)
        return scalars
