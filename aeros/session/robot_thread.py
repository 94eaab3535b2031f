"""A dedicated thread that opens, uses and closes the robot."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import AbstractContextManager
from queue import SimpleQueue
from typing import Generic, TypeVar

_Parts = TypeVar("_Parts")
_Result = TypeVar("_Result")


class RobotThread(Generic[_Parts]):
    """Thread in which a robot is opened, used and closed: its databases must be used by a single thread.

    Args:
        open_parts: Context manager of the robot's parts; it is entered and left in the thread.

    Raises:
        BaseException: Any exception that `open_parts` raises on entry.
    """

    def __init__(self, open_parts: Callable[[], AbstractContextManager[_Parts]]) -> None:
        self._open = open_parts
        self._queue: SimpleQueue[Callable[[_Parts], None] | None] = SimpleQueue()
        self._opened: Future[None] = Future()
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="aeros-robot")
        self._thread.start()
        self._opened.result()

    def call(self, function: Callable[[_Parts], _Result]) -> Future[_Result]:
        """Queue a call of `function` in the thread, after all calls queued before.

        Args:
            function: Called in the thread with the opened parts.

        Returns:
            A future of the value that `function` returns or the exception that it raises.
        """
        future: Future[_Result] = Future()

        def do(parts: _Parts) -> None:
            try:
                future.set_result(function(parts))
            except BaseException as failure:
                future.set_exception(failure)
                if not isinstance(failure, Exception):
                    raise

        self._queue.put(do)
        return future

    def close(self) -> None:
        """End the thread after the queued calls; safe to call twice.

        Raises:
            BaseException: The exception that closing the robot raised; raised once.
        """
        self._queue.put(None)
        self._thread.join()
        failure, self._failure = self._failure, None
        if failure is not None:
            raise failure

    def _run(self) -> None:
        try:
            with self._open() as parts:
                self._opened.set_result(None)
                while (do := self._queue.get()) is not None:
                    do(parts)
        except BaseException as failure:
            if self._opened.done():
                self._failure = failure
            else:
                self._opened.set_exception(failure)
