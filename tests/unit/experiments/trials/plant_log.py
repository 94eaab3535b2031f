"""Lines of a plant's log, as a host writes them, of a robot at rest."""

from __future__ import annotations

from typing import Any

from tests.unit.experiments.support.common import premises

MODULES = premises().configuration.modules


HERE = {"joint_position": [0.0] * 7, "joint_velocity": [0.0] * 7}


def log_line(
    event: str,
    at: float = 1.0,
    skill: str = "make_dumplings.boil",
    cooked: bool | None = None,
    **measured: Any,
) -> dict[str, Any]:
    measured |= {} if cooked is None else {"make_dumplings.dumpling_cooked": cooked}
    finished = {"finished": True} if event == "skill-ended" else {}
    return {"event": event, "time": at, "skill": skill, **finished, "measured": {**HERE, **measured}}


BOILED = [log_line("skill-began"), log_line("skill-ended", cooked=True)]
