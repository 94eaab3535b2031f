"""Crash-loop quarantine: an agent that crashes repeatedly stays off until the operator releases it.

Crashes are kept in the agent's folder, so they survive a crash of the watchdog.
"""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from aeros.agent.errors import AgentError
from aeros.files import make_folder, replace_durably
from aeros.spec.migrations.format import FormatVersionError, UnmigratableError
from aeros.spec.migrations.formats import CRASHES, QUARANTINE
from aeros.spec.migrations.rewriting import rewrite

_CRASHES: Final = "crashes.json"
_QUARANTINE: Final = "quarantine.json"


class Quarantine:
    """Quarantine of the agent whose state folder is `folder`."""

    def __init__(self, folder: Path) -> None:
        self._crashes, self._path = folder / _CRASHES, folder / _QUARANTINE

    def record_crash(self, why: str, now: float, most: int, within: float) -> str | None:
        """Record a crash, and start the quarantine if there were too many.

        Args:
            why: reason of the crash, for people.
            now: time of the crash, seconds since 1970.
            most: number of crashes that starts the quarantine.
            within: time window (s) in which crashes are counted.

        Returns:
            The reason of the quarantine; None if it did not start.
        """
        recent = [one for one in self._recent_crashes() if 0.0 <= now - one[0] <= within]
        recent.append((now, why))
        _write_json(self._crashes, {"schema": CRASHES.schema, "crashes": recent})
        if len(recent) < most:
            return None
        reason = f"it crashed {len(recent)} times within {within:g} s; the last time, {why}"
        since = datetime.fromtimestamp(now, UTC).isoformat(timespec="seconds")
        _write_json(self._path, {"schema": QUARANTINE.schema, "since": since, "reason": reason})
        return reason

    def reason(self) -> str | None:
        """Return the message for a user who wants to start an agent in quarantine.

        Returns:
            The message; None if the agent is not in quarantine.
        """
        try:
            kept = json.loads(self._path.read_text("utf-8"))
            QUARANTINE.require_current(kept, self._path)
            why = f"{kept['reason']} (since {kept['since']})"
        except FileNotFoundError:
            return None
        except FormatVersionError as error:
            why = str(error)
        except (OSError, ValueError, KeyError, TypeError):
            why = f"{self._path} exists, but gives no reason"
        return f"this agent is in quarantine: {why}; run `aeros release` to lift it"

    def clear(self) -> bool:
        """Release the agent and forget its crashes.

        Returns:
            True if it was in quarantine.
        """
        was = self._path.exists()
        for path in (self._crashes, self._path):
            path.unlink(missing_ok=True)
        return was

    def _recent_crashes(self) -> list[tuple[float, str]]:
        try:
            current = rewrite(self._crashes, self._crashes.read_text("utf-8"), CRASHES)
            return [(float(at), str(why)) for at, why in json.loads(current.text)["crashes"]]
        except FileNotFoundError:
            return []
        except UnmigratableError as error:
            raise AgentError(f"`{self._crashes}` cannot be read: {error}") from error
        except (OSError, ValueError, KeyError, TypeError):
            return []  # at worst it is restarted a few times more


def _write_json(path: Path, content: Any) -> None:
    try:
        make_folder(path.parent, 0o700)
        replace_durably(path, json.dumps(content).encode())
    except OSError as error:
        raise AgentError(f"{path} cannot be written: {error.strerror}") from error
