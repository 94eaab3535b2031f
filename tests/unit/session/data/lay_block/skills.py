"""Look for the block, and lay it on its spot."""

from aeros.skill import Inputs, Models, Observation, SkillBody, act


def look(observed: Observation, inputs: Inputs) -> SkillBody:
    """Draw the arm aside, and take a picture."""
    yield act("go", target=(0.40, -1.55, 0.40), yaw=0.0, speed=0.18)
    yield act("picture", camera="eye")


def lay(observed: Observation, inputs: Inputs, models: Models) -> SkillBody:
    """Grip the block with the force of the table of numbers, put it on its spot, and look."""
    x, y, z = observed["block_at"]
    yaw = observed["block_yaw"]
    force = models["squeeze"].run(width=0.03)["force"]
    pace = inputs["pace"]
    sx, sy, sz = inputs["spot"]
    yield act("close", width=0.08, force=force)
    yield act("go", target=(x, y, 0.15), yaw=yaw, speed=pace)
    yield act("go", target=(x, y, z + 0.004), yaw=yaw, speed=0.08)
    yield act("close", width=0.01, force=force)
    yield act("go", target=(x, y, 0.12), yaw=yaw, speed=0.15)
    yield act("go", target=(sx, sy, 0.12), yaw=0.0, speed=pace)
    yield act("go", target=(sx, sy, sz + 0.006), yaw=0.0, speed=0.05)
    yield act("close", width=0.08, force=force)
    yield act("go", target=(sx, sy, 0.15), yaw=0.0, speed=0.15)
    yield act("go", target=(0.40, -1.55, 0.40), yaw=0.0, speed=pace)
    yield act("picture", camera="eye")
