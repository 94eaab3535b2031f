"""Check that no two bodies of a world overlap."""

from __future__ import annotations

from collections.abc import Mapping

from aeros.sim.engine.world import EngineWorld
from aeros.sim.layouts.overlap_faults import MAX_OVERLAP, overlap_fault
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.scene import SceneBody


def check_overlaps(world: EngineWorld, placed: Mapping[int, SceneBody], names: Mapping[int, str]) -> None:
    """Check that no two bodies of a world overlap by more than `MAX_OVERLAP`.

    Overlapping bodies are thrown apart as soon as the world steps.

    Args:
        world: the world.
        placed: declared bodies by their number.
        names: names of other bodies, by number.

    Raises:
        UserError: some overlap; it lists every pair.
    """
    problems = [
        _overlap_diagnostic(first, second, depth, world, placed, names)
        for first, second, depth in world.overlaps(MAX_OVERLAP)
    ]
    if problems:
        raise UserError(problems)


def _overlap_diagnostic(
    one: int,
    other: int,
    depth: float,
    world: EngineWorld,
    placed: Mapping[int, SceneBody],
    names: Mapping[int, str],
) -> Diagnostic:
    first, second = sorted((one, other), key=lambda body: body not in placed)
    spoken = [_body_name(body, world, placed, names) for body in (first, second)]
    declared = [placed[body] for body in (first, second) if body in placed]
    return overlap_fault(spoken[0], spoken[1], declared, depth)


def _body_name(
    body: int, world: EngineWorld, placed: Mapping[int, SceneBody], names: Mapping[int, str]
) -> str:
    if body in placed:
        return f"`{placed[body].name}`"
    if body in names:
        return names[body]
    x, y, z = world.pose(body).position
    return f"the body at ({x:.2f}, {y:.2f}, {z:.2f}) m"
