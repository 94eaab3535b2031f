"""The scene of a task: of its own module first, then of AEROS."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from aeros.runtime.gate.configuration import Configuration
from aeros.session.scene_files import module_folders, scene_named, scene_of_task, scene_of_tasks
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.source import Source, SourceSpan
from tests.modules.robot import configuration_of
from tests.shipped_scenes import shipped_scene
from tests.unit.cli.staged import proved

FILE = """schema: aeros/scene/2
description: A module's own.
robot: {{mount: bench}}
view: {{eye: [1 m, 0 m, 1 m], target: [0 m, 0 m, 0 m]}}
bodies: {{{name}: {{box: [1 m, 1 m, 1 m], at: [3 m, 0 m, 0 m]}}}}
"""


def configuration(folder: Path) -> Configuration:
    """The module `tidy` in a folder with a scene `bare` of its own, and another module with `attic`."""
    (tmp := folder / "tidy" / "scenes").mkdir(parents=True)
    (tmp / "bare.yaml").write_text(FILE.format(name="own"))
    (other := folder / "other" / "scenes").mkdir(parents=True)
    (other / "attic.yaml").write_text(FILE.format(name="chest"))
    found = proved()[0]
    tidy = replace(found.modules["tidy"], folder=str(folder / "tidy"))
    stranger = replace(tidy, id="other", folder=str(folder / "other"), tasks={})
    return replace(found, modules={"other": stranger, "tidy": tidy})


def test_a_tasks_scene_is_that_of_its_module(tmp_path: Path) -> None:
    around = configuration(tmp_path)
    task = replace(around.modules["tidy"].tasks["clean_up"], scene="bare")
    assert [Path(folder).name for folder in module_folders(around, "tidy")] == ["tidy", "other"]
    assert list(scene_of_task(around, task).bodies) == ["own"]
    added = scene_of_task(around, task, "shelf_behind")
    assert list(added.bodies) == ["own", "shelf", "crate", "bottle"]


def test_a_scene_by_its_name_may_be_of_any_module_or_of_aeros(tmp_path: Path) -> None:
    around = configuration(tmp_path)
    assert list(scene_named(around, "attic").bodies) == ["chest"]
    assert scene_named(proved()[0], "bare") == shipped_scene("bare")
    with pytest.raises(UserError, match="has no `robot`"):
        scene_named(around, "shelf_behind")


def test_a_task_that_composes_others_and_names_no_scene_is_in_a_cell_of_their_scenes() -> None:
    shipped = {name: configuration_of(name).modules[name] for name in ("clean_table", "make_dumplings")}
    found = configuration_of("clean_table")
    tasks = {name: one.tasks[name] for name, one in shipped.items()}
    composing = replace(
        tasks["clean_table"],
        id="both",
        scene=None,
        span=SourceSpan(Source("x", "both"), 0, 4),
        composed=tasks,
    )
    end = replace(shipped["clean_table"], id="end_day", tasks={"both": composing}, folder="nowhere")
    around = replace(found, modules={**shipped, "end_day": end})
    whole = scene_of_task(around, composing)
    assert whole == scene_of_tasks(around, list(tasks.values()))
    assert {name.partition(".")[0] for name in whole.truth} == set(tasks)
    one = replace(composing, scene="table")
    assert scene_of_task(around, one) == scene_of_task(around, tasks["clean_table"])


@pytest.mark.parametrize("scene", [None, "cellar"])
def test_a_task_without_a_scene_is_refused_with_those_that_there_are(
    scene: str | None, tmp_path: Path
) -> None:
    around = configuration(tmp_path)
    task = replace(around.modules["tidy"].tasks["clean_up"], scene=scene)
    with pytest.raises(
        UserError, match=rf"scene of `clean_up` is `{scene}`, but there is only .*attic.*bare"
    ):
        scene_of_task(around, task)
