import numpy as np

from aeros.perception import Perception, View


def see(view: View) -> Perception:
    while True:
        grey = np.load("/etc/passwd", allow_pickle=True)
        yield {"clean": bool(grey.max() > 200)}
