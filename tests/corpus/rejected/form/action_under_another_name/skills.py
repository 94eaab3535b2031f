from aeros.skill import Action, Inputs, Observation, SkillBody

Request = Action


def tidy(observed: Observation, inputs: Inputs) -> SkillBody:
    yield Request("move", {})
