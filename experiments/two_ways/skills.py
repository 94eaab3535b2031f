"""Two ways to the station, if the survey says where that is."""

from aeros.skill import Inputs, Observation, SkillBody, act

SPEED = 0.48
"""Peak speed of the base, m/s."""

DETOUR_OFFSET = 0.3
"""Distance between the station and the detour, m."""

SURVEY_WAIT_S = 0.4
"""Time that the survey has to answer, s; measurements older than 0.2 s have expired by then."""


def direct(observed: Observation, inputs: Inputs) -> SkillBody:
    """Drive straight to the station."""
    observed = yield act("wait", duration=SURVEY_WAIT_S)
    if "station_survey" in observed:
        x, y, _ = observed["station_survey"]
        yield act("move_base", x=x, y=y, speed=SPEED)


def around(observed: Observation, inputs: Inputs) -> SkillBody:
    """Drive to the station from beside it."""
    observed = yield act("wait", duration=SURVEY_WAIT_S)
    if "station_survey" in observed:
        x, y, _ = observed["station_survey"]
        yield act("move_base", x=x, y=y - DETOUR_OFFSET, speed=SPEED)
        yield act("move_base", x=x, y=y, speed=SPEED)
