from aeros.skill import Inputs, Observation, SkillBody, act


def tidy(observed: Observation, inputs: Inputs) -> SkillBody:
    kind = "wait" if observed["table_tidy"] else "stop"
    yield act(kind)
