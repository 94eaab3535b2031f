from aeros.perception import Perception, View


def see(view: View, inputs: dict[str, float]) -> Perception:
    while True:
        yield {"clean": True}
