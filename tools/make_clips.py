"""Make the clips of the README: `make clips`, into docs/clips/.

Each clip is ten seconds of simulated physics, drawn by `aeros film`'s own code from what the run recorded:

- `dumpling.webp`: a dumpling from two sheets of dough to the pot, six times as fast as the run.
- `person.webp`: somebody walks in; the arm slows down, stops, and goes on.
- `gate.webp`: an adversarial module (`experiments/adversaries/rusher`, fast near people) and the same person,
  on the left with a gate that allows everything and without monitor, on the right behind AEROS's gate, of
  which nothing was proved. The bounds on the left are those that the site has, and nobody enforces.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np

from aeros.apps.film.run_captions import RunCaptions
from aeros.apps.report_page.run_data import read_run_data
from aeros.experiments.inputs import InputPaths, load_inputs
from aeros.experiments.open_gate import OpenGate, without_policy
from aeros.runtime.audit.log import AuditLog
from aeros.runtime.bus.sample_file import SampleWriter
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.gate import CompiledGate
from aeros.runtime.ports import StepRequest, StepStatus
from aeros.session.assembly import build_executor
from aeros.session.scene_files import scene_named
from aeros.sim.engine.people import Person, Waypoint
from aeros.sim.film.captions import Caption, Gauge, PersonSeparation
from aeros.sim.film.encoders import open_encoder
from aeros.sim.film.film import FilmFrames, FilmOptions
from aeros.sim.film.recorder import PoseRecorder
from aeros.sim.film.recording import read_recording
from aeros.sim.physics import make_plant
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm
from aeros.spec.model.site import Site

_ROOT: Final = Path(__file__).resolve().parent.parent
_CLIPS: Final = _ROOT / "docs" / "clips"
_ADVERSARY: Final = _ROOT / "experiments" / "adversaries" / "rusher"

_TASK: Final = "make dumplings"

_RATE: Final = 12
"""Pictures per second: clips are to be small."""

_SECONDS: Final = 10.0
_SIZE: Final = (640, 360)
_HALF: Final = (480, 360)
"""Width and height of a clip, and of each half of the one that compares, pixels."""

_GUEST: Final = Person(
    "guest",
    (
        Waypoint((3.2, -1.4), dwell=1.5),
        Waypoint((1.25, -0.1), speed=1.2, dwell=2.5),
        Waypoint((3.2, 1.6), speed=1.2),
    ),
    floor=-0.75,
)
"""Somebody who walks up to the arm at 1.2 m/s, stays and leaves."""

_NEEDED: Final = 0.886
_SLOW: Final = 2.3
"""Distances of people of the reference site's rules `arm-standing` and `reduced-speed-near-person`, m."""

_REDUCED: Final = 0.2
"""Speed of the tool near people that the second of these rules allows, m/s."""

_PATIENCE: Final = 1.0
"""Time after which the module asks again, s, as the agent of `aeros run` does."""


def make_clips(names: Sequence[str]) -> None:
    """Make clips.

    Args:
        names: names of clips without suffix; all if empty.
    """
    with TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for name in names or ("dumpling", "person", "gate"):
            path = _CLIPS / f"{name}.webp"
            match name:
                case "dumpling":
                    _clip_of_run(folder / name, path, (), FilmOptions(_SIZE, speed=6.0, title=_TASK))
                case "person":
                    people = ("--people", "at_the_bench")
                    film = FilmOptions(_SIZE, start=2.0, end=2.0 + _SECONDS, camera="fixed", title=_TASK)
                    _clip_of_run(folder / name, path, people, film)
                case "gate":
                    _clip_of_both_gates(folder, path)
                case _:
                    sys.exit(f"there is no clip `{name}`")
            print(f"{path.relative_to(_ROOT)}: {path.stat().st_size / 1e6:.2f} MB")


def _clip_of_run(out: Path, path: Path, options: Sequence[str], film: FilmOptions) -> None:
    """Run the dumpling task and film it."""
    command = [sys.executable, "-m", "aeros", "run", _TASK, *options]
    command += ["--out", str(out), "--state", f"{out}-agent", "--ecms", "ecms", "--unsigned"]
    subprocess.run(command, cwd=_ROOT, check=True, stdout=subprocess.DEVNULL)  # noqa: S603  our own command
    _write(path, film.size, _frames(out, film))


def _clip_of_both_gates(folder: Path, path: Path) -> None:
    site = load_inputs(InputPaths(str(_ROOT / "ecms"))).configuration.site
    halves = []
    for is_open, title in ((True, "adversarial module, no gate"), (False, "same module behind the gate")):
        out = folder / ("off" if is_open else "on")
        _run_adversary(out, is_open=is_open)
        options = FilmOptions(_HALF, camera="fixed", end=_SECONDS, title=title, has_insets=False)
        captions = _captions(out, site)
        shown = (lambda time, own=captions: _unchecked(own(time))) if is_open else captions
        halves.append(FilmFrames(read_recording(out / "poses.jsonl"), shown, options, _RATE))
    _write(path, (2 * _HALF[0], _HALF[1]), halves[0], halves[1])


def _unchecked(caption: Caption) -> Caption:
    """Say of an action that nobody decided it, and show the distances that the site demands of a slow arm."""
    if caption.separation is None:
        return caption
    measured = caption.separation.measured
    near = measured is not None and measured < _NEEDED
    return caption._replace(
        status="unchecked",
        headline=f"person at {measured:.2f} m, and the arm goes on" if near else "",
        separation=PersonSeparation(measured, _NEEDED, _SLOW),
        gauges=tuple(_with_bound(gauge, measured) for gauge in caption.gauges),
    )


def _with_bound(gauge: Gauge, person: float | None) -> Gauge:
    """Put the bound on a gauge that the site demands, and nobody enforces."""
    if gauge.label == "person":
        return gauge._replace(bound=_NEEDED)
    if gauge.unit == "m/s" and person is not None and person < _SLOW:
        return gauge._replace(bound=_REDUCED)
    return gauge


def _run_adversary(out: Path, *, is_open: bool) -> None:
    """Let the adversary ask for its motions again and again, with gate and monitor or without."""
    out.mkdir()
    premises = load_inputs(InputPaths(str(_ROOT / "ecms")))
    site = premises.configuration.site
    loaded = load_ecm(_ADVERSARY, site, Diagnostics())
    if loaded is None:
        raise AssertionError("the adversary is no module")
    configuration = Configuration(site, {loaded.ecm.id: loaded.ecm}, {}, "unproved")
    configuration = without_policy(configuration) if is_open else configuration
    gate = OpenGate(configuration) if is_open else CompiledGate(configuration)
    scene = scene_named(premises.configuration, "bare")
    recorder = PoseRecorder(out / "poses.jsonl")
    plant = make_plant(scene, 0, people=(_GUEST,), spectators=(recorder,))
    try:
        with (
            AuditLog(out / "audit.jsonl") as audit,
            SampleWriter(out / "measured.jsonl", site) as samples,
            build_executor(
                configuration, plant, audit, premises.skill_runs, gate=gate, listeners=(samples,)
            ) as executor,
        ):
            while executor.now() < _SECONDS:
                result = executor.run_step(StepRequest(loaded.ecm.id, "sweep", {"speed": 0.44}))
                if result.status is not StepStatus.FINISHED:
                    executor.wait(executor.now() + _PATIENCE)
    finally:
        plant.close()


def _frames(out: Path, options: FilmOptions) -> FilmFrames:
    """Return the pictures of a run, with the bounds of the reference site."""
    site = load_inputs(InputPaths(str(_ROOT / "ecms"))).configuration.site
    return FilmFrames(read_recording(out / "poses.jsonl"), _captions(out, site), options, _RATE)


def _captions(out: Path, site: Site) -> RunCaptions:
    run = read_run_data(out)
    return RunCaptions(run, {str(one.site): site for one in run.decisions})


def _write(path: Path, size: tuple[int, int], *films: FilmFrames) -> None:
    """Write films side by side."""
    path.parent.mkdir(exist_ok=True)
    encoder = open_encoder(path, size, _RATE)
    # Each has an OpenGL context of its own, so one is drawn after the other.
    for pictures in zip(*[list(film.pictures()) for film in films], strict=True):
        encoder.add(np.concatenate(pictures, axis=1))
    path.write_bytes(encoder.finish())


if __name__ == "__main__":
    make_clips(sys.argv[1:])
