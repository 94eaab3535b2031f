from aeros.perception import Perception, View


def see(view: View) -> Perception:
    while True:
        grey = view.pictures["overhead"].rgb.mean(axis=2)
        view = yield {"dial_green": bool(grey.max() > 200)}
