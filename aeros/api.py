"""Public names of AEROS for programs; `import aeros` has them all and imports each at its first use."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike

from aeros.runtime.gate.decision import Decision
from aeros.runtime.ports import Plant
from aeros.session.argument_checks import as_path, require_members
from aeros.session.module_settings import read_module_settings
from aeros.session.session import Session, open_session
from aeros.session.skill_gate import SkillGate as Gate
from aeros.session.skill_gate import load_gate
from aeros.sim.conformance.suite import CHECKS, ConformanceError, PlantUnderTest
from aeros.skill import Action, Observation, act
from aeros.spec.backends.answer_store import open_default_store
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.verification.reports import Report
from aeros.spec.verification.verify import Detail
from aeros.spec.verification.verify import verify as verify_modules

__all__ = [
    "Action",
    "Decision",
    "Gate",
    "Observation",
    "Plant",
    "Report",
    "Session",
    "act",
    "check_conformance",
    "load_gate",
    "open_session",
    "verify",
]


def verify(
    *paths: str | PathLike[str],
    site: str | PathLike[str] | None = None,
    bindings: Mapping[str, str] | None = None,
    parameters: Mapping[str, str] | None = None,
) -> Report:
    """Prove that modules keep the policy of a site, as `aeros verify` does; no certificate is written.

    Files that cannot be read or are rejected raise no exception: the report lists each problem with file,
    line, cause and help.  Results of earlier proofs of the same files are reused.

    Args:
        paths: Modules' folders, or folders of modules.
        site: The site file; None for the reference site, a Panda cell.
        bindings: The site's name for what a module needs, by `MODULE.NEED`, as `--bind` gives it.
        parameters: Values of modules' parameters, with their units, by `MODULE.PARAMETER`, as `--set` does.

    Returns:
        The report: `conclusion`, and the results for the `site` and for each of the `modules`.

    Raises:
        MisuseError: There is no path, or an argument is none.

    Example:
        >>> report = aeros.verify("ecms/")
        >>> report.conclusion.value
        'proved'
        >>> [module.name for module in report.modules]
        ['clean_table', 'fetch_object', 'inspect_table', 'make_dumplings', 'serve_table']
    """
    folders = [as_path("paths", one) for one in paths]
    if not folders:
        raise MisuseError("there is nothing to verify; give a module's folder, such as `ecms/clean_table`")
    path = reference_site_path() if site is None else as_path("site", site)
    settings = read_module_settings(bindings, parameters)
    with open_default_store() as store:
        return verify_modules(folders, path, store=store, settings=settings, detail=Detail.BRIEF)


def check_conformance(subject: PlantUnderTest) -> tuple[str, ...]:
    """Check that a plant keeps every promise of `Plant` by moving it; use the robot's own simulator first.

    Args:
        subject: Factory of the plant, actions that move it, and properties stated by its author, in SI units
            (`aeros.sim.conformance.suite.PlantUnderTest`).

    Returns:
        The names of the checked promises, all of which are kept.

    Raises:
        ConformanceError: Promises are broken or a check raises an exception; the text lists them all.
        MisuseError: `subject` is not a `PlantUnderTest`.

    Example:
        >>> from aeros.sim.conformance.suite import PlantUnderTest
        >>> from aeros.sim.kinematic.plant import make_plant
        >>> from aeros.sim.robot.robot_file import read_robot
        >>> from aeros.spec.scenes.load import load_scene
        >>> subject = PlantUnderTest(
        ...     make_plant=lambda: make_plant(load_scene("bare"), 0),
        ...     motion_action=aeros.act("move_tool", target=(0.5, -0.35, 0.25), yaw=0.5, speed=0.5),
        ...     parallel_action=aeros.act("wait", duration=6.0),
        ...     tracking_tolerance=1e-9,
        ...     max_overshoot=1e-6,
        ...     deceleration=tuple(read_robot("panda").limits.acceleration),
        ...     max_stop_time=0.17,
        ...     noise=1e-9,
        ... )
        >>> promises = aeros.check_conformance(subject)
        >>> promises[0]
        'the_clock_never_goes_back'
    """
    require_members("subject", subject, ("make_plant", "motion_action"), "PlantUnderTest")
    broken = []
    for check in CHECKS:
        try:
            check(subject)
        except ConformanceError as error:
            broken.append(f"{check.__name__}: {error}")
        except Exception as error:
            broken.append(f"{check.__name__}: it raises {type(error).__name__}: {error}")
    if broken:
        raise ConformanceError(f"{len(broken)} of {len(CHECKS)} promises are broken\n" + "\n".join(broken))
    return tuple(check.__name__ for check in CHECKS)
