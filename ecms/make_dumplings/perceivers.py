"""State of the dumplings: wrappers and fillings in pictures, and the force of the press on what is in it.

One wrapper is worked on at a time: one in the pot that is not cooked yet, else one on the press, else any.
Cooked dumplings stay in the pot and are counted.

A plate of the wrapper is the plane through its points and the rectangle around them: plates are told apart
by their colour, and the fold is the angle of their planes. From the side, what shows between the plates is in
the dumpling. All lengths in metres, angles in radians, in the world frame; the bench is level, so a picture
in which it slopes is of a tilted camera, and is levelled first.
"""

from typing import Any

from aeros.perception import Perception, View, estimate

from .bench import Bench
from .following import seen_from_above, seen_from_side, with_press
from .measures import UNCERTAINTY
from .values import values_of

UNSEEN = (
    "filling_position",
    "filling_yaw",
    "filling_has_room",
    "filling_free_across",
    "other_filling_position",
    "wrapper_position",
    "wrapper_yaw",
    "wrapper_fold",
    "wrapper_has_room",
    "other_wrapper_position",
    "press_free",
    "blocker_position",
    "blocker_yaw",
    "blocker_is_filling",
    "aside_place",
    "pot_place",
    "pot_covered",
    "press_covered",
    "place_covered",
    "covered_place",
    "push_start",
    "push_end",
    "push_yaw",
    "wrappers_suffice",
    "fillings_suffice",
    "bench_hidden",
    "hidden_place",
    "dough_on_workspace",
    "filling_on_workspace",
    "wrapper_aligned",
)
"""Variables that are unknown where the last picture from above does not show what they are of."""


GONE = ("dough_on_workspace", "filling_on_workspace", "wrapper_aligned", "dumpling_wrapped")
"""Variables that are false once the last dumpling is in the pot."""


EMPTY = ("dough_on_workspace", "filling_on_workspace", "wrapper_aligned")
"""Variables that are false once the wrapper on the press is found to be shut without a filling."""


def see_dumpling(view: View) -> Perception:
    """Follow the dumplings: what pictures show now, and what they and the press have shown before.

    A picture from the side decides if the wrapper that was seen from above is a dumpling. A wrapper that is
    seen open is none any more, and neither is a closed one when all fillings are seen elsewhere. A dumpling
    that two pictures show at one place in the pot, long enough apart, is cooked; then the work on the next
    wrapper begins. A wrapper that no hand can make a dumpling of is not worked on while there is another.
    """
    bench = Bench()
    known: dict[str, Any] = {}
    seen: dict[str, float] = {}
    while True:
        bench = with_press(bench, view)
        for name in ("overhead", "side"):
            picture = view.pictures.get(name)
            if picture is None or picture.time <= seen.get(name, -1.0):
                continue
            seen[name] = picture.time
            if name == "side":
                bench = seen_from_side(bench, picture)
                piece = bench.in_work
                if piece is None:
                    continue
                known["dumpling_wrapped"] = estimate(piece.is_wrapped, time=picture.time)
                if piece.is_shut:
                    known |= {one: estimate(False, time=picture.time) for one in EMPTY}
                continue
            press, pot = (view.readings.get(one) for one in ("press_position", "pot_position"))
            cooked = len(bench.settled)
            shown = seen_from_above(bench, picture, press, pot)
            known |= dict.fromkeys(UNSEEN)
            if not shown.is_shown:
                continue  # a picture without the bench tells nothing of what is there
            bench = shown
            found = values_of(bench) | {
                "dumpling_cooked": (bool(bench.settled),),
                "dumplings_cooked": (len(bench.settled),),
            }
            found["bench_lift"] = (bench.lift, UNCERTAINTY)
            if bench.work is None and bench.pieces:
                found["dumpling_wrapped"] = (False,)  # a dumpling that two pictures miss is none to work with
            if bench.work is None and len(bench.settled) > cooked:
                # What was in the press is in the pot.
                found |= dict.fromkeys(GONE, (False,))
            known |= {one: estimate(*value, time=picture.time) for one, value in found.items()}
        view = yield known.copy()
