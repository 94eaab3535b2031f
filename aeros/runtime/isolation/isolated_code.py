"""Code in a worker: spawns the worker, exchanges requests and responses, and kills it."""

from __future__ import annotations

import signal

from aeros.runtime.isolation.control_groups import NO_GROUP
from aeros.runtime.isolation.limits import USUAL_LIMITS, ProcessLimits
from aeros.runtime.isolation.protocol import (
    ProtocolError,
    RuntimeRequest,
    SkillLoaded,
    SkillRejected,
    WorkerConnection,
    WorkerEndedError,
    WorkerResponse,
)
from aeros.runtime.isolation.zygote_pool import ZygoteError, ZygotePool
from aeros.runtime.skills.contract import SkillRefusedError


class IsolatedCode:
    """Code of one module in a worker of its own.

    Args:
        pool: provides the worker.
        module: id of the module.
        memory: descriptor of memory that the worker shares, open for reading alone; None for none.
        limits: limits on the worker.

    Raises:
        SkillRefusedError: there is no worker.
    """

    def __init__(
        self,
        pool: ZygotePool,
        module: str,
        memory: int | None = None,
        limits: ProcessLimits = USUAL_LIMITS,
    ) -> None:
        self._pool = pool
        self._module = module
        try:
            self._zygote, channel = pool.spawn_worker(memory, limits)
        except ZygoteError as failure:
            raise SkillRefusedError(f"there is no worker for module `{module}`: {failure}") from failure
        self._connection = WorkerConnection(channel)
        self._is_alive = True

    def memory_peak(self) -> int | None:
        """Return the most memory that the worker has mapped beyond its interpreter's, bytes.

        Returns:
            The size; None if the worker has ended or the system does not say.
        """
        return self._zygote.worker_memory() if self._is_alive else None

    def _request(self, question: RuntimeRequest, seconds: float) -> WorkerResponse:
        """Send a request and wait for the response; see `WorkerConnection.request`."""
        return self._connection.request(question, seconds)

    def _load(self, question: RuntimeRequest, seconds: float) -> None:
        """Send the code; kill the worker if it cannot be loaded.

        Raises:
            SkillRefusedError: it cannot be loaded.
        """
        try:
            self._require_loaded(question, seconds)
        except BaseException:
            self._kill_worker()
            raise

    def _require_loaded(self, question: RuntimeRequest, seconds: float) -> None:
        try:
            response = self._request(question, seconds)
        except WorkerEndedError as failure:
            why = f"its process {format_exit_code(self._kill_worker())}"
            raise SkillRefusedError(f"the code of module `{self._module}` fails to load: {why}") from failure
        except (ProtocolError, TypeError, ValueError, OverflowError) as failure:
            raise SkillRefusedError(
                f"the code of module `{self._module}` fails to load: {failure}"
            ) from failure
        if not isinstance(response, SkillLoaded):
            why = response.reason if isinstance(response, SkillRejected) else "it sent an unexpected response"
            raise SkillRefusedError(why)

    def _kill_worker(self) -> int | None:
        """Kill the worker with all its descendants; return its exit code if it is known."""
        if not self._is_alive:
            return None
        self._is_alive = False
        self._connection.close()
        try:
            code = self._zygote.end_worker()
        except ZygoteError:
            return None  # the zygote was killed with everything below it, so it is not released
        self._pool.release(self._zygote)
        return code


def format_exit_code(code: int | None) -> str:
    """Describe the end of a worker.

    Args:
        code: its exit code, negative for a signal; None if it is not known.

    Returns:
        Words that complete “its process …”.
    """
    if code is None or code == -signal.SIGKILL:
        return "hung up or was killed"
    if code == NO_GROUP:
        return "could not enter its control group"
    if code >= 0:
        return f"ended with exit status {code}"
    try:
        return f"was killed by {signal.Signals(-code).name}"
    except ValueError:
        return f"was killed by signal {-code}"
