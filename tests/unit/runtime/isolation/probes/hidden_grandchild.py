"""Leaves a process behind that has a session of its own and no parent."""

from __future__ import annotations

import os
import time

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    if os.fork() == 0:
        os.setsid()
        if os.fork() == 0:
            with open(inputs["folder"] + "/grandchild", "w") as file:
                file.write(str(os.getpid()))
            while True:
                time.sleep(60)
        os._exit(0)
    time.sleep(0.5)
    return "left behind"
