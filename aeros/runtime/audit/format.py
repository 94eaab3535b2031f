"""Version of the audit log's format, which the first record names.

`previous` of the first record is the SHA-256 of `aeros/audit/N`. A record is never rewritten, because its
hashes and signatures would become invalid: later programs have to read every earlier version.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Final

from aeros.files import open_regular
from aeros.spec.migrations.formats import AUDIT

_MOST_VERSIONS: Final = 1000
_LONGEST_LINE: Final = 1 << 20


def explain_problem(log: Path, problem: str) -> str:
    """Explain why a log cannot be read: check first if a newer AEROS wrote it.

    Args:
        log: the file.
        problem: the checker's finding.

    Returns:
        Cause and cure if the log has a newer version, else `problem`.
    """
    try:
        with open_regular(log) as file:
            previous = json.loads(file.readline(_LONGEST_LINE))["previous"]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return problem
    for version in range(AUDIT.version + 1, _MOST_VERSIONS):
        if hashlib.sha256(str(AUDIT.schema_of(version)).encode()).hexdigest() == previous:
            return "; ".join(AUDIT.refusal(version, log))
    return problem
