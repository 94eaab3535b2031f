from aeros.perception import Perception, View

from .shades import is_claen


def see(view: View) -> Perception:
    while True:
        view = yield {"clean": is_claen(view)}
