"""Blocks of the operator: actions that no run on a robot may execute.

A block names them by module, version, digest, skill, kind, the channel of a tool, or a computing device.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

from aeros.spec.diagnostics.characters import describe_character, is_hidden
from aeros.spec.diagnostics.codes import quoted
from aeros.spec.model.policy import OperatorOverride
from aeros.spec.text.fields import MAX_NAME, PATTERNS
from aeros.spec.text.versions import is_compatible_version, parse_range, parse_version

UNKNOWN_DIGEST: Final = ""
"""Digest of a module whose files could not be read as one bundle; any block by digest applies to it."""

MAX_REASON: Final = 1000
"""Limit on the characters of a reason."""

_BLOCK_ID: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")
_DIGEST: Final = re.compile(r"[0-9a-f]{64}")


class ModuleIdentity(NamedTuple):
    """Version and contents of a module, as a run has loaded it.

    Attributes:
        version: its version.
        digest: SHA-256 over all its files, in hexadecimal; UNKNOWN_DIGEST if they are not one bundle.
        devices: computing devices that it asks for; None if that is unknown, and any block by device applies.
    """

    version: str
    digest: str
    devices: frozenset[str] | None = None


@dataclass(frozen=True)
class OperatorBlock:
    """Block that an operator put on this robot.

    Attributes:
        id: name of the block.
        reason: the operator's reason, as denials quote it.
        module, skill, action: module, skill and action kind that it blocks; None blocks all of them.
        version: versions of `module` that it blocks, a PEP 440 specifier; None blocks all of them.
        digest: SHA-256 over the files of a module that it blocks, in hexadecimal; None blocks any.
        channel: channel whose tools it blocks, a word of the site; None blocks all actions.
        device: computing device; modules that ask for it are blocked. None blocks any module.
    """

    id: str
    reason: str
    module: str | None
    skill: str | None
    action: str | None
    version: str | None = None
    digest: str | None = None
    channel: str | None = None
    device: str | None = None

    def applies_to(self, name: str, identity: ModuleIdentity) -> bool:
        """Say if the block concerns actions of a module at all.

        Args:
            name: id of the module.
            identity: version and digest that the run has loaded.

        Returns:
            True if module, version, digest and device match; unknown ones of a module match.
        """
        return (
            self.module in (None, name)
            and (self.version is None or _is_version_in(identity.version, self.version))
            and (self.digest is None or identity.digest in (self.digest, UNKNOWN_DIGEST))
            and (self.device is None or identity.devices is None or self.device in identity.devices)
        )

    def matches(
        self, name: str, identity: ModuleIdentity, skill: str, action: str, channels: Collection[str]
    ) -> bool:
        """Say if the block denies an action.

        Args:
            name: id of the module that asks for it.
            identity: version and digest that the run has loaded.
            skill: skill that asks for it.
            action: action kind.
            channels: channels that the action kind uses.

        Returns:
            True if every field matches.
        """
        return (
            self.applies_to(name, identity)
            and self.skill in (None, skill)
            and self.action in (None, action)
            and (self.channel is None or self.channel in channels)
        )

    def overrides(
        self, modules: Mapping[str, ModuleIdentity], channels: Mapping[str, Collection[str]]
    ) -> tuple[OperatorOverride, ...]:
        """Translate into overrides of the site, which know modules, skills and action kinds only.

        Args:
            modules: identity of each module that a run has loaded, by name.
            channels: channels of each action kind of the site, by name.

        Returns:
            The overrides that deny the same actions of these modules.
        """
        names: list[str | None] = [self.module]
        if any(part is not None for part in (self.version, self.digest, self.device)):
            names = [name for name, identity in modules.items() if self.applies_to(name, identity)]
        kinds: list[str | None] = [self.action]
        if self.channel is not None:
            kinds = [
                kind
                for kind, used in channels.items()
                if self.channel in used and self.action in (None, kind)
            ]
        return tuple(
            OperatorOverride(self.id, self.reason, name, self.skill, kind) for name in names for kind in kinds
        )

    @property
    def scope(self) -> str:
        """Description of the blocked actions, such as `module tidy, version <1.2`."""
        named = (
            ("module", self.module),
            ("version", self.version),
            ("digest", None if self.digest is None else f"sha256:{self.digest}"),
            ("skill", self.skill),
            ("action", self.action),
            ("channel", self.channel),
            ("device", self.device),
        )
        return ", ".join(f"{what} {value}" for what, value in named if value is not None)


def parse_block_id(text: str) -> str:
    """Read the id of a new block.

    Args:
        text: letters, digits, `-`, `_` and `.`, as in `press-under-repair`.

    Returns:
        The id.

    Raises:
        ValueError: it is none, or is too long.
    """
    if not _BLOCK_ID.fullmatch(text):
        raise ValueError(
            f"{quoted(text)} is no id: write letters, digits, `-`, `_` and `.`, as in worn-finger"
        )
    return _bounded(text, MAX_NAME)


def parse_reason(text: str) -> str:
    """Read the reason of a block.

    Args:
        text: one line, in words.

    Returns:
        The reason, without spaces around it.

    Raises:
        ValueError: it says nothing, is too long, or holds a character that a reader cannot see.
    """
    if not text.strip(" "):
        raise ValueError("write a reason, which denials will show")
    hidden = next((one for one in text if is_hidden(one)), None)
    if hidden is not None:
        raise ValueError(f"the character {describe_character(hidden)} is not allowed in a reason")
    return _bounded(text.strip(" "), MAX_REASON)


def parse_name(text: str) -> str:
    """Read the name of a module, skill or action kind, which need not exist.

    Args:
        text: a lower-case letter, then letters, digits and `_`.

    Returns:
        The name.

    Raises:
        ValueError: nothing can have that name.
    """
    form = PATTERNS["identifier"]
    if not form.regex.fullmatch(text):
        raise ValueError(f"nothing can be named {quoted(text)}: a name is {form.words}, as in {form.example}")
    return _bounded(text, MAX_NAME)


def _bounded(text: str, limit: int) -> str:
    if len(text) > limit:
        raise ValueError(f"{quoted(text)} has {len(text):,} characters; at most {limit:,} are allowed")
    return text


def parse_versions(text: str) -> str:
    """Read the versions of a block.

    Args:
        text: one version, as in `1.0.0`, or a PEP 440 specifier, as in `>=1.0,<1.2`.

    Returns:
        A specifier.

    Raises:
        ValueError: it is neither.
    """
    try:
        return f"=={parse_version(text)}"
    except ValueError:
        pass
    try:
        specifier = str(parse_range(text))
    except ValueError as error:
        words = f"is neither a version, as in 1.0.0, nor a range, as in <1.2; it {error}"
        raise ValueError(f"{quoted(text)} {words}") from error
    if not specifier:
        raise ValueError("name a version, as in 1.0.0, or a range, as in <1.2")
    return specifier


def parse_digest(text: str) -> str:
    """Read the digest of a module's files.

    Args:
        text: SHA-256 in hexadecimal, as `aeros list` prints it, with or without `sha256:`.

    Returns:
        The digest in hexadecimal.

    Raises:
        ValueError: it is none.
    """
    digest = text.removeprefix("sha256:").lower()
    if not _DIGEST.fullmatch(digest):
        raise ValueError(f"{quoted(text)} is no digest: 64 hexadecimal digits are needed, as in sha256:1234…")
    return digest


def _is_version_in(version: str, specifier: str) -> bool:
    try:
        return is_compatible_version(specifier, version)
    except ValueError:
        return True
