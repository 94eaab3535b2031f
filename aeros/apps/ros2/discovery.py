"""Range of discovery: this machine alone, unless the environment says otherwise.

Every process in the domain that discovery reaches may call services and send goals.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

_RANGE: Final = "ROS_AUTOMATIC_DISCOVERY_RANGE"
_LOCALHOST_ONLY: Final = "ROS_LOCALHOST_ONLY"  # before Iron
_CHOICES: Final = (_RANGE, _LOCALHOST_ONLY, "ROS_DISCOVERY_SERVER", "ROS_STATIC_PEERS")


def default_discovery(environment: Mapping[str, str]) -> dict[str, str]:
    """Return variables that limit discovery to this machine; none if the environment has a choice already.

    Args:
        environment: Variables of the environment.

    Returns:
        Variables to set before ROS 2 starts.
    """
    if any(environment.get(name) for name in _CHOICES):
        return {}
    if environment.get("ROS_DISTRO") in ("foxy", "galactic", "humble"):
        return {_LOCALHOST_ONLY: "1"}
    return {_RANGE: "LOCALHOST"}


def reach_text(environment: Mapping[str, str]) -> str:
    """Say in words who can reach the node.

    Args:
        environment: Variables of the environment, with those of `default_discovery`.

    Returns:
        The text.
    """
    domain = environment.get("ROS_DOMAIN_ID") or "0"
    is_local = environment.get(_RANGE) == "LOCALHOST" or environment.get(_LOCALHOST_ONLY) == "1"
    others = any(environment.get(name) for name in _CHOICES[2:])
    where = "this machine only" if is_local and not others else "other machines too"
    return f"domain {domain}, {where}"
