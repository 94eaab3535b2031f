from aeros.skill import SkillBody, act

from .measures import PACE


def draw_near() -> SkillBody:
    yield act("approach", pace=PACE)
