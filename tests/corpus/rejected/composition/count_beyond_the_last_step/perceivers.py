from aeros.perception import Perception, View


def see(view: View) -> Perception:
    while True:
        yield {"racked": 0}
