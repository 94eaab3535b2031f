"""Environments of Gymnasium, one for each module; importing this package registers those at hand.

    import gymnasium
    import aeros.gym

    env = gymnasium.make("aeros/MakeTea-v0", plant="mujoco")

A module `make_tea` in the folder `ecms` of the working folder is `aeros/MakeTea-v0`; without that folder,
the modules that come with AEROS count.  `register_modules` registers those of another folder.  An action
chooses a skill, which runs to its end, every action of it decided by the gate.  `docs/how-to/gym.md` has the
spaces, the reward and the keys of `info`.
"""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Final

from aeros.distribution import install_command

try:
    import gymnasium
except ImportError as error:
    raise ImportError(f"aeros.gym needs {install_command('gym')} ({error.name} is missing)") from error

from aeros.gym.environment import TaskEnvironment
from aeros.spec.text.discovery import MANIFEST, reference_modules_path

__all__ = ["MAX_EPISODE_STEPS", "TaskEnvironment", "register_modules"]

MAX_EPISODE_STEPS: Final = 50
"""Skills that an episode has at most; the rules of the shipped tasks need 3 to 7 without faults."""

_OWN: Final = Path("ecms")


def register_modules(folder: str | PathLike[str]) -> list[str]:
    """Register an environment for each module in a folder; nothing of the modules is read before it is made.

    Args:
        folder: a folder of modules, each a folder with a manifest.

    Returns:
        The ids of the environments, sorted: `aeros/MakeTea-v0` for the module `make_tea`.

    Example:
        >>> aeros.gym.register_modules("ecms")[0]
        'aeros/CleanTable-v0'
    """
    found = []
    for manifest in sorted(Path(folder).glob(f"*/{MANIFEST}")):
        name = "".join(part.capitalize() for part in manifest.parent.name.split("_"))
        found.append(f"aeros/{name}-v0")
        arguments = {"modules": str(manifest.parent.resolve())}
        known = gymnasium.registry.get(found[-1])
        if known is None or known.kwargs != arguments:
            gymnasium.register(
                found[-1],
                entry_point="aeros.gym.environment:TaskEnvironment",
                max_episode_steps=MAX_EPISODE_STEPS,
                kwargs=arguments,
            )
    return found


register_modules(_OWN if _OWN.is_dir() else reference_modules_path())
