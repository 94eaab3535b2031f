"""A motion that the sweep calls clear is clear at every instant, of barriers and of itself: theorem 14."""

from __future__ import annotations

from typing import Final

from aeros.spec.theorems.module_copies import Mutant
from aeros.spec.theorems.theorem import Theorem
from proofs.lib import kinematic_chain
from proofs.lib.loops import loops_of
from proofs.swept_volume.ball_enclosures import BEZIER, LINKS, SWEEP, ball_obligations
from proofs.swept_volume.link_search import link_obligations as pair_obligations
from proofs.swept_volume.obstacles import OBSTACLES, obstacle_obligations
from proofs.swept_volume.sweep_search import search_obligations

_LOOPS: Final = loops_of(
    "aeros.runtime.motion.bezier",
    "aeros.runtime.motion.swept_volume",
    "aeros.runtime.motion.link_distance",
    "aeros.runtime.motion.obstacle_contact",
    "aeros.runtime.motion.kinematic_bounds",
)

THEOREM = Theorem(
    "if the sweep finds nothing, neither the body nor what it holds meets a barrier, and no link another",
    {
        **ball_obligations(),
        **search_obligations(),
        **pair_obligations(),
        **obstacle_obligations(),
        "loops": _LOOPS,
    },
    (
        Mutant(
            "turns-one-axis-the-other-way",
            "turns",
            kinematic_chain.LINKS,
            "            cct * yx - s * xx + cst * zx,\n"
            "            cct * yy - s * xy + cst * zy,\n"
            "            cct * yz - s * xz + cst * zz,\n",
            "            cct * yx + s * xx + cst * zx,\n"
            "            cct * yy + s * xy + cst * zy,\n"
            "            cct * yz + s * xz + cst * zz,\n",
        ),
        Mutant(
            "forgets-what-the-joints-beyond-do",
            "spread",
            kinematic_chain.KINEMATICS,
            "reaches[k] = off + total",
            "reaches[k] = off",
        ),
        Mutant(
            "forgets-that-the-way-bends",
            "sweep",
            kinematic_chain.KINEMATICS,
            "near += off * r + reach * pairs",
            "near += off * r",
        ),
        Mutant(
            "forgets-what-two-joints-do-together",
            "sweep",
            kinematic_chain.KINEMATICS,
            "w * (before + w / 2.0)",
            "w * (w / 2.0)",
        ),
        Mutant(
            "takes-a-prismatic-joint-for-one-that-moves-nothing-off-its-way",
            "sweep",
            kinematic_chain.KINEMATICS,
            "cx, cy, cz, off, reach = ax, ay, az, 1.0, 1.0",
            "cx, cy, cz, off, reach = ax, ay, az, 0.0, 1.0",
        ),
        Mutant(
            "slides-backwards",
            "slides",
            kinematic_chain.LINKS,
            "e + ct * position, zero",
            "e - ct * position, zero",
        ),
        Mutant(
            "looks-at-one-control-point",
            "chord-of-one",
            BEZIER,
            "max(map(abs, away))",
            "abs(away[1])",
        ),
        Mutant(
            "has-the-second-half-begin-late",
            "part-second",
            BEZIER,
            "(whole, bcd, cd, d)\n\n\ndef remaining_path",
            "(bcd, bcd, cd, d)\n\n\ndef remaining_path",
        ),
        Mutant(
            "forgets-the-slack-of-the-joints",
            "enclosures",
            SWEEP,
            "[w + s for w, s in zip(width, slack, strict=True)]",
            "[w for w, s in zip(width, slack, strict=True)]",
        ),
        Mutant(
            "looks-at-the-start-of-the-way-alone",
            "clear-inside",
            SWEEP,
            "(x - ex, x + wx + ex)",
            "(x - ex, x + ex)",
        ),
        Mutant(
            "looks-at-the-first-half-of-the-way-alone",
            "clear-outside",
            SWEEP,
            "        and is_clear(box, middle, edges, half, room)\n",
            "",
        ),
        Mutant(
            "searches-the-first-half-alone",
            "search",
            SWEEP,
            " or self.search(second, middle, high, left, depth)",
            "",
        ),
        Mutant(
            "has-the-base-stand-still-where-it-keeps-no-step",
            "search-of-two",
            SWEEP,
            "            return base, way\n",
            "            return base, _NO_DISPLACEMENT\n",
        ),
        Mutant(
            "forgets-the-clearance",
            "breach",
            SWEEP,
            "_SweepSearch(moving, clearance + ROUNDING)",
            "_SweepSearch(moving, ROUNDING)",
        ),
        Mutant(
            "looks-at-one-path",
            "breach",
            SWEEP,
            "    for path in moving.paths:\n        breach",
            "    for path in moving.paths[:1]:\n        breach",
        ),
        Mutant(
            "forgets-what-is-held",
            "breach",
            SWEEP,
            "*([moving.held] if moving.held else [])",
            "",
        ),
        Mutant(
            "encloses-the-middles-of-the-corners-alone",
            "box",
            SWEEP,
            "p.centre[axis] - p.edges[axis]",
            "p.centre[axis]",
        ),
        Mutant(
            "forgets-how-far-corners-get-from-the-way",
            "separation",
            LINKS,
            " - length * radius",
            "",
        ),
        Mutant(
            "compares-the-corners-without-the-outer-radius",
            "gap",
            LINKS,
            "reach = room + inner.radius + outer.radius",
            "reach = room + inner.radius",
        ),
        Mutant(
            "takes-all-joints-to-stand",
            "standing",
            LINKS,
            "[*none, *self._half[standing:]]",
            "[*none, *(0.0 for _ in self._half[standing:])]",
        ),
        Mutant(
            "forgets-the-slack-between-links",
            "pairs",
            LINKS,
            "[w + s for w, s in zip(width, self._moving.joint_tolerance, strict=True)]",
            "[w for w, s in zip(width, self._moving.joint_tolerance, strict=True)]",
        ),
        Mutant(
            "compares-links-on-the-first-half-alone",
            "pairs-of-two",
            LINKS,
            " or self.search(\n            second, halfway, high, left, depth\n        )",
            "",
        ),
        Mutant(
            "forgets-the-clearance-between-links",
            "contact",
            LINKS,
            "_ContactSearch(moving, clearance + ROUNDING)",
            "_ContactSearch(moving, ROUNDING)",
        ),
        Mutant(
            "compares-links-alone",
            "contact",
            LINKS,
            "hull_pairs(moving.body, moving.held)",
            "hull_pairs(moving.body, None)",
        ),
        Mutant(
            "has-an-obstacle-where-it-is-from-the-origin",
            "obstacle",
            OBSTACLES,
            "(ax - x, ay - y, az - z), (bx - x, by - y, bz - z)",
            "(ax, ay, az), (bx, by, bz)",
        ),
        Mutant(
            "takes-an-obstacle-to-stand-while-the-base-drives",
            "obstacles",
            OBSTACLES,
            " or any(moving.base_path)",
            "",
        ),
        Mutant(
            "forgets-the-clearance-of-obstacles",
            "obstacles",
            OBSTACLES,
            "contact = find_link_contact(moving, clearance)",
            "contact = find_link_contact(moving, 0.0)",
        ),
        Mutant(
            "looks-at-two-paths-only",
            "loops",
            "aeros.runtime.motion.swept_volume",
            "for path in moving.paths:",
            "for path in moving.paths[:2]:",
        ),
    ),
)
