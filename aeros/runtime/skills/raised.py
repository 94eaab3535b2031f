"""Description of what a skill or perceiver raised: line, exception, and the name that was probably meant."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Collection
from pathlib import PurePath
from types import TracebackType
from typing import Any, Final

from aeros.descriptions import describe_exception
from aeros.runtime.skills.code import is_code_of_same_module

_CLOSE: Final = 0.85
"""Least similarity of a misspelt name: variables of one kind, such as positions, have similar names."""


def describe_raised(failure: BaseException, function: Callable[..., Any], known: Collection[str]) -> str:
    """Describe an exception that the code of a skill or perceiver raised.

    Args:
        failure: the exception.
        function: the generator function.
        known: names that the code may look up: variables that it senses, its inputs and its pictures.

    Returns:
        As in `skills.py:36: KeyError: 'bloc_position'; did you mean `block_position`?`.
    """
    place = _last_place(failure.__traceback__, function)
    if type(failure) is MemoryError and not failure.args:
        return f"{place}MemoryError: its process may use no more memory"
    missing = _missing_name(failure)
    near = () if missing is None else difflib.get_close_matches(missing, list(known), 1, _CLOSE)
    return f"{place}{describe_exception(failure)}" + (f"; did you mean `{near[0]}`?" if near else "")


def _last_place(trace: TracebackType | None, function: Callable[..., Any]) -> str:
    """Return file and line of the innermost call in the module's own code, as in `skills.py:36: `."""
    place = ""
    while trace is not None:
        if is_code_of_same_module(trace.tb_frame.f_globals, function):
            place = f"{PurePath(trace.tb_frame.f_code.co_filename).name}:{trace.tb_lineno}: "
        trace = trace.tb_next
    return place


def _missing_name(failure: BaseException) -> str | None:
    """Return the key that a mapping lacks; a subclass of KeyError may answer anything, so it is not asked."""
    if type(failure) is not KeyError or len(failure.args) != 1:
        return None
    (key,) = failure.args
    return key if type(key) is str else None
