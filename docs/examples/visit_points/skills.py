"""Skills of `visit_points`: generators that yield actions and receive the measurements after each.

SI units. Positions are relative to the arm's base; the tool points down.
"""

from aeros.skill import Inputs, Observation, SkillBody, act

POINTS = ((0.40, 0.15, 0.40), (0.40, -0.15, 0.40), (0.45, 0.0, 0.30), (0.40, 0.0, 0.40))
"""Points to visit, m; the last is home."""

SPEED = 0.1
"""Peak speed, m/s."""


def visit(observed: Observation, inputs: Inputs) -> SkillBody:
    """Go to each point in turn."""
    base = observed["base_position"]
    for point in POINTS:
        target = tuple(a + b for a, b in zip(base, point, strict=True))
        yield act("move_tool", target=target, yaw=0.0, speed=SPEED)
