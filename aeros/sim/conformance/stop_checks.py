"""Checks of how motions end before their time: a rule is named, one is halted, everything is stopped."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise
from math import dist
from typing import Any

from aeros.runtime.ports import Completion, Motion, Plant
from aeros.sim.conformance.plant_under_test import (
    PATIENCE,
    RULE,
    ConformanceError,
    Subject,
    Watch,
    begun,
    ended,
    require,
    unchanged,
    values_of,
)

_SOON = 0.3
"""When what moves is interrupted, s after its beginning: by then it moves."""


def a_rule_named_at_once_keeps_everything_where_it_is(subject: Subject) -> None:
    """A rule that is named before the first tick: everything has ended, and nothing has moved."""
    with subject.plant() as plant:
        before = values_of(plant.observe())
        motions = [begun(plant, subject.moving), begun(plant, subject.beside)]
        _all_ended(plant.advance(Watch(names=plant.now()), plant.now() + PATIENCE), motions)
        unchanged(subject, before, values_of(plant.observe()), "a rule was named before anything moved, and")
        _over_for_good(subject, plant)


def a_named_rule_ends_everything_within_one_tick(subject: Subject) -> None:
    """A rule that is named on the way: the monitor is not asked again, and everything comes to rest at once.

    Not sooner than the joints' limits allow, either.
    """
    with subject.plant() as plant:
        motions = [begun(plant, subject.moving), begun(plant, subject.beside)]
        # Without ticks time passes at the end of a motion alone: its second look is on the way.
        watch = Watch(names=plant.now() + (_SOON if subject.period else 0.0), passing=1)
        over = plant.advance(watch, plant.now() + PATIENCE)
        _all_ended(over, motions)
        named = [time for time, _ in watch.seen[1:] if time >= watch.names]
        require(len(named) == 1, f"after a rule was named the monitor was asked {len(named) - 1} times more")
        took = plant.now() - named[0]
        require(took <= subject.stops_within + 2 * subject.tick, f"coming to rest took {took:.3f} s")
        _came_to_rest(subject, watch, values_of(plant.observe()))
        _over_for_good(subject, plant)


def a_halted_motion_comes_to_rest_while_others_go_on(subject: Subject) -> None:
    """`halt` between two calls of `advance` brings that motion to rest, and the other to its own end."""

    def halting(plant: Plant, motion: Motion, watch: Watch) -> Mapping[Motion, Completion]:
        require(plant.advance(watch, plant.now() + _SOON) == {}, "something ended before it was halted")
        plant.halt(motion)
        return {}

    _halted(subject, halting)


def the_monitor_may_halt_a_motion(subject: Subject) -> None:
    """`halt` from inside `advance`, by the monitor, does just the same."""

    def halting(plant: Plant, motion: Motion, watch: Watch) -> Mapping[Motion, Completion]:
        halts_at, is_halted = plant.now() + (_SOON if subject.period else 0.0), False

        def monitor(now: float, values: Mapping[str, Any]) -> str | None:
            nonlocal is_halted
            if now >= halts_at and not is_halted:
                is_halted = True
                plant.halt(motion)
            return watch(now, values) if now <= halts_at else None

        try:
            return plant.advance(monitor, plant.now() + PATIENCE)
        except Exception as error:
            raise ConformanceError(f"it raises {error!r} where the monitor halts a motion") from error

    _halted(subject, halting)


def _halted(subject: Subject, halting: Callable[[Plant, Motion, Watch], Mapping[Motion, Completion]]) -> None:
    with subject.plant() as plant:
        moving, beside = begun(plant, subject.moving), begun(plant, subject.beside)
        watch, since = Watch(), plant.now()
        over = halting(plant, moving, watch) or plant.advance(Watch(), plant.now() + PATIENCE)
        require(set(over) == {moving}, f"one motion was halted, and ended were {sorted(over)}")
        how, took = over[moving], plant.now() - since
        require(not how.completed and bool(how.reason), f"a halted motion ended with {how}")
        require(not str(how.reason).startswith("monitor:"), f"halted, but in the monitor's name: {how}")
        require(
            took <= _SOON + subject.stops_within + 2 * subject.tick,
            f"coming to rest took {took - _SOON:.3f} s",
        )
        _came_to_rest(subject, watch, values_of(plant.observe()))
        require(ended(plant, beside, Watch()).completed, "what went on beside it is not completed")


def stop_ends_everything(subject: Subject) -> None:
    """After `stop` everything is at rest, what was under way is not told of again, and new motions begin."""
    with subject.plant() as plant:
        motions = [begun(plant, subject.moving), begun(plant, subject.beside)]
        watch = Watch()
        require(plant.advance(watch, plant.now() + _SOON) == {}, f"one of {motions} ended too soon")
        since = plant.now()
        plant.stop()
        took = plant.now() - since
        require(took <= subject.stops_within + 2 * subject.tick, f"coming to rest took {took:.3f} s")
        _came_to_rest(subject, watch, values_of(plant.observe()))
        _over_for_good(subject, plant)


def closing_twice_is_closing_once(subject: Subject) -> None:
    """`close` may be called again, also with something under way."""
    plant = subject.make()
    try:
        begun(plant, subject.moving)
    finally:
        plant.close()
    try:
        plant.close()
    except Exception as error:
        raise ConformanceError(f"closing it twice makes it raise {error!r}") from error


def _all_ended(over: Mapping[Motion, Completion], motions: list[Motion]) -> None:
    require(set(over) == set(motions), f"a rule was named: of {motions}, {sorted(over)} have ended")
    for how in over.values():
        require(how == Completion(False, f"monitor:{RULE}"), f"a rule was named, and one ended with {how}")


def _over_for_good(subject: Subject, plant: Plant) -> None:
    """Nothing goes on by itself; what is begun now goes its own way."""
    before = values_of(plant.observe())
    new = begun(plant, subject.beside)
    over = plant.advance(Watch(), plant.now() + PATIENCE)
    require(over == {new: Completion(True)}, f"{new} was begun after all had ended; ended were {over}")
    unchanged(subject, before, values_of(plant.observe()), "after everything came to rest")


def _came_to_rest(subject: Subject, watch: Watch, after: Mapping[str, Any]) -> None:
    """From the speeds last seen joints and base went as far as coming to rest within limits takes, or so.

    Braking evenly within `stops_within`, v·T/2, and two ticks until it begins; at least v²/2a.
    """
    if subject.period is None:
        return
    if subject.deceleration:
        (before, last), rest = list(pairwise(watch.of(subject.joints)))[-1], after[subject.joints]
        speeds = [(b - a) / subject.period for a, b in zip(before, last, strict=True)]
        require(dist(speeds, [0.0] * len(speeds)) > 0.0, "nothing moved when it was to come to rest")
        for v, a, was, now in zip(speeds, subject.deceleration, last, rest, strict=True):
            way = (now - was) * (1.0 if v > 0.0 else -1.0)
            _braked(subject, abs(v), a, way, "a joint", "rad")
    if subject.base_deceleration:
        (before, last), rest = list(pairwise(watch.of(subject.base)))[-1], after[subject.base]
        speed = dist(before, last) / subject.period
        require(speed > 0.0, "the base did not move when it was to come to rest")
        _braked(subject, speed, subject.base_deceleration, dist(last, rest), "the base", "m")


def _braked(subject: Subject, v: float, a: float, way: float, what: str, unit: str) -> None:
    assert subject.period is not None  # noqa: S101  for the type checker
    most = v * (subject.stops_within / 2.0 + 2.0 * subject.period) + subject.follows_within
    least = v * v / (2.0 * a) - subject.follows_within
    require(way <= most, f"coming to rest, {what} went on by {way:.4f} {unit}; {most:.4f} would be enough")
    require(way >= least - 1e-9, f"coming to rest within limits takes {least:.4f} {unit}; it took {way:.4f}")
