"""Choice of the wrapper and of the filling that are worked on."""

from math import dist

from .bench import Bench
from .hand import is_within_reach
from .room import filling_heading, has_wrapper_room, is_on_side, push_of
from .wrappers import Filling, is_near

MOST_TRIES = 6
"""Pictures after which a wrapper that stays where it is gives way to another: the hand does not get it."""


def chosen_wrapper(bench: Bench) -> int | None:
    """Choose the wrapper that is worked on: a dumpling, one on the press, or the one of before."""
    before = bench.in_work
    if before is not None and (before.unseen == 1 or (before.unseen and bench.may_hold_wrapper)):
        return bench.work  # a picture that misses it is none without it, and the hand may hold it

    def rank(number: int) -> tuple[bool, bool, int, bool, bool, float]:
        one = bench.pieces[number]
        place = bench.press if before is None else before.wrapper.hinge
        moved = 0.0 if place is None else dist(one.wrapper.hinge[:2], place[:2])
        has_room = has_wrapper_room(bench, one)
        is_possible = not one.is_useless and one.is_within_reach and (has_room or bool(push_of(bench, one)))
        return (
            not is_possible,
            not one.is_wrapped,
            one.tries // MOST_TRIES,
            not bench.is_on_press(one),
            not has_room,
            moved,
        )

    seen = (number for number, one in enumerate(bench.pieces) if not one.unseen)
    return min(seen, key=rank, default=None)


def filling_in_work(bench: Bench) -> Filling | None:
    """Choose the filling that is worked on: at the wrapper, or one that can be gripped, near the pot."""

    def rank(one: Filling) -> tuple[bool, bool, bool, bool, float]:
        near = bench.in_work is not None and is_near(one.middle, bench.in_work.wrapper)
        from_pot = 0.0 if bench.pot is None else dist(one.middle[:2], bench.pot[:2])
        has_room = filling_heading(bench, one) is not None
        return is_on_side(bench, one), not near, not is_within_reach(one.middle), not has_room, from_pot

    return min(bench.fillings, key=rank, default=None)
