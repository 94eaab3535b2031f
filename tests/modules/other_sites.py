"""Two more sites, made from the reference site: one with other names, one that differs.

The first names its volumes, cameras, sensors and invariants otherwise. The second has a slower arm, a smaller
workspace and fewer cameras. Both keep the words of the simulators: action kinds, variables,
actuators, joints.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Final

import yaml

from aeros.spec.text.discovery import reference_site_path

VOLUMES: Final = {
    "workspace": "arm_space",
    "own_base": "arm_column",
    "floor": "drive_space",
    "aisle": "lane",
    "bench_area": "kitchen_space",
    "press_area": "folding_space",
    "table_area": "counter_space",
    "stands": "hall",
}
CAMERAS: Final = {
    "mast": "pole",
    "hand": "wrist",
    "overhead": "top",
    "side": "level",
    "table_top": "sky",
    "table_side": "pole_at_table",
    "aisle_top": "lamp",
}
SENSORS: Final = {
    "joint_encoders": "axes",
    "wheel_odometry": "wheels",
    "gripper": "fingers_sensor",
    "cell_survey": "theodolite",
    "press": "press_cell",
    **{f"{old}_camera": f"{new}_camera" for old, new in CAMERAS.items()},
}
PLANT_WORDS: Final = {
    "move_tool": "travel",
    "slide": "rub",
    "grip": "clasp",
    "move_base": "drive",
    "look": "photograph",
    "wait": "pause",
    "tool_position": "tip_position",
    "base_position": "foot_position",
    "holding": "has_object",
    "finger_gap": "opening",
}
"""Action kinds and variables; no simulator of AEROS runs under these names."""

BOUND: Final = {
    "clean_table": ("table_area",),
    "inspect_table": ("table_area",),
    "serve_table": ("table_area",),
    "make_dumplings": ("bench_area",),
    "fetch_object": (),
    "hold_sponge": ("table_area",),
}
"""Needs for which a site with other names has several choices; all others bind by themselves."""

_PROSE: Final = {"description", "rationale", "source"}


def site_with_other_names(folder: Path, *, plant_words: bool = False) -> Path:
    """Write the reference site with other names.

    Args:
        folder: where to.
        plant_words: rename action kinds and variables, too.

    Returns:
        The site file.
    """
    names = {**VOLUMES, **CAMERAS, **(PLANT_WORDS if plant_words else {})}
    names |= {old: new for old, new in SENSORS.items() if old not in ("gripper", "press")}
    site = _renamed(_reference_site(), names, "")
    scanners = site["area_scanners"]
    scanners["floor"] = scanners.pop(VOLUMES["floor"])  # a field, which no site names
    for rule in (*site["invariants"], *site["joint"]):
        rule["id"] = f"rule-on-{rule['id']}"
    return _write(folder / "other_names.yaml", site)


def bindings(*modules: str) -> list[str]:
    """Options that bind the needs that a site with other names leaves open, of these modules or of all."""
    names = {**VOLUMES, **SENSORS}
    pairs = ((module, need) for module in modules or BOUND for need in BOUND[module])
    return [word for module, need in pairs for word in ("--bind", f"{module}.{need}={names[need]}")]


def slower_site(folder: Path) -> Path:
    """Write a site with a slower arm, less room, no bench with a press and only the cameras over the table.

    Its settings of modules are in the file.
    """
    site = _reference_site()
    invariants = {rule["id"]: rule for rule in site["invariants"]}
    invariants["cell-speed"]["require"] = "speed <= 350 mm/s"
    invariants["short-waits"]["require"] = "duration <= 8 s"
    invariants["grip-force"]["require"] = "force <= 12 N"
    site["volumes"]["workspace"] |= {
        "lower": ["-750 mm", "-700 mm", "-10 mm"],
        "upper": ["750 mm", "700 mm", "600 mm"],
    }
    site["volumes"]["table_area"] |= {
        "lower": ["260 mm", "-1760 mm", "12 mm"],
        "upper": ["660 mm", "-790 mm", "460 mm"],
    }
    for name in ("bench_area", "press_area"):
        del site["volumes"][name]
    site["enums"]["cameras"] = ["mast", "table_top", "table_side", "aisle_top"]
    for name in ("hand", "overhead", "side"):
        del site["cameras"][name]
        del site["resources"][f"{name}_camera"]
        access = site["policy"]["access"]["sensors"]
        access.remove(f"{name}_camera")
        site["sensor_errors"]["cameras"].pop(name, None)
    site["modules"] = {
        module: {"set": {"hand_speed": "330 mm/s"}} for module in ("clean_table", "inspect_table")
    }
    return _write(folder / "slower.yaml", site)


def _reference_site() -> dict[str, Any]:
    # `on` is a key: PyYAML would read it as true, unless it is quoted.
    text = re.sub(r"(?m)^( +)on:", r'\1"on":', Path(reference_site_path()).read_text())
    loaded: dict[str, Any] = yaml.safe_load(text)
    return loaded


def _write(path: Path, site: dict[str, Any]) -> Path:
    path.write_text(yaml.safe_dump(site, sort_keys=False, width=1000))
    return path


def _renamed(node: Any, names: dict[str, str], key: str) -> Any:
    """Replace names in keys and texts, but not in prose, in offers or among the links of the arm."""
    if isinstance(node, dict):
        # Sensors that have the name of an actuator or of a device are renamed where sensors stand alone.
        renamed = {"sensors": ("press",), "moved_by": ("press", "gripper")}.get(key, ())
        sensors = {one: SENSORS[one] for one in renamed}
        return {
            sensors.get(old, _replaced(old, names)): _renamed(one, names, old) for old, one in node.items()
        }
    if isinstance(node, list):
        return node if key in ("links", "offers") else [_renamed(one, names, key) for one in node]
    if key in ("id", *_PROSE) or not isinstance(node, str):
        return node
    return _replaced(node, {**names, **SENSORS} if key in ("sensor", "sensors") else names)


def _replaced(text: str, names: dict[str, str]) -> str:
    return re.sub(r"(?<![\w-])[a-z_]+(?![\w-])", lambda found: names.get(found[0], found[0]), text)
