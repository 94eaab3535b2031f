from aeros.skill import Inputs, Observation, SkillBody, act


def tidy(observed: Observation, inputs: Inputs) -> SkillBody:
    if not observed["table_tidi"]:
        yield act("wait", duration=2.0)
