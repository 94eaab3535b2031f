from collections.abc import Generator

from aeros.perception import View
from aeros.skill import Action, act


def see(view: View) -> Generator[Action, View, None]:
    while True:
        yield act("approach", pace=0.05)
