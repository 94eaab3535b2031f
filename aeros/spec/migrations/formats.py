"""Registry of the file formats that AEROS writes or reads.

To change a format: append a `Version` with its step here, let reader and writer follow, regenerate
docs/formats.md (`AEROS_UPDATE_GOLDEN=1 pytest tests/repo/pages/test_formats_page.py`).
"""

from __future__ import annotations

from typing import Final

from aeros.spec.migrations import checkpoint, crashes, manifest, renamed_names
from aeros.spec.migrations.format import Format, Kind, Version
from aeros.spec.migrations.yaml_edits import yaml_step

_FIRST: Final = (Version("the first version"),)
_AT_OPEN: Final = "open it with this AEROS: it migrates itself"

ECM: Final = Format(
    name="ecm",
    title="module manifest",
    files=("ecm.yaml",),
    kind=Kind.YAML,
    versions=(
        *_FIRST,
        Version(
            "`between_tries` runs between two tries, as `on_failure` did, which runs after the last one now; "
            "models of kind `model` or `tool` are files",
            manifest.to_2,
        ),
    ),
)
SITE: Final = Format("site", "site file, policy included", (), Kind.YAML, _FIRST)
OVERLAY: Final = Format("overlay", "overlay on a site file", (), Kind.YAML, _FIRST)
PEOPLE: Final = Format("people", "people file", (), Kind.YAML, _FIRST)
FAULTS: Final = Format("faults", "faults file", (), Kind.YAML, _FIRST)
ROBOT: Final = Format("robot", "robot file", (), Kind.YAML, _FIRST)
SCENE: Final = Format(
    name="scene",
    title="scene file",
    files=(),
    kind=Kind.YAML,
    versions=(
        *_FIRST,
        Version(
            "a whole scene: robot, places, cameras, instruments and truth may stand beside the bodies",
            yaml_step("aeros/scene/2", lambda text: text),
        ),
    ),
)
TESTS: Final = Format("tests", "tests of a site", (), Kind.YAML, _FIRST)
CERTIFICATE: Final = Format(
    name="certificate",
    title="certificate of a module",
    files=("ecm.lock",),
    kind=Kind.JSON,
    versions=_FIRST,
    keys=frozenset({"schema", "digest", "module"}),
    cure="run `aeros verify` on the module, which proves it again and writes the certificate",
)
CHECKPOINT: Final = Format(
    name="checkpoint",
    title="state folder: task to be resumed",
    files=("checkpoint.json", "checkpoint.previous.json"),
    kind=Kind.JSON,
    versions=(
        Version("the first version"),
        Version("keeps `barred`, the actions that may have happened before a crash", checkpoint.to_2),
        Version("keeps `ended`, the report of a task that has ended", checkpoint.to_3),
        Version("names its fields as the code does now: `uncertain_steps` was `barred`", checkpoint.to_4),
        Version(
            "keeps `errand` and `earlier_reports`: an instruction may ask for several tasks", checkpoint.to_5
        ),
        Version("plans say apart what runs between two tries and after the last one", checkpoint.to_6),
        Version("keeps `repeated_failures`, which chance does not explain", checkpoint.to_7),
        Version("says of a failure if it is a verdict: why no other try can succeed", checkpoint.to_8),
        Version("says of a report if its request was skipped, as `otherwise` depends on it", checkpoint.to_9),
    ),
    keys=frozenset({"schema", "digest", "body"}),
    is_numbered=True,
)
RUN: Final = Format(
    name="run",
    title="state folder: arguments of a watched run",
    files=("run.json",),
    kind=Kind.JSON,
    versions=(
        *_FIRST,
        Version("options of `aeros run` have the names below", renamed_names.run_options_to_2),
        Version("`--film` and `--no-film` have their names", renamed_names.run_options_to_3),
    ),
    keys=frozenset({"instruction", "state"}),
)
LATEST_RUN: Final = Format(
    name="latest-run",
    title="state folder: output folder of the latest run",
    files=("latest-run.json",),
    kind=Kind.JSON,
    versions=_FIRST,
    keys=frozenset({"out", "pid"}),
)
IDENTITY: Final = Format(
    name="identity",
    title="state folder: name and id of the agent",
    files=("identity.json",),
    kind=Kind.JSON,
    versions=_FIRST,
    keys=frozenset({"id", "name", "created", "sessions"}),
)
PHASE: Final = Format(
    name="phase",
    title="state folder: phase of the agent's life",
    files=("phase.json",),
    kind=Kind.JSON,
    versions=_FIRST,
    keys=frozenset({"phase"}),
)
QUARANTINE: Final = Format(
    name="quarantine",
    title="state folder: reason of a quarantine",
    files=("quarantine.json",),
    kind=Kind.JSON,
    versions=_FIRST,
    keys=frozenset({"since", "reason"}),
)
CRASHES: Final = Format(
    name="crashes",
    title="state folder: recent crashes",
    files=("crashes.json",),
    kind=Kind.JSON,
    versions=(
        Version("the first version: a list"),
        Version("an object with `schema` and `crashes`", crashes.to_2),
    ),
)
TRIALS: Final = Format(
    name="trial",
    title="finished trials of an experiment",
    files=("trials.jsonl", "finished-*.jsonl"),
    kind=Kind.JSON_LINES,
    versions=_FIRST,
    keys=frozenset({"condition", "seed", "found"}),
)
RESULTS: Final = Format(
    name="experiments",
    title="results of an experiment",
    files=("results.json",),
    kind=Kind.JSON,
    versions=_FIRST,
    keys=frozenset({"schema", "experiments"}),
)
TRACE: Final = Format(
    name="trace",
    title="events of a run, as the agent reported them",
    files=("trace.jsonl",),
    kind=Kind.JSON_LINES,
    versions=(*_FIRST, Version("events have the names below", renamed_names.trace_to_2)),
    keys=frozenset({"time", "kind", "text", "details"}),
)
MEASURED: Final = Format(
    name="measured",
    title="measured state of a run",
    files=("measured.jsonl",),
    kind=Kind.JSON_LINES,
    versions=_FIRST,
    keys=frozenset({"time", "state"}),
)
POSES: Final = Format(
    name="poses",
    title="poses of a run, from which `aeros film` makes a film",
    files=("poses.jsonl",),
    kind=Kind.JSON_LINES,
    versions=_FIRST,
    keys=frozenset({"schema", "actors"}),
)
PLANT_LOG: Final = Format(
    name="plant-log",
    title="log of the process that serves a plant",
    files=("plant.jsonl",),
    kind=Kind.JSON_LINES,
    versions=(*_FIRST, Version("events have the names below", renamed_names.plant_log_to_2)),
    keys=frozenset({"time", "event"}),
)
MEMORY: Final = Format(
    name="memory-database",
    title="state folder: memory of the agent",
    files=("memory.sqlite3",),
    kind=Kind.DATABASE,
    versions=(
        Version("the first version"),
        Version("episodes have a context and a flag: counted as evidence"),
        Version("episodes keep the causes of a failure as data"),
        Version("events have the names below"),
        Version("sessions name their plant, and episodes the code of their module"),
        Version("keeps what was seen: the first and latest value of each variable in each session"),
        Version("what was seen of a thing names the variables that it follows from"),
    ),
    cure=_AT_OPEN,
)
REGISTRY: Final = Format(
    name="registry-database",
    title="modules that are installed, and operator's blocks",
    files=("registry.sqlite3",),
    kind=Kind.DATABASE,
    versions=(
        Version("the first version"),
        Version("changes are in an audit log of their own, and not in a table"),
        Version("blocks have versions and digests; says which modules the operator withdrew"),
        Version("modules have bindings and parameters"),
        Version("blocks have channels and devices"),
    ),
    cure="remove the registry's folder and install the modules again; versions 2 to 4 are read, and migrate "
    "themselves",
)
AUDIT: Final = Format(
    name="audit",
    title="audit record",
    files=("audit.jsonl",),
    kind=Kind.OTHER,
    versions=_FIRST,
    cure="keep it: a signed chain is never rewritten",
)
AUDIT_CHECKPOINT: Final = Format(
    name="audit-checkpoint",
    title="signed checkpoint in an audit record, and anchor",
    files=(),
    kind=Kind.OTHER,
    versions=_FIRST,
    cure="keep it: a signature is never rewritten",
)

FORMATS: Final = (
    *(ECM, SITE, OVERLAY, PEOPLE, FAULTS, ROBOT, SCENE, TESTS),
    CERTIFICATE,
    *(CHECKPOINT, RUN, LATEST_RUN, IDENTITY, PHASE, QUARANTINE, CRASHES, MEMORY),
    REGISTRY,
    *(AUDIT, AUDIT_CHECKPOINT),
    *(TRACE, MEASURED, POSES, PLANT_LOG),
    *(TRIALS, RESULTS),
)
"""Every format that has versions."""


def format_named(name: str) -> Format:
    """Look up a format.

    Args:
        name: name of a format in `FORMATS`.

    Returns:
        The format.

    Raises:
        StopIteration: there is no such format.
    """
    return next(format_ for format_ in FORMATS if format_.name == name)
