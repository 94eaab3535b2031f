"""Migration steps of `checkpoint.json`: the body is JSON in a string, next to the digest of that string."""

from __future__ import annotations

import hashlib
import json
from typing import NoReturn

from aeros.spec.migrations.format import UnmigratableError


def to_2(_text: str) -> NoReturn:
    """Refuse: version 1 did not keep `barred`, and without it an action could be done twice.

    Args:
        _text: checkpoint of version 1.

    Returns:
        Nothing: it always raises.

    Raises:
        UnmigratableError: always.
    """
    raise UnmigratableError(
        "version 1 did not keep which actions may have happened before a crash, so the task cannot be "
        "resumed safely; start it anew, without `--resume`"
    )


def to_3(text: str) -> str:
    """Add `ended`, null: version 2 kept checkpoints only of tasks that had not ended.

    Args:
        text: checkpoint of version 2.

    Returns:
        The checkpoint in version 3.

    Raises:
        UnmigratableError: it is damaged.
    """
    try:
        envelope = json.loads(text)
        body = envelope["body"]
        if hashlib.sha256(body.encode()).hexdigest() != envelope["digest"]:
            raise UnmigratableError("it is damaged: its digest is another")
        checkpoint = {**json.loads(body), "ended": None}
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise UnmigratableError("it is damaged: it is not laid out as a checkpoint is") from error
    body = json.dumps(checkpoint, sort_keys=True, allow_nan=False)
    digest = hashlib.sha256(body.encode()).hexdigest()
    return json.dumps({"schema": 3, "digest": digest, "body": body}, indent=1)
