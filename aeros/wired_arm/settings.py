"""Settings that plants for wired arms have in common."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from aeros.runtime.ports import Vec3
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.scene import Scene
from aeros.spec.model.site import Site


class SettingsError(Exception):
    """A setting is missing or wrong; the message says which, and what to do."""


class WatchBounds(NamedTuple):
    """Bounds of the site on how a motion is begun and watched.

    Attributes:
        patience: longest time without a judgement of the monitor, s.
        start_tolerance: greatest distance of a motion's start from the joints, rad.
    """

    patience: float
    start_tolerance: float


def watch_bounds(site: Site) -> WatchBounds:
    """Read the bounds of a site.

    Args:
        site: the site.

    Returns:
        The bounds.

    Raises:
        SettingsError: the site does not bound late ticks.
    """
    if site.motion is None or site.motion.late_ticks is None:
        raise SettingsError(f"the site `{site.id}` does not bound late ticks: add `motion.late_ticks`")
    return WatchBounds(float(site.motion.late_ticks.longest), float(site.motion.start_tolerance))


def base_of(scene: Scene | None) -> Vec3:
    """Return where a scene mounts the robot; nothing else in it counts for a real one.

    Args:
        scene: the scene of a run; None if it has none.

    Returns:
        Position of the arm's base in W, m; the origin if the scene has no mount.
    """
    mount = None if scene is None else scene.robot
    return (0.0, 0.0, 0.0) if mount is None else mount.base


def load_site_file(path: Path) -> Site:
    """Load a site that an environment variable names.

    Args:
        path: the site file.

    Returns:
        The site.

    Raises:
        SettingsError: the file is no site file.
        UserError: it has problems.
    """
    diagnostics = Diagnostics()
    site = load_site(path, diagnostics)
    diagnostics.raise_if_errors()
    if site is None:
        raise SettingsError(f"`{path}` is no site file")
    return site
