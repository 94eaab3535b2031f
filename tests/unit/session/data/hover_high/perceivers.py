"""Say that there is a picture of the area."""

from aeros.perception import Perception, View


def see(view: View) -> Perception:
    """Measure that the camera named `eye` took a picture, and that the hand is known."""
    while True:
        view = yield {"area_seen": "eye" in view.pictures and "hand_at" in view.readings}
