"""Ends its process before it is a skill."""

from __future__ import annotations

import os

from aeros.skill import act

os._exit(0)
act("never")
