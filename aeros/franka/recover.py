"""Clear a reflex of the robot: `python -m aeros.franka.recover`, after a person has looked why it stopped.

The robot does not move by it. Nothing else of AEROS clears a reflex.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping

from aeros.exit_codes import Exit
from aeros.franka.libfranka import LibfrankaArm
from aeros.franka.settings import ADDRESS
from aeros.wired_arm.arm import MODES, ArmError


def recover(environment: Mapping[str, str]) -> tuple[Exit, str]:
    """Clear the reflex of the robot that the environment names.

    Args:
        environment: of this process.

    Returns:
        The exit code, and what to tell the person.
    """
    address = environment.get(ADDRESS, "").strip()
    if not address:
        return Exit.USAGE, f"no robot is named: set {ADDRESS} to its address"
    try:
        arm = LibfrankaArm(address, real_time=False)
        before = arm.read().mode
        arm.recover()
        after = arm.read().mode
    except ArmError as failure:
        return Exit.REJECTED, str(failure)
    return Exit.SUCCESS, f"the robot's mode was {MODES[before]}, and is {MODES[after]}"


if __name__ == "__main__":
    code, text = recover(os.environ)
    sys.stdout.write(f"{text}\n")
    sys.exit(code)
