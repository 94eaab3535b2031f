from aeros.perception import Perception, View


def see(view: View) -> Perception:
    while True:
        grey = view.pictures["underneath"].rgb.mean(axis=2)
        view = yield {"clean": bool(grey.max() > 200)}
