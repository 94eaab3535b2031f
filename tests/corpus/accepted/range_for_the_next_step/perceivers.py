from aeros.perception import Perception, View, estimate


def see(view: View) -> Perception:
    while True:
        yield {"sponge_position": estimate((0.0, 0.0, 0.0), 0.001)}
