"""Description of a robot (URDF) for viewers, made of the chain that its plant states.

Frames are those of `transforms.py`: `base`, `NAME_link` for the link that joint NAME moves, and `tool`.  Each
link shows the balls that enclose it, with which barriers are checked.  It has no meshes and no limits.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final
from xml.sax.saxutils import quoteattr

from aeros.kinematic_chain import ORIGIN, child_frame, mounting_of
from aeros.runtime.bus.transforms import BASE, TOOL
from aeros.runtime.ports import RobotBody, Vec3

_COLOUR: Final = "0.75 0.77 0.80 0.6"


def robot_description(body: RobotBody, names: Sequence[str]) -> str:
    """Write the URDF of a chain.

    Args:
        body: the chain, with the balls of its links.
        names: names of its joints, from the base on.

    Returns:
        The URDF.
    """
    links = [BASE, *(f"{name}_link" for name in names)]
    lines = ['<robot name="robot">', f'<material name="link"><color rgba="{_COLOUR}"/></material>']
    for number, link in enumerate(links):
        lines += [f"<link name={quoteattr(link)}>", *_visuals(body, number), "</link>"]
    for (a, alpha, d), name, parent, child in zip(body.dh_rows, names, links, links[1:], strict=False):
        # Rx(alpha) Tx(a) Tz(d) of the modified Denavit-Hartenberg parameters, then the turn about z.
        origin = f'<origin xyz="{_numbers(_joint_origin(a, alpha, d))}" rpy="{alpha!r} 0 0"/>'
        lines.append(_joint(name, "continuous", parent, child, origin, '<axis xyz="0 0 1"/>'))
    lines.append(f"<link name={quoteattr(TOOL)}/>")
    origin = f'<origin xyz="{_numbers(body.tool_offset)}"/>'
    lines.append(_joint("tool_mount", "fixed", links[-1], TOOL, origin, ""))
    return "\n".join([*lines, "</robot>"])


def _visuals(body: RobotBody, joint: int) -> Iterator[str]:
    for ball in body.balls:
        if ball.joint == joint:
            yield (
                f'<visual><origin xyz="{_numbers(ball.centre)}"/><geometry><sphere radius="{ball.radius!r}"/>'
                '</geometry><material name="link"/></visual>'
            )


def _joint(name: str, kind: str, parent: str, child: str, *parts: str) -> str:
    ends = f"<parent link={quoteattr(parent)}/><child link={quoteattr(child)}/>"
    return f"<joint name={quoteattr(name)} type={quoteattr(kind)}>{ends}{''.join(parts)}</joint>"


def _joint_origin(a: float, alpha: float, d: float) -> Vec3:
    return child_frame(ORIGIN, mounting_of((a, alpha, d)), 0.0).origin


def _numbers(values: Sequence[float]) -> str:
    return " ".join(repr(float(value)) for value in values)
