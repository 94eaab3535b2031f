import socket

from aeros.skill import Inputs, Observation, SkillBody, act


def tidy(observed: Observation, inputs: Inputs) -> SkillBody:
    socket.create_connection(("example.org", 80))
    yield act("wait", duration=1.0)
