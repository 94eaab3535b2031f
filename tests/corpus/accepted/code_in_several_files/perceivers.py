from aeros.perception import Perception, View

from .shades import Shade


def see(view: View) -> Perception:
    while True:
        view = yield {"clean": Shade(float(view.pictures["overhead"].rgb.min())).is_bright}
