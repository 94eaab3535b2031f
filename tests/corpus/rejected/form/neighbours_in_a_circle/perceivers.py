from aeros.perception import Perception, View

from .shades import is_clean


def see(view: View) -> Perception:
    while True:
        view = yield {"clean": is_clean(view)}
