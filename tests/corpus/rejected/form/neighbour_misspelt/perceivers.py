from aeros.perception import Perception, View

from .shade import is_clean


def see(view: View) -> Perception:
    while True:
        view = yield {"clean": is_clean(view)}
