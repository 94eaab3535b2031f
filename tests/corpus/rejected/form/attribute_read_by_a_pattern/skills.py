from aeros.skill import Inputs, Observation, SkillBody, act


def tidy(observed: Observation, inputs: Inputs) -> SkillBody:
    match tidy:
        case object(__globals__=inside):
            yield act("wait", duration=float(len(inside)))
