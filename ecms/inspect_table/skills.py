"""Inspecting a table: look from above while the hand opens, then from the mast with the arm drawn in.

All lengths in metres, in the world frame; at yaw 0 the fingers close along y.
"""

from collections.abc import Generator

from aeros.skill import Action, Inputs, Observation, SkillBody, act

Task = Generator[Action, Observation, Observation]

CARRY_SPEED = 0.29
"""Peak speed of a hand that may hold something, m/s, if no hand has to be slower."""

TRAVEL_HEIGHT = 0.20
"""Height of sideways motion, m: what is carried clears the bin (0.085 m)."""

OPEN = 0.08
"""Fingers wide open, m."""

GRIP_FORCE = 10.0
"""N."""

DRAWN_IN = (0.30, 0.0)
"""Place of the tool that does not hide the table from the cameras, from the arm's base, m."""

LOW, HIGH = 0.40, 0.45
"""Heights of the tool there, m: over an empty table, and over one on which something lies or may lie."""

PATIENCE = 40
"""Number of waits of 0.25 s for a reading that is missing or too old."""


def glance(observed: Observation, inputs: Inputs) -> SkillBody:
    """Look from above, and say how high the arm has to be to hide nothing."""
    observed = yield act("look", camera="overhead")
    empty = observed.get("clean_table.clutter_on_table") is False
    return {"height": LOW if empty else HIGH}


def open_hand(observed: Observation, inputs: Inputs) -> SkillBody:
    """Open the hand, which holds nothing."""
    yield act("grip", width=OPEN, force=GRIP_FORCE)


def stand_still(observed: Observation, inputs: Inputs) -> SkillBody:
    """Keep what is held."""
    yield act("wait", duration=0.25)


def inspect(observed: Observation, inputs: Inputs) -> SkillBody:
    """Bring the tool out of the cameras' sight, over everything that stands on the table, and look."""
    yield from _draw_in(observed, inputs)
    yield act("look", camera="mast")


def survey(observed: Observation, inputs: Inputs) -> SkillBody:
    """Bring the tool out of the cameras' sight, as `inspect` does, and look from above and from the mast."""
    yield from _draw_in(observed, inputs)
    yield act("look", camera="overhead")
    yield act("look", camera="mast")


def _draw_in(observed: Observation, inputs: Inputs) -> Task:
    """Bring the tool to where it hides nothing; first up, over everything that stands on the table."""
    observed = yield from _sense(observed, "tool_position", "base_position")
    x, y, z = observed["tool_position"]
    pace = inputs["hand_speed"]
    speed = pace if observed.get("holding") is False else min(CARRY_SPEED, pace)
    if z < TRAVEL_HEIGHT - 0.005:
        yield act("move_tool", target=(x, y, TRAVEL_HEIGHT), yaw=0.0, speed=speed)
    u, v, base = observed["base_position"]
    target = (u + DRAWN_IN[0], v + DRAWN_IN[1], base + inputs["height"])
    return (yield act("move_tool", target=target, yaw=0.0, speed=speed))


def _sense(observed: Observation, *names: str) -> Task:
    """Wait until all of `names` are observed; a name that stays unknown ends the skill where it is read."""
    for _ in range(PATIENCE):
        if all(name in observed for name in names):
            break
        observed = yield act("wait", duration=0.25)
    return observed
