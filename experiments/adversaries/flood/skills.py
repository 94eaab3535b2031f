"""Works the gripper without a pause."""

from aeros.skill import Inputs, Observation, SkillBody, act


def rattle(observed: Observation, inputs: Inputs) -> SkillBody:
    """Open and close the fingers, again and again."""
    for turn in range(120):
        yield act("grip", width=0.06 + 0.01 * (turn % 2), force=10.0)
