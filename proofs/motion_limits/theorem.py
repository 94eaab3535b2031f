"""A motion begins only if it is well-formed, starts and ends in the right place, and obeys all limits."""

from __future__ import annotations

from functools import partial
from typing import Final

from aeros.spec.theorems.module_copies import Mutant
from aeros.spec.theorems.theorem import Theorem
from proofs.lib.loops import loops_of
from proofs.motion_limits import motion_decisions, motion_places, motion_rates, motion_volumes
from proofs.motion_limits.motion_rates import JOINTS, TRAJECTORY


def _mutant(name: str, obligation: str, old: str, new: str) -> Mutant:
    return Mutant(name, obligation, TRAJECTORY, old, new)


_DECISIONS: Final = (
    _mutant(
        "takes-any-lever-of-a-prismatic-joint",
        "form",
        "if levers and levers[number] < 1:",
        "if levers and levers[number] < 0:",
    ),
    _mutant(
        "allows-what-is-objected-to",
        "decision",
        "return Decision(DecisionKind.DENY, None, reasons) if reasons else decision",
        "return decision",
    ),
    _mutant(
        "takes-all-for-completed",
        "decision",
        "or type(plan) is MotionCompletion",
        "or type(plan) is not MotionCompletion",
    ),
    _mutant(
        "believes-whatever-is-no-trajectory",
        "objections",
        "        if type(plan) is NoMotion:\n",
        "        if type(plan) is not Trajectory:\n",
    ),
    _mutant(
        "looks-at-the-latest-motion-under-way",
        "objections",
        "        for other in concurrent_motions:\n            fault",
        "        for other in concurrent_motions[-1:]:\n            fault",
    ),
    _mutant(
        "forgets-barriers",
        "objections",
        "reasons += self._breaches(policy, action, plan if merged.is_single_motion else None, moving)",
        "pass",
    ),
    _mutant(
        "forgets-the-ends-of-others",
        "objections",
        'reasons += _end_mismatch(policy, other.action, merged, f"{subject} would end")',
        "pass",
    ),
    _mutant(
        "compares-links-of-a-single-motion-alone",
        "objections",
        "        if moves_joints(merged.joints.motion):\n",
        "        if moves_joints(plan):\n",
    ),
    _mutant(
        "holds-nothing",
        "objections",
        "merged.swept_motion(held_object(policy, merged.joints.motion.body, readings))",
        "merged.swept_motion(None)",
    ),
)

_FORM: Final = (
    _mutant(
        "looks-at-some-numbers",
        "form",
        "        if set(map(type, numbers)) != {float} or not all(map(isfinite, numbers)):\n",
        "        if set(map(type, numbers)) != {float} or not any(map(isfinite, numbers)):\n",
    ),
    _mutant(
        "takes-whole-numbers-for-doubles",
        "form",
        "        if set(map(type, numbers)) != {float} or",
        "        if not set(map(type, numbers)) <= {float, int} or",
    ),
    _mutant("takes-no-time", "form", "plan.duration <= 0.0:", "plan.duration < 0.0:"),
    _mutant(
        "lets-a-path-jump",
        "form",
        "        if not all(is_c2_continuous(path) for path in plan.joint_paths):\n",
        "        if not all(is_c2_continuous(path) for path in plan.joint_paths[1:]):\n",
    ),
    _mutant(
        "lets-a-hull-have-no-size",
        "form",
        "        if not (_moves_with_joint(hull, joints) and hull.corners):\n",
        "        if not _moves_with_joint(hull, joints):\n",
    ),
    _mutant(
        "lets-a-plan-change-afterwards",
        "form",
        "        {type(one) for one in sequences} == {tuple}\n",
        "        {type(one) for one in sequences} <= {tuple, list}\n",
    ),
    _mutant(
        "lets-a-body-lack-a-link",
        "form",
        "        if not links or named - links:\n",
        "        if not links:\n",
    ),
    _mutant(
        "joins-one-path-smoothly",
        "form-under-feedback",
        "        if not all(is_c2_continuous(path) for path in plan.joint_paths):\n",
        "        if not is_c2_continuous(plan.joint_paths[0]):\n",
    ),
    _mutant(
        "lets-the-base-travel-under-feedback",
        "form-under-feedback",
        "        if plan.servo is not None and any(plan.base_path):\n",
        "        if plan.servo is None and any(plan.base_path):\n",
    ),
    _mutant(
        "forgets-a-declared-rate",
        "form-under-feedback",
        "    rows = (servo.joint_tolerance, servo.speed, servo.acceleration, servo.jerk)\n",
        "    rows = (servo.joint_tolerance, servo.speed, servo.acceleration)\n",
    ),
)

_RATES: Final = (
    _mutant("compares-no-limit", "limits", "        if not a <= b\n", "        if False\n"),
    _mutant("lets-what-is-not-a-number-pass", "limits", "        if not a <= b\n", "        if a > b\n"),
    _mutant(
        "compares-no-jerk",
        "limits",
        "zip(_RATES, rates, limit, units, strict=True)",
        "[*zip(_RATES, rates, limit, units, strict=True)][:2]",
    ),
    _mutant(
        "leaves-tolerance-out-of-the-range",
        "joints",
        "if m - w - s < self._lowest[joint] or",
        "if m - w < self._lowest[joint] or",
    ),
    _mutant(
        "compares-the-wrong-end",
        "joints",
        "m + w + s > self._highest[joint]:",
        "m + w + s < self._highest[joint]:",
    ),
    _mutant(
        "compares-two-joints",
        "joints",
        "in enumerate(zip(_joint_rates(plan), self._joint_rates, strict=True), 1):",
        "in enumerate([*zip(_joint_rates(plan), self._joint_rates, strict=True)][:2], 1):",
    ),
    _mutant(
        "looks-at-the-first-path-alone",
        "paths",
        "        for path in plan.joint_paths:\n            middle",
        "        for path in plan.joint_paths[:1]:\n            middle",
    ),
    _mutant(
        "computes-rates-under-feedback",
        "sources",
        "    if servo is None:\n        return joint_rates(",
        "    if servo is not None:\n        return joint_rates(",
    ),
    _mutant(
        "takes-the-tool-to-rest",
        "sources",
        "    if not moves_joints(plan):\n        return _REST_TOLERANCE",
        "    if moves_joints(plan):\n        return _REST_TOLERANCE",
    ),
    _mutant(
        "forgets-that-the-base-carries-the-tool",
        "tool",
        "        moving = add_rates(relative, carried)\n",
        "        moving = relative\n",
    ),
    _mutant(
        "lets-any-speed-pass",
        "tool",
        "            if reached > speed:\n",
        "            if reached > reached:\n",
    ),
    _mutant(
        "looks-at-the-new-motion-s-speed-alone",
        "tool",
        "        for name, speed, plan in requested:\n            reached",
        "        for name, speed, plan in requested[:1]:\n            reached",
    ),
    _mutant(
        "lets-the-tool-turn", "tool", "        if turning is not None:\n", "        if turning is None:\n"
    ),
    _mutant(
        "lets-the-base-race",
        "base-speed",
        "    if policy.base_limits is None:\n        return []\n",
        "    if policy.base_limits is not None:\n        return []\n",
    ),
)

_PLACES: Final = (
    _mutant(
        "starts-anywhere",
        "start",
        '        return [Reason("AE761", policy.start_variable, "the joint positions are not known")]\n',
        "        return []\n",
    ),
    _mutant(
        "starts-where-one-joint-is-right",
        "start",
        "distance = max(abs(a - b) for a, b in zip(posture, measured.value, strict=True))",
        "distance = max(abs(a - b) for a, b in [*zip(posture, measured.value, strict=True)][:1])",
    ),
    _mutant(
        "starts-with-a-signed-distance",
        "start",
        "distance = max(abs(a - b) for a, b in zip(posture, measured.value, strict=True))",
        "distance = max(a - b for a, b in zip(posture, measured.value, strict=True))",
    ),
    _mutant(
        "believes-the-base",
        "base",
        "    distance = dist(base, measured.value)\n    if distance <= float(tracking.bound):\n",
        "    distance = dist(base, measured.value)\n    if distance > float(tracking.bound):\n",
    ),
    _mutant(
        "does-not-miss-the-base",
        "base",
        '        return [Reason("AE761", name, "the position of the base is not known")]\n',
        "        return []\n",
    ),
    _mutant(
        "ends-anywhere",
        "end",
        "parameters[targets.tool_target])\n        if not distance <= tolerance:\n",
        "parameters[targets.tool_target])\n        if distance > tolerance:\n",
    ),
    _mutant(
        "ends-with-one-joint-right",
        "end",
        "        if not all(distance <= _JOINT_TOLERANCE for distance in each):\n",
        "        if not any(distance <= _JOINT_TOLERANCE for distance in each):\n",
    ),
    _mutant(
        "compares-the-first-piece-s-end", "end", "joint_paths[0][-1][3], ends", "joint_paths[0][0][3], ends"
    ),
)

_VOLUMES: Final = (
    _mutant(
        "needs-no-clearance",
        "barriers",
        "        breach = find_breach(moving, others, clearance)\n        if breach is not None and",
        "        breach = find_breach(moving, others, 0.0)\n        if breach is not None and",
    ),
    _mutant(
        "forgets-a-barrier",
        "barriers",
        "[box for box in self._boxes if box not in touched]",
        "[box for box in self._boxes if box not in touched][1:]",
    ),
    _mutant(
        "lets-links-touch-the-surface",
        "barriers",
        "        if breach is None and touched:\n",
        "        if breach is None and not touched:\n",
    ),
    _mutant(
        "believes-the-first-search",
        "barriers",
        "            breach = _find_breach_closely(moving, others, clearance)\n",
        "            breach = None\n",
    ),
    _mutant(
        "touches-with-what-is-not-held",
        "barriers",
        "if surface is not None and plan is not None and moving.held is not None:",
        "if surface is not None and plan is not None:",
    ),
    _mutant(
        "searches-around-the-base-alone",
        "closely",
        "        find_breach(moving, [box for box in boxes if box not in own], clearance)\n        or ",
        "        ",
    ),
    _mutant(
        "holds-it-out-of-all-volumes",
        "closely",
        "if box.is_in_base_frame and not box.keep_inside]",
        "if not box.keep_inside]",
    ),
    _mutant(
        "lets-links-meet",
        "contacts",
        "    contact = find_link_contact(moving, clearance)\n",
        "    contact = None\n",
    ),
    _mutant(
        "keeps-links-as-far-from-obstacles",
        "contacts",
        "    breach = find_obstacle_contact(moving, obstacles, clearance)\n",
        "    breach = find_obstacle_contact(moving, obstacles[:0], clearance)\n",
    ),
    _mutant(
        "drives-at-obstacles",
        "contacts",
        "        breach = find_base_contact(travel, obstacles, clearance)\n",
        "        breach = find_base_contact(travel, obstacles[:0], clearance)\n",
    ),
    _mutant(
        "compares-a-base-that-stands",
        "contacts",
        "driven is not None and any(moving.base_path):",
        "driven is not None and not any(moving.base_path):",
    ),
    _mutant("takes-unknown-for-nothing", "held", "measured.value is False:", "measured.value is not True:"),
    _mutant(
        "holds-half-of-it",
        "held",
        "zip(_floats(box.lower), _floats(box.upper), strict=True)",
        "zip(_floats(box.lower), _floats(box.lower), strict=True)",
    ),
    _mutant(
        "leaves-a-barrier-out",
        "policy",
        "for barrier in policy.barriers]",
        "for barrier in policy.barriers[:2]]",
    ),
    _mutant(
        "swaps-highest-and-lowest",
        "policy",
        "= _floats(policy.lowest), _floats(policy.highest)",
        "= _floats(policy.highest), _floats(policy.lowest)",
    ),
    _mutant(
        "fixes-barriers-in-the-world",
        "policy",
        "barrier.keep_inside, barrier.is_in_base_frame, barrier.links)",
        "barrier.keep_inside, False, barrier.links)",
    ),
)

_LOOPS: Final = loops_of(
    "aeros.runtime.motion.trajectory",
)

_LOOP_MUTANT: Final = Mutant(
    "forgets-joints-after-the-second",
    "loops",
    "aeros.runtime.motion.trajectory",
    "for path in plan.joint_paths:\n            middle",
    "for path in plan.joint_paths[:2]:\n            middle",
)

THEOREM: Final = Theorem(
    "a motion of a covered kind begins only if it is well-formed, starts where the robot is, ends where the "
    "action asks, and obeys every limit and barrier of the site; whatever a plant returns has a decision",
    {
        "decision": motion_decisions.decision_obligation,
        "objections": motion_decisions.objections_obligation,
        **motion_decisions.form_obligations(),
        "limits": motion_rates.limits_obligation,
        "joints": partial(motion_rates.joints_obligation, ("a",), JOINTS),
        "paths": partial(motion_rates.joints_obligation, ("a", "b", "c"), JOINTS[:1]),
        "sources": motion_rates.sources_obligation,
        "tool": motion_rates.tool_obligation,
        "base-speed": motion_rates.base_speed_obligation,
        "start": motion_places.start_obligation,
        "base": motion_places.base_obligation,
        "end": motion_places.end_obligation,
        "barriers": motion_volumes.barriers_obligation,
        "closely": motion_volumes.closely_obligation,
        "contacts": motion_volumes.contacts_obligation,
        "held": motion_volumes.held_obligation,
        "policy": motion_volumes.policy_obligation,
        "loops": _LOOPS,
    },
    (*_DECISIONS, *_FORM, *_RATES, *_PLACES, *_VOLUMES, _LOOP_MUTANT),
)
