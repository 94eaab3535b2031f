"""Environments of Gymnasium, one for each shipped task; importing this module registers them.

    import gymnasium
    import aeros.gym

    env = gymnasium.make("aeros/MakeDumplings-v0", modules="ecms/make_dumplings", plant="mujoco")

An action chooses a skill, which runs to its end, every action of it decided by the gate.
`docs/how-to/gym.md` has the spaces, the reward and the keys of `info`.
"""

from __future__ import annotations

from typing import Final

try:
    import gymnasium
except ImportError as error:
    raise ImportError(f"aeros.gym needs `pip install 'aeros-robot[gym]'` ({error.name} is missing)") from error

from aeros.gym.environment import TaskEnvironment

__all__ = ["ENVIRONMENTS", "TaskEnvironment"]

ENVIRONMENTS: Final = {
    "aeros/MakeDumplings-v0": "make_dumplings",
    "aeros/CleanTable-v0": "clean_table",
    "aeros/FetchObject-v0": "fetch_object",
}
"""The module of each environment; its task has the same name."""

MAX_EPISODE_STEPS: Final = 50
"""Skills that an episode has at most; the rules of the tasks need 3 to 7 without faults."""

for _id, _module in ENVIRONMENTS.items():
    gymnasium.register(
        _id,
        entry_point="aeros.gym.environment:TaskEnvironment",
        max_episode_steps=MAX_EPISODE_STEPS,
        kwargs={"modules": f"ecms/{_module}", "instruction": f"{_module}.{_module}"},
    )
