from aeros.skill import Action, Inputs, Observation, act


def tidy(observed: Observation, inputs: Inputs) -> Action:
    return act("wait", duration=1.0)
