"""The commands of `aeros` in five groups: the module of each below `aeros.cli`, and a summary."""

from __future__ import annotations

from typing import Final, NamedTuple


class CommandEntry(NamedTuple):
    """A command.

    Attributes:
        module: of its code, below `aeros.cli`; imported only to run a command of it.
        summary: one line for lists of commands.
    """

    module: str
    summary: str


class CommandGroup(NamedTuple):
    """Commands for one kind of work.

    Attributes:
        summary: one line that says for whom or which work.
        commands: by name.
    """

    summary: str
    commands: dict[str, CommandEntry]


GROUPS: Final[dict[str, CommandGroup]] = {
    "author": CommandGroup(
        "write modules and prove them",
        {
            "new": CommandEntry(
                "author.new.command",
                "create a module, a site, checks in CI or a whole project from a template",
            ),
            "verify": CommandEntry("author.verify", "prove modules safe under a site's policy"),
            "fmt": CommandEntry("author.fmt", "write manifests, sites and scenes in one layout"),
            "explain": CommandEntry("author.explain", "explain a diagnostic code"),
            "test": CommandEntry(
                "author.site_tests.command", "compare decisions and verdicts with those that tests expect"
            ),
            "diff": CommandEntry(
                "author.diff", "compare two policies: newly allowed and newly denied actions"
            ),
            "plan": CommandEntry(
                "author.plan", "plan for a goal from declared preconditions and outcomes, without running it"
            ),
            "predict": CommandEntry(
                "author.predict", "compute a task's success probability and expected work exactly"
            ),
            "graph": CommandEntry(
                "author.graph", "draw a task's planning rules, its closed loop or a composition"
            ),
            "look": CommandEntry(
                "author.look", "run a module's perceivers once on a simulated scene, beside the truth"
            ),
            "site": CommandEntry(
                "author.site", "list the names of a site: volumes, cameras, variables, actions, limits"
            ),
            "schema": CommandEntry(
                "author.schema", "print the JSON Schema of the files that people write, and of reports"
            ),
            "bundle": CommandEntry("robot.modules", "pack a module into one file"),
        },
    ),
    "run": CommandGroup(
        "run instructions, and read the record of a run",
        {
            "run": CommandEntry("run.run", "run an instruction on a plant"),
            "demo": CommandEntry(
                "project.demo",
                "prove and run the modules that come with AEROS, on the best simulator here",
            ),
            "tasks": CommandEntry(
                "run.tasks", "list the tasks that can be asked for, or show how an instruction is understood"
            ),
            "top": CommandEntry("top.top", "show a live view of a run"),
            "live": CommandEntry("records.live", "serve the page of the run under way to a browser here"),
            "why": CommandEntry(
                "records.why", "explain why a run failed, a step was denied or the robot stopped"
            ),
            "report": CommandEntry("records.report", "write a finished run as one HTML page"),
            "film": CommandEntry("records.film", "make a film of a finished run"),
            "audit": CommandEntry("records.audit", "verify, show and replay the audit log of a run"),
            "decide": CommandEntry("run.decide", "decide action requests, one per line of JSON"),
        },
    ),
    "robot": CommandGroup(
        "change the modules and the policy of this robot, pause and stop it, read its memory",
        {
            "install": CommandEntry("robot.modules", "install a module on this robot"),
            "configure": CommandEntry(
                "robot.modules", "bind what an installed module needs, and set its parameters"
            ),
            "activate": CommandEntry("robot.modules", "activate a module so that its skills can run"),
            "deactivate": CommandEntry(
                "robot.modules", "deactivate a module so that none of its skills runs"
            ),
            "remove": CommandEntry("robot.modules", "uninstall a module"),
            "list": CommandEntry("robot.modules", "list the modules installed on this robot"),
            "policy": CommandEntry("robot.operator", "set the site policy, or show it"),
            "block": CommandEntry(
                "robot.operator", "deny all actions of a module, a skill or an action kind"
            ),
            "unblock": CommandEntry("robot.operator", "remove a block"),
            "repair": CommandEntry(
                "robot.operator", "put the registry's last recorded change in force again"
            ),
            "pause": CommandEntry("robot.operator", "pause: no new action starts until `aeros resume`"),
            "resume": CommandEntry("robot.operator", "let actions start again"),
            "stop": CommandEntry("robot.operator", "stop all motion and end the run"),
            "release": CommandEntry("robot.operator", "lift the quarantine of a crashed agent"),
            "world": CommandEntry(
                "robot.world", "show what the agent last saw, with its age, and where things usually are"
            ),
            "memory": CommandEntry("robot.memory", "show, search, export or delete the agent's memory"),
        },
    ),
    "connect": CommandGroup(
        "connect other programs and other robots",
        {
            "mcp": CommandEntry("connect.mcp", "serve the robot to MCP clients"),
            "import": CommandEntry(
                "connect.import_trees", "turn a behaviour tree of another tool into a composition"
            ),
            "export": CommandEntry(
                "connect.export_trees", "write a composition as a behaviour tree of another tool"
            ),
            "serve": CommandEntry("connect.serve", "wait for instructions of other processes on ROS 2"),
            "ros2-messages": CommandEntry(
                "connect.ros2_messages", "build the ROS 2 message packages and install them here"
            ),
            "approve": CommandEntry("robot.approve", "list and approve requests of MCP clients"),
            "check-plant": CommandEntry(
                "robot.check_plant", "check that a plant keeps the promises of its interface"
            ),
        },
    ),
    "project": CommandGroup(
        "check this installation and AEROS itself",
        {
            "doctor": CommandEntry(
                "project.doctor", "show which parts of AEROS work here, and how to get the others"
            ),
            "completion": CommandEntry(
                "project.completion", "print the script by which a shell completes commands and options"
            ),
            "prove": CommandEntry("project.prove", "check the theorems about AEROS itself"),
            "experiment": CommandEntry(
                "project.experiment", "run seeded trials and compare them with exact predictions"
            ),
            "migrate": CommandEntry(
                "project.migrate", "rewrite files of older AEROS versions to the current format"
            ),
        },
    ),
}

COMMANDS: Final = {name: entry for group in GROUPS.values() for name, entry in group.commands.items()}

OFTEN_USED: Final = ("new", "verify", "run", "why", "doctor")
"""Commands that `aeros --help` explains; it only names the others."""

MODULES_OF_SEVERAL: Final = frozenset(("robot.modules", "robot.operator"))
"""Modules with several commands; their `add_to` also gets the command's name."""
