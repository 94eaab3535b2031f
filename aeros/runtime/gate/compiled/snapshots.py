"""The scalars of moments, each taken apart only as far as its values are not those of the moment before."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import compress, count
from operator import is_not
from typing import Any, NamedTuple

from aeros.runtime.gate.compiled.codegen import FunctionWriter
from aeros.runtime.gate.value_check import Scalars, ValueChecker
from aeros.runtime.ports import ColumnNames, Snapshot


class _CachedColumn(NamedTuple):
    """A column of well-formed values that cannot change, and the scalars of them all."""

    order: ColumnNames
    column: tuple[Any, ...]
    scalars: Scalars


class SnapshotCache:
    """Takes moments of one site apart.

    What it keeps is replaced as a whole, so that several threads may ask.
    """

    def __init__(self, checkers: Mapping[str, ValueChecker]) -> None:
        self._taking = {name: FunctionWriter().build_unpacker(form) for name, form in checkers.items()}
        self._taken: _CachedColumn | None = None

    def scalars(self, snapshot: Snapshot) -> Scalars | None:
        """Those of all values, none of which is older than another; not to be changed.

        None where one is of no state variable or has not its form.
        """
        taken, order, column = self._taken, snapshot.order, snapshot.column
        if taken is None or taken.order is not order:
            places, scalars = iter(range(len(column))), {}
        elif taken.column is column:
            return taken.scalars
        else:
            places, scalars = compress(count(), map(is_not, column, taken.column)), dict(taken.scalars)
        for place in places:
            taking = self._taking.get(order.names[place])
            value = column[place]
            # A list may hold other values by the time that it is looked at again.
            found = None if taking is None or type(value) is list else taking(value)
            if found is None:
                return None
            scalars.update(found)
        self._taken = _CachedColumn(order, column, scalars)
        return scalars
