"""Nothing acts for a module that is not active: theorem 8."""

from __future__ import annotations

from typing import Final

from aeros.spec.theorems.module_copies import Mutant
from aeros.spec.theorems.theorem import Theorem
from proofs.lib.loops import loops_of
from proofs.lifecycle.changer import transaction_obligations
from proofs.lifecycle.executor import GOVERNOR, SCHEDULER, executor_obligations
from proofs.lifecycle.registry_changes import RUN_MODULES, change_obligations
from proofs.lifecycle.revocation import CONTROL_PAGE, REGISTRY_STORE, TRANSACTION, revocation_obligations
from proofs.lifecycle.table import (
    INSTALLED,
    LIFECYCLE,
    PROVING,
    REGISTRY,
    WAITING,
    table_obligations,
)

_LOOPS: Final = loops_of(
    "aeros.runtime.proving",
    "aeros.runtime.execution.scheduler",
    "aeros.runtime.execution.governor",
    "aeros.runtime.execution.prepare",
    "aeros.runtime.registry.installed",
    "aeros.runtime.registry.lifecycle",
    "aeros.runtime.registry.proof_memory",
    "aeros.runtime.registry.registry",
    "aeros.runtime.registry.run_modules",
    "aeros.runtime.registry.store",
    "aeros.runtime.registry.transaction",
    "aeros.runtime.registry.waiting_modules",
    "aeros.runtime.registry.control_page",
)

THEOREM = Theorem(
    "only skills of active modules are dispatched, and nothing revoked moves after a change has returned",
    {
        **table_obligations(),
        **executor_obligations(),
        **transaction_obligations(),
        **change_obligations(),
        **revocation_obligations(),
        "loops": _LOOPS,
    },
    (
        Mutant(
            "removes-what-is-active",
            "history-step",
            LIFECYCLE,
            "(ModuleState.INSTALLED, LifecycleAction.REMOVE): ModuleState.ABSENT,",
            "(ModuleState.INSTALLED, LifecycleAction.REMOVE): ModuleState.ABSENT,\n"
            "    (ModuleState.ACTIVE, LifecycleAction.REMOVE): ModuleState.ABSENT,",
        ),
        Mutant(
            "activates-what-is-not-configured",
            "history-step",
            LIFECYCLE,
            "(ModuleState.CONFIGURED, LifecycleAction.ACTIVATE): ModuleState.ACTIVE,",
            "(ModuleState.INSTALLED, LifecycleAction.ACTIVATE): ModuleState.ACTIVE,",
        ),
        Mutant(
            "puts-in-force-what-is-configured",
            "in-force",
            INSTALLED,
            "active = {name for name, one in new.modules.items() if one.state is ModuleState.ACTIVE}",
            "active = {name for name, one in new.modules.items() if one.state is not ModuleState.ABSENT}",
        ),
        Mutant(
            "puts-in-force-what-is-not-what-was-proved",
            "in-force",
            PROVING,
            "certificate.obligations, certificate.engines) != certificate:",
            "certificate.obligations, certificate.engines) != certificate and False:",
        ),
        Mutant(
            "begins-what-was-revoked-while-the-skill-computed",
            "begins",
            SCHEDULER,
            "if not in_force or action is None:",
            "if action is None:",
        ),
        Mutant(
            "goes-on-with-what-was-bound-before",
            "begins",
            GOVERNOR,
            "return now is not None and (now.manifest_digest, now.code_digest, now.configuration) == was",
            "return now is not None and (now.manifest_digest, now.code_digest) == was[:2]",
        ),
        Mutant(
            "takes-over-under-what-moves",
            "follows",
            GOVERNOR,
            "(followed == self._governor.generation or self._is_moving())",
            "followed == self._governor.generation",
        ),
        Mutant(
            "goes-on-while-a-module-is-kept",
            "goes-on",
            RUN_MODULES,
            "is_active = one is not None and one.state is ModuleState.ACTIVE",
            "is_active = one is not None",
        ),
        Mutant(
            "goes-on-in-a-folder-although-withdrawn",
            "goes-on",
            RUN_MODULES,
            "if module in now.withdrawn or (is_installed and not is_active):",
            "if is_installed and not is_active:",
        ),
        Mutant(
            "deactivates-without-withdrawing",
            "history-step",
            REGISTRY,
            "if verb in (LifecycleAction.DEACTIVATE, LifecycleAction.REMOVE):\n        return before",
            "if verb is LifecycleAction.REMOVE:\n        return before",
        ),
        Mutant(
            "leaves-configured-what-waits-under-a-policy",
            "history-policy",
            WAITING,
            "changed = {name: one for name, one in after.items() if one is not None}",
            "changed = {}",
        ),
        Mutant(
            "leaves-active-what-waits-under-a-policy",
            "history-policy",
            WAITING,
            "    if active:\n        reasons",
            "    if False:\n        reasons",
        ),
        Mutant(
            "activates-a-version-that-waits",
            "history-step",
            REGISTRY,
            "if command else new",
            "if False else new",
        ),
        Mutant(
            "activates-at-once-what-waits",
            "history-step",
            REGISTRY,
            "    if command:\n        if one.state",
            "    if False:\n        if one.state",
        ),
        Mutant(
            "installs-before-it-activates",
            "history-step",
            REGISTRY,
            "                new = _installed(old, one, source, command, active)\n",
            "                self._transactions.commit(old, _with_module(old, one), id_, None)\n"
            "                new = _installed(old, one, source, command, active)\n",
        ),
        Mutant(
            "activates-at-once-and-leaves-withdrawn",
            "history-step",
            REGISTRY,
            "withdrawn=_withdrawn(new.withdrawn, one.name, LifecycleAction.ACTIVATE)",
            "withdrawn=new.withdrawn",
        ),
        Mutant(
            "keeps-what-it-has-not-recorded",
            "commit",
            TRANSACTION,
            "record_change(self.folder, self._key, old, new, description, configuration.digest)\n",
            "pass\n",
        ),
        Mutant(
            "writes-before-the-transaction",
            "transaction",
            REGISTRY_STORE,
            'database.execute("BEGIN IMMEDIATE")\n',
            'database.execute("DELETE FROM policy")\n            database.execute("BEGIN IMMEDIATE")\n',
        ),
        Mutant(
            "forgets-what-an-unfinished-change-left-moving",
            "agreeing-change",
            TRANSACTION,
            "if not is_older_still:",
            "if False:",
        ),
        Mutant(
            "keeps-a-change-before-it-tells-of-it",
            "agreeing-change",
            TRANSACTION,
            "live.publish(new.generation)\n        try:\n            self._records.replace(new)\n",
            "try:\n            self._records.replace(new)\n            live.publish(new.generation)\n",
        ),
        Mutant(
            "follows-what-was-read-while-it-changed",
            "agreeing-claim",
            TRANSACTION,
            "if snapshot.generation == live.generation:",
            "if snapshot.generation <= live.generation:",
        ),
        Mutant(
            "looks-before-it-takes-the-lock",
            "agreeing-act",
            CONTROL_PAGE,
            "        fcntl.flock(lock, fcntl.LOCK_SH)\n        try:\n"
            "            yield self.generation == generation\n",
            "        latest = self.generation\n        fcntl.flock(lock, fcntl.LOCK_SH)\n        try:\n"
            "            yield latest == generation\n",
        ),
        Mutant(
            "looks-at-two-blocks-only",
            "loops",
            "aeros.runtime.registry.run_modules",
            "        for block in now.blocks.values():\n",
            "        for block in list(now.blocks.values())[:2]:\n",
        ),
    ),
)
