"""Lines of a plant's log, as a host writes them, of a robot at rest."""

from __future__ import annotations

from typing import Any

from aeros.spec.expr.effects import state_after
from tests.unit.experiments.support.common import premises

MODULES = premises().configuration.modules


_BOILED = MODULES["make_dumplings"].skills["boil"].success_outcomes[0].effects
WRAPPED: dict[str, Any] = {
    **{name: not value for name, value in _BOILED.items() if isinstance(value, bool)},
    "make_dumplings.dumplings_cooked": 0,
}
COOKED: dict[str, Any] = {**state_after(_BOILED, WRAPPED), "make_dumplings.dumplings_cooked": 1}

HERE = {"joint_position": [0.0] * 7, "joint_velocity": [0.0] * 7}


def log_line(
    event: str,
    at: float = 1.0,
    skill: str = "make_dumplings.boil",
    cooked: bool | None = None,
    **measured: Any,
) -> dict[str, Any]:
    if cooked is not None:
        measured = {**(COOKED if cooked else WRAPPED), **measured}
    finished = {"finished": True} if event == "skill-ended" else {}
    return {"event": event, "time": at, "skill": skill, **finished, "measured": {**HERE, **measured}}


BOILED = [log_line("skill-began", cooked=False), log_line("skill-ended", cooked=True)]
