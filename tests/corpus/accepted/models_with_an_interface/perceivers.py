from aeros.perception import Perception, View, estimate
from aeros.skill import ModelError, Models


def see(view: View, models: Models) -> Perception:
    while True:
        brightness = float(view.pictures["overhead"].rgb.mean())
        try:
            height = estimate(models["tent"].run(x=(brightness / 100,))["y"][0], 0.05)
        except ModelError:
            height = None
        view = yield {"height": height}
