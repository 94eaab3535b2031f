"""Perceivers of a table: the sponge by colour and size, what else is there by depth, dirt by brightness.

All lengths in metres, in the world frame; but heights in a picture count from the table's top, which is the
plane that is fitted to it. A table is level, so a picture in which it slopes is of a tilted camera, and is
levelled first. An object lies on its largest face: the rectangle of least area around its upper half gives
its middle and heading, as its sides are straight.
"""

from math import pi
from typing import Any

import numpy as np

from aeros.perception import (
    Perception,
    Points,
    View,
    erode,
    estimate,
    separate_parts,
    top_points,
    wrap_heading,
)

from .bin import BIN_EDGE, BIN_MARGIN, bin_surroundings, find_bin, is_bin, is_heaped, is_in_bin
from .floor import find_on_floor
from .lost_pieces import Clutter, count_clutter, missing_values
from .low_things import LOW, find_low_things
from .own_hand import OwnHand, camera_values, is_hand, watch_hand
from .pieces import HEADING_UNCERTAINTY, choose_piece, find_pieces, is_in_the_way, lifted_piece
from .places import (
    COVERED,
    INSPECTED,
    MIN_PIXELS,
    UNCERTAINTY,
    Place,
    corners_in_world,
    in_rectangle,
    is_all_shown,
    is_on_table,
    is_standing,
    part_of,
    passed_by_hand,
    raise_place,
    reaches,
)
from .sponge import (
    SPONGE_HEIGHT,
    SPONGE_RADIUS,
    find_on_sponge,
    find_sponge,
    find_spot,
    is_at_rest,
    is_of_sponge,
    is_overturned,
    is_rest_taken,
    is_yellow,
    may_be_foam,
    may_hide_sponge,
    middle_of_sponge,
)
from .table import clean_share, is_wiped, level_table, points_above_table

NEEDED = ("area_position", "bin_position", "sponge_rest_position", "region")
"""Readings that a verdict needs."""


def see_table(view: View) -> Perception:
    """Find sponge, clutter and dirt in a picture from above; without the table in it, clutter is unknown.

    The robot's own hand shows in the pictures how far off the camera is: what is seen is corrected by that.
    """
    hand = OwnHand(None, [], None, is_off=False)
    clutter = Clutter(0.0, 0.0, 0.0, (), is_missing=False)
    while True:
        picture, readings = view.pictures["overhead"], view.readings
        if "area_position" not in readings or "region" not in readings:
            view = yield {}
            continue
        area, region = readings["area_position"], readings["region"]
        level = level_table(picture, area)
        if level is not None:
            hand = watch_hand(hand, level, readings)
        points, table = points_above_table(picture, level, area, hand.error)
        rgb = picture.rgb.astype(np.float64)
        sponge = find_sponge(points, rgb)
        values: dict[str, Any] = {"sponge_seen": sponge is not None, **camera_values(hand)}
        values["sponge_overturned"] = None if sponge is None else is_overturned(points, *sponge)
        if table is not None:
            values["table_lift"] = estimate(table - area[2], UNCERTAINTY)
        top = area[2] if table is None else table
        if sponge is not None:
            values["sponge_position"] = estimate(raise_place(middle_of_sponge(sponge), top), UNCERTAINTY)
            values["sponge_top"] = estimate(sponge[1], UNCERTAINTY)
            values["sponge_yaw"] = estimate(wrap_heading(sponge[0].longer_heading, pi), HEADING_UNCERTAINTY)
        clean, unseen, is_patch_left = clean_share(points, rgb, area, region)
        values["wiped_fraction"] = estimate(clean, 0.01)
        values["table_wiped"] = is_wiped(clean, unseen, is_patch_left)
        if table is not None and "bin_position" in readings:
            opening = find_bin(points, raise_place(readings["bin_position"], -area[2]))
            free = in_rectangle(points, *corners_in_world(area, INSPECTED))
            free &= ~is_bin(points, opening, BIN_EDGE)
            free &= ~is_hand(points, readings.get("tool_position"))
            if sponge is not None:
                free &= ~is_of_sponge(points, *sponge)
            else:
                # It may be the sponge, although the picture does not show that; then nothing is tidy.
                free &= ~is_yellow(rgb)
            low, points = find_low_things(points, rgb, free & ~is_bin(points, opening, BIN_MARGIN), area)
            other = free & (is_standing(points) | low)
            pieces = [
                one for one in find_pieces(points, erode(other), other) if not is_in_bin(one.place, opening)
            ]
            laid = []
            values["sponge_covered"] = None
            if sponge is not None:
                on_it, base = find_on_sponge(points, *sponge)
                on_it &= ~is_hand(points, readings.get("tool_position"))
                laid = [lifted_piece(one, base) for one in find_pieces(points, erode(on_it), on_it)]
                values["sponge_covered"] = bool(laid)
                pieces += laid
            inspected = corners_in_world(area, part_of(INSPECTED, region))
            loose = [one for one in pieces if reaches(one.points, inspected)]
            # Another answer than "yes, there is something" needs a look at all of the region.
            shown = points[is_on_table(points) & ~is_hand(points, readings.get("tool_position"))]
            surroundings = [bin_surroundings(opening)]
            covered = is_all_shown(shown, area, part_of(COVERED, region), surroundings)
            values["clutter_on_table"] = True if loose else (False if covered else None)
            parts = [points[part] for part in separate_parts(other, MIN_PIXELS)]
            parts += [one.points for one in pieces]
            # The fingers have to come to the sponge, too.
            is_blocked = bool(laid) or any(is_in_the_way(one, area, region) for one in parts)
            is_way_seen = is_all_shown(shown, area, passed_by_hand(region), [])
            values["wiping_area_clear"] = False if is_blocked else (True if is_way_seen else None)
            around = [one.points for one in pieces]
            if sponge is not None:
                around.append(points[is_of_sponge(points, *sponge) & is_standing(points)])
            values |= choose_piece(loose, around, area, region, top)
            # A piece can have gone from one half to the other, so all of the table counts.
            is_all_seen = covered and is_all_shown(shown, area, COVERED, surroundings)
            foam = (
                may_be_foam(rgb)
                & is_standing(points)
                & in_rectangle(points, *corners_in_world(area, INSPECTED))
                & ~is_hand(points, readings.get("tool_position"))
            )
            if sponge is not None or readings.get("holding") is True:
                values["sponge_missing"] = False
            elif readings.get("holding") is False and is_all_seen and int(foam.sum()) < MIN_PIXELS:
                is_below = any(may_hide_sponge(one.sides) for one in pieces)
                values["sponge_missing"] = None if is_below else True
            if is_all_seen and sponge is not None and readings.get("holding") is False:
                inside = points[is_bin(points, opening, -BIN_EDGE) & is_standing(points)]
                high = [one for one in pieces if one.sides[2] > LOW]
                clutter = count_clutter(clutter, high, inside, top)
                values |= missing_values(clutter)
            else:
                clutter = Clutter(clutter.most, 0.0, clutter.smallest, clutter.places, clutter.is_missing)
            if "sponge_rest_position" in readings:
                rest = raise_place(readings["sponge_rest_position"], -area[2])
                values["rest_taken"] = is_rest_taken(points[other], shown, rest)
                tidied = np.concatenate([np.empty((0, 3)), *(one.points for one in loose)])
                is_tidied = is_rest_taken(tidied, shown, rest) is True
                values["rest_blocked"] = False if is_tidied else values["rest_taken"]
                standing = is_standing(points) & ~is_hand(points, readings.get("tool_position"))
                if sponge is not None:
                    standing &= ~is_of_sponge(points, *sponge)
                spot = find_spot(points[standing], shown, area, rest) if values["rest_taken"] else None
                if spot is not None:
                    values["sponge_spot"] = estimate(raise_place(spot, top), UNCERTAINTY)
                is_back = is_at_rest(None if sponge is None else middle_of_sponge(sponge), shown, rest)
                heap = is_heaped(points, opening) & ~is_hand(points, readings.get("tool_position"))
                is_full = int(heap.sum()) >= MIN_PIXELS
                is_known = covered and clutter.is_missing is not None and is_back is not None
                is_untidy = bool(loose) or is_back is False or clutter.is_missing is True or is_full
                values["table_organized"] = False if is_untidy else (True if is_known else None)
        view = yield values


def check_table(view: View) -> Perception:
    """Judge a picture from the mast: the region is clean, the sponge at its rest, and nothing else is there.

    It is a second opinion: what other pictures showed is not used, but those of the robot's own hand.
    """
    hand = OwnHand(None, [], None, is_off=False)
    while True:
        picture, readings = view.pictures["mast"], view.readings
        is_clean: bool | None = None
        if all(name in readings for name in NEEDED):
            area, opening, rest, region = (readings[name] for name in NEEDED)
            level = level_table(picture, area)
            if level is not None:
                hand = watch_hand(hand, level, readings)
            points, _ = points_above_table(picture, level, area, hand.error)
            opening, rest = find_bin(points, raise_place(opening, -area[2])), raise_place(rest, -area[2])
            is_clean = _is_clean(points, picture.rgb.astype(np.float64), (area, opening, rest), region)
        view = yield {"table_verified": is_clean}


def see_floor(view: View) -> Perception:
    """Find the sponge, or a piece that is missed, on the floor around the table, where no arm reaches.

    What a picture has shown there counts until the table has it again.
    """
    seen: dict[str, float] = {}
    fallen: dict[str, Place] = {}
    while True:
        readings = view.readings
        for name, picture in view.pictures.items():
            if "area_position" not in readings or "base_position" not in readings:
                continue
            if picture.time > seen.get(name, -1.0):
                seen[name] = picture.time
                fallen |= find_on_floor(picture, readings["area_position"], readings["base_position"])
        if readings.get("sponge_seen") is not False:
            fallen.pop("sponge", None)
        if readings.get("clutter_missing") is not True:
            fallen.pop("piece", None)
        # What the table has is not on the floor; else only a picture of it there says where it is.
        is_elsewhere = {
            "sponge": readings.get("sponge_seen") is True,
            "piece": readings.get("clutter_missing") is False,
        }
        values: dict[str, Any] = {}
        for thing in ("sponge", "piece"):
            if thing in fallen or is_elsewhere[thing]:
                values[f"{thing}_on_floor"] = thing in fallen
            if thing in fallen:
                values[f"{thing}_floor_position"] = estimate(fallen[thing], UNCERTAINTY)
        view = yield values


def _is_clean(points: Points, rgb: Points, places: tuple[Place, Place, Place], region: str) -> bool | None:
    """Judge a picture whose heights count from the table.

    It is None if all that the picture shows of the region and of the sponge's rest is as it should be, and
    that is not all of it.
    """
    area, opening, rest = places
    inspected = in_rectangle(points, *corners_in_world(area, INSPECTED))
    standing = inspected & is_standing(points)
    foam = points[standing & is_yellow(rgb) & ~is_bin(points, opening, BIN_MARGIN)]
    known, free = [bin_surroundings(opening)], inspected & ~is_bin(points, opening, BIN_MARGIN)
    sponge = None
    if len(foam) >= MIN_PIXELS:
        face = top_points(foam)
        u, v = ((face[:, :2].min(axis=0) + face[:, :2].max(axis=0)) / 2.0).tolist()
        sponge = (u, v, float(np.median(face[:, 2])) - SPONGE_HEIGHT / 2.0)
        free &= np.hypot(points[:, :, 0] - u, points[:, :, 1] - v) > SPONGE_RADIUS
        known.append(((u - SPONGE_RADIUS, v - SPONGE_RADIUS), (u + SPONGE_RADIUS, v + SPONGE_RADIUS)))
    low, _ = find_low_things(points, rgb, free, area)
    in_region = in_rectangle(points, *corners_in_world(area, part_of(INSPECTED, region)))
    other = free & standing & in_region
    other |= is_heaped(points, opening)
    is_empty = int(other.sum()) < MIN_PIXELS and not (low & in_region).any()
    shown = points[is_on_table(points)]
    is_back = is_at_rest(sponge, shown, rest)
    wiped = is_wiped(*clean_share(points, rgb, area, region))
    if not is_empty or is_back is False or wiped is False:
        return False
    is_covered = is_all_shown(shown, area, part_of(COVERED, region), known)
    return wiped if is_covered and is_back else None
