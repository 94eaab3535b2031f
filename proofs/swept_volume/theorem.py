"""A motion that the sweep calls clear is clear at every instant: the swept volume of theorem 14."""

from __future__ import annotations

from aeros.spec.theorems.module_copies import Mutant
from aeros.spec.theorems.theorem import Theorem
from proofs.lib import kinematic_chain
from proofs.lib.ball_enclosures import BEZIER, SWEEP, ball_obligations
from proofs.lib.sweep_search import search_obligations

THEOREM = Theorem(
    "if the sweep reports a motion clear, no ball of a moving body comes near, at any point of the motion",
    {**ball_obligations(), **search_obligations()},
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
            "looks-at-one-path",
            "breach",
            SWEEP,
            "    for path in moving.paths:\n",
            "    for path in moving.paths[:1]:\n",
        ),
    ),
)
