"""Runs a function in a forked child, for tests of what a process does to itself for good."""

from __future__ import annotations

import json
import os
import traceback
import warnings
from collections.abc import Callable
from typing import Any


def in_child(work: Callable[[int], Any]) -> Any:
    """Run `work` in a child of this process and return its result as JSON values.

    It gets a descriptor that stays open, through which the result comes back.
    """
    ours, theirs = os.pipe()
    with warnings.catch_warnings():
        # Of other threads, whose locks a child might wait for: it calls nothing that needs them.
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if child == 0:
        try:
            result = {"returned": work(theirs)}
        except BaseException:
            result = {"raised": traceback.format_exc()}
        os.write(theirs, json.dumps(result).encode())
        os._exit(0)
    os.close(theirs)
    with open(ours, "rb") as answer:
        found = json.loads(answer.read() or b'{"raised": "the child was killed"}')
    os.waitpid(child, 0)
    assert "raised" not in found, found["raised"]
    return found["returned"]
