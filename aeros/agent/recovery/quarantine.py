"""Crash-loop quarantine: an agent that keeps crashing is left asleep until the operator lets it go on.

Crashes are kept in the agent's folder, so a watchdog that died itself has not forgotten them.
"""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from aeros.agent.errors import AgentError
from aeros.files import replace_durably
from aeros.spec.migrations.format import FormatVersionError, UnmigratableError
from aeros.spec.migrations.formats import CRASHES, QUARANTINE
from aeros.spec.migrations.rewriting import rewrite

_CRASHES: Final = "crashes.json"
_QUARANTINE: Final = "quarantine.json"


class Quarantine:
    """That of the agent whose folder this is."""

    def __init__(self, folder: Path) -> None:
        self._crashes, self._path = folder / _CRASHES, folder / _QUARANTINE

    def record_crash(self, why: str, now: float, most: int, within: float) -> str | None:
        """Take note of a crash; the reason for a quarantine, where it makes `most` of them `within` seconds.

        now: seconds since 1970.
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
        """What is said to whoever would wake an agent in quarantine; None where it is not in any."""
        try:
            kept = json.loads(self._path.read_text("utf-8"))
            QUARANTINE.require_current(kept, self._path)
            why = f"{kept['reason']} (since {kept['since']})"
        except FileNotFoundError:
            return None
        except FormatVersionError as error:
            why = str(error)
        except (OSError, ValueError, KeyError, TypeError):
            why = f"{self._path} is there, and does not say why"
        return f"this agent is in quarantine: {why}; `aeros release` lets it go on"

    def clear(self) -> bool:
        """Let it go on; whether it was in quarantine."""
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
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        replace_durably(path, json.dumps(content).encode())
    except OSError as error:
        raise AgentError(f"{path} cannot be written: {error.strerror}") from error
