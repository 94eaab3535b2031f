"""Read the standing arms of a robot file: which robot each is, where, and in which posture."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Final

from aeros.runtime.ports import JointVector
from aeros.sim.robot.columns import POSITION, read_column
from aeros.sim.robot.gripper import point_of
from aeros.sim.robot.model import ArmMount, RobotModel, StandingArm
from aeros.sim.robot.standing_arms.standing_arm import find_overlap, joints_outside, with_standing_arms
from aeros.spec.declared.robots import robot as declared
from aeros.spec.diagnostics.codes import Diagnostics, did_you_mean
from aeros.spec.diagnostics.source import SourceSpan

_FARTHEST: Final = 10.0
"""Greatest coordinate of an arm's place, m: one beyond it is in a wrong unit."""

_FULL_TURN: Final = 6.2832
"""Greatest angle of an arm's place, rad: one beyond it is in a wrong unit."""


class StandingArmReader:
    """Reader of the standing arms of one robot file; problems go to `diagnostics`.

    Args:
        path: the robot file.
        carriers: robot files that carry this one, and this one.
        known: files of robots by name.
        read: reads a robot file that these files carry.
        diagnostics: for problems.
    """

    def __init__(
        self,
        path: Path,
        carriers: tuple[Path, ...],
        known: dict[str, Path],
        read: Callable[[Path, tuple[Path, ...]], RobotModel],
        diagnostics: Diagnostics,
    ) -> None:
        self._path = path
        self._carriers = carriers
        self._known = known
        self._read = read
        self._diagnostics = diagnostics

    def add(self, model: RobotModel, arms: tuple[declared.StandingArm, ...]) -> RobotModel:
        """Add the arms to the robot that carries them.

        Args:
            model: the robot.
            arms: as the file declares them.

        Returns:
            The robot with the arms that have no problem.

        Raises:
            UserError: the file of one of the arms has problems.
        """
        for one in arms:
            arm = self._arm(one, model.joint_count)
            if arm is None:
                continue
            try:
                with_it = with_standing_arms(model, (arm,))
            except ValueError as failure:
                self._report(str(failure), one.prefix.span, "give each arm a prefix of its own")
                continue
            overlap = find_overlap(with_it)
            if overlap is None:
                model = with_it
            else:
                first, second = overlap
                self._report(
                    f"`{second}` overlaps `{first}` in the ready posture",
                    one.span,
                    "correct `at`, `roll_pitch_yaw` or `posture`, or make `tolerance` less",
                )
        return model

    def _arm(self, one: declared.StandingArm, joints: int) -> StandingArm | None:
        """Read an arm; None if it has a problem."""
        model, joint = self._robot(one), 0 if one.joint is None else one.joint.value
        if not 0 <= joint <= joints:
            assert one.joint is not None  # noqa: S101  0 is no problem
            headline = f"no {joint} joints carry the arm: the moving arm has {joints}"
            self._report(headline, one.joint.span, f"write 0 for its base, or a number up to {joints}")
            return None
        at = point_of(one.at)
        angles = (0.0, 0.0, 0.0) if one.roll_pitch_yaw is None else point_of(one.roll_pitch_yaw)
        fields = ((one.at, at, _FARTHEST, "m"), (one.roll_pitch_yaw, angles, _FULL_TURN, "rad"))
        is_placed = True
        for numbers, values, greatest, unit in fields:
            for number, value in zip(numbers or (), values, strict=False):
                if abs(value) > greatest:
                    is_placed = False
                    headline = f"`{number.node.text}` is beyond {greatest:g} {unit}"
                    self._report(headline, number.span, f"write numbers in {unit}")
        if model is None:
            return None
        posture, tolerance = self._positions(one, model)
        if posture is None or tolerance is None or not is_placed:
            return None
        return StandingArm(model, ArmMount(one.prefix.value, at, angles, joint), posture, tolerance)

    def _robot(self, one: declared.StandingArm) -> RobotModel | None:
        name = one.robot.value
        is_path = name.endswith((".yaml", ".yml"))
        path = self._path.parent / name if is_path else self._known.get(name)
        if path is None:
            near = did_you_mean(name, self._known)
            listed = ", ".join(f"`{each}`" for each in sorted(self._known))
            cure = (
                f"did you mean `{near}`?" if near else f"write the path of a robot file, or one of {listed}"
            )
            self._report(f"there is no robot `{name}`", one.robot.span, cure)
            return None
        path = path.resolve()
        if path in self._carriers:
            chain = " carries ".join(f"`{each.name}`" for each in (*self._carriers, path))
            headline = f"the robot carries itself: {chain}"
            self._report(headline, one.robot.span, "name the file of an arm that carries no other one")
            return None
        if not path.is_file():
            self._report(f"there is no file `{path}`", one.robot.span, "correct the path, from this file on")
            return None
        return self._read(path, self._carriers)

    def _positions(
        self, one: declared.StandingArm, model: RobotModel
    ) -> tuple[JointVector | None, JointVector | None]:
        """Read posture and tolerance of an arm; None for what has a problem."""
        slides = [bool(each) for each in model.slides.tolist()]
        posture, tolerance = (
            values if len(values) == model.joint_count else None
            for column in (one.posture, one.tolerance)
            for values in [
                tuple(read_column(column, POSITION, slides, self._diagnostics, signed=True).tolist())
            ]
        )
        for joint, headline in () if posture is None else joints_outside(model, posture):
            self._report(headline, one.posture.values[joint].span, "correct the posture or its unit")
            posture = None
        for number, room in zip(one.tolerance.values, tolerance or (), strict=False):
            if room < 0.0:
                self._report(f"`{number.node.text}` is below 0", number.span, "write 0 or more")
                tolerance = None
        return posture, tolerance

    def _report(self, headline: str, span: SourceSpan, cure: str) -> None:
        self._diagnostics.error("AE208", headline, span, help=(cure,))
