"""Two skills that are safe one by one."""

from aeros.skill import Inputs, Observation, SkillBody, act


def reach(observed: Observation, inputs: Inputs) -> SkillBody:
    """Reach ahead."""
    x, y, z = observed["base_position"]
    yield act("move_tool", target=(x + 0.6, y, z + 0.35), yaw=0.0, speed=0.19)


def drive(observed: Observation, inputs: Inputs) -> SkillBody:
    """Drive ahead."""
    yield act("move_base", x=0.0, y=0.3, speed=0.1)
