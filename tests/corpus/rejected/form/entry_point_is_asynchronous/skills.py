from collections.abc import AsyncGenerator

from aeros.skill import Action, Inputs, Observation, act


async def tidy(observed: Observation, inputs: Inputs) -> AsyncGenerator[Action, Observation]:
    yield act("wait", duration=1.0)
