from aeros.perception import Perception, View
from aeros.skill import act


def see(view: View) -> Perception:
    while True:
        yield act("approach", pace=0.05)
