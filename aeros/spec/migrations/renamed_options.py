"""Old names of command-line options, with their current names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

RENAMED_OPTIONS: Final[Mapping[str, Mapping[str, str]]] = {
    "approve": {"--refuse": "--reject"},
    "audit": {"--verdict": "--decision", "--from": "--from-record", "--to": "--to-record"},
    "decide": {"--example": "--print-examples"},
    "experiment": {"--first": "--first-seed", "--enter": "--architecture"},
    "graph": {"--what": "--kind"},
    "new": {"--in": "--parent", "--task": "--instruction"},
    "plan": {"--start": "--initial", "--pddl": "--export-pddl"},
    "predict": {"--parameter": "--set", "--retry": "--max-retries", "--replans": "--max-replans"},
    "run": {
        "--plan-within": "--planning-timeout",
        "--engine": "--pddl-engine",
        "--person": "--people",
        "--record": "--film",
        "--no-record": "--no-film",
        "--video": "--film",
        "--no-video": "--no-film",
        "--crashes": "--max-crashes",
        "--within": "--crash-window",
        "--silence": "--heartbeat-timeout",
    },
    "top": {"--every": "--interval"},
}
"""Options by command: old name to current name."""
