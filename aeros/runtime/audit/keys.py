"""Ed25519 keys of the audit log: create, read, sign, verify. The only importer of `cryptography`.

Key files are PEM, so that OpenSSL and others can read them.
"""

from __future__ import annotations

import hashlib
import os
import stat
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Final

from aeros.files import make_private_folder, open_regular, sync_folder, temporary_folder

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey

PUBLIC_SUFFIX: Final = ".pub"
_OWNER_ONLY: Final = 0o600
_MAX_KEY_BYTES: Final = 100_000
_MISSING: Final = "signing needs the package `cryptography`: pip install cryptography"


class InvalidKeyError(Exception):
    """A key file is missing, malformed or readable by others; the message says which."""


class PublicKey:
    """Public key that verifies signatures. `id` is the SHA-256 of the raw key, in hexadecimal."""

    def __init__(self, key: Ed25519PublicKey) -> None:
        self._key = key
        self.id = hashlib.sha256(key.public_bytes_raw()).hexdigest()

    def pem(self) -> bytes:
        """Encode the key as PEM.

        Returns:
            Contents of a key file.
        """
        from cryptography.hazmat.primitives import serialization as form

        return self._key.public_bytes(form.Encoding.PEM, form.PublicFormat.SubjectPublicKeyInfo)

    def verify(self, signature: str, message: bytes) -> bool:
        """Verify a signature of a message.

        Args:
            signature: in lower-case hexadecimal; other spellings are rejected.
            message: signed bytes.

        Returns:
            True if it is this key's signature of exactly these bytes.
        """
        from cryptography.exceptions import InvalidSignature

        try:
            raw = bytes.fromhex(signature)
            self._key.verify(raw, message)
        except (ValueError, InvalidSignature):
            return False
        return raw.hex() == signature  # one signature has one spelling


class SigningKey:
    """Private key that signs; `public` verifies its signatures."""

    def __init__(self, key: Ed25519PrivateKey) -> None:
        self._key = key
        self.public = PublicKey(key.public_key())

    def sign(self, message: bytes) -> str:
        """Sign a message.

        Args:
            message: bytes to sign.

        Returns:
            The signature in lower-case hexadecimal.
        """
        return self._key.sign(message).hex()


def make_key(path: Path) -> Path:
    """Create a key pair: a private key at `path`, readable by its owner alone, and a public key next to it.

    Args:
        path: file of the private key; `.pub` is appended for the public key.

    Returns:
        Path of the public key.

    Raises:
        InvalidKeyError: either file exists, as an overwritten key can never sign again; a file cannot be
            written; or `cryptography` is not installed.
    """
    try:
        from cryptography.hazmat.primitives import serialization as form
        from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
    except ImportError as missing:
        raise InvalidKeyError(_MISSING) from missing
    key = Ed25519PrivateKey.generate()
    private = key.private_bytes(form.Encoding.PEM, form.PrivateFormat.PKCS8, form.NoEncryption())
    public_path = path.with_name(path.name + PUBLIC_SUFFIX)
    if public_path.exists():
        raise InvalidKeyError(f"`{public_path}` exists already")
    _write_new(path, private, _OWNER_ONLY)
    _write_new(public_path, PublicKey(key.public_key()).pem(), 0o644)
    return public_path


def ensure_key(path: Path) -> Path:
    """Create a key pair at `path` unless there was one; several processes may do so at once.

    Args:
        path: file of the private key; its folder is created for its owner alone.

    Returns:
        `path`.

    Raises:
        InvalidKeyError: there is a public key without its private key, so a key was lost; a file cannot be
            written; or `cryptography` is not installed.
    """
    public_path = path.with_name(path.name + PUBLIC_SUFFIX)
    try:
        if path.exists() and public_path.exists():
            return path
        if public_path.exists():
            raise lost_key_error(path, f"`{public_path}` is left of it")
        make_private_folder(path.parent)
        with temporary_folder(path.parent) as folder:  # beside the key, so that it can be linked
            made = folder / path.name
            make_key(made)
            # Of several processes one wins, with a complete file; the public key follows from its key.
            with suppress(FileExistsError):
                os.link(made, path)
            public = made.with_name(public_path.name)
            public.write_bytes(read_signing_key(path).public.pem())
            public.replace(public_path)
            sync_folder(path.parent)
    except OSError as error:
        raise InvalidKeyError(f"the key `{path}` cannot be made: {error.strerror}") from error
    return path


def lost_key_error(path: Path, evidence: str) -> InvalidKeyError:
    """Make the error for a key that is gone, which a new one must not replace unnoticed.

    Args:
        path: file of the private key.
        evidence: sign that there was a key, in words.

    Returns:
        The error, with what helps.
    """
    return InvalidKeyError(
        f"the key `{path}` is gone: {evidence}. Restore it from a backup. To begin with a new key, follow "
        "docs/audit.md, section `A lost key`"
    )


def find_public_key(path: Path) -> PublicKey | None:
    """Read the public key of a key pair: from the private key, or else from its own file.

    Args:
        path: file of the private key.

    Returns:
        The key; None if there is neither file.

    Raises:
        InvalidKeyError: a file is there and cannot be read or used.
    """
    if path.exists():
        return read_signing_key(path).public
    public_path = path.with_name(path.name + PUBLIC_SUFFIX)
    return read_public_key(public_path) if public_path.exists() else None


def read_signing_key(path: Path) -> SigningKey:
    """Read a private key.

    Args:
        path: PEM file without password.

    Returns:
        The key.

    Raises:
        InvalidKeyError: the file cannot be read, its group or others have access, it is not an Ed25519
            key, or `cryptography` is not installed.
    """
    try:
        from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
        from cryptography.hazmat.primitives.serialization import load_pem_private_key
    except ImportError as missing:
        raise InvalidKeyError(_MISSING) from missing
    content = _read(path)
    if stat.S_IMODE(path.stat().st_mode) & 0o077:
        raise InvalidKeyError(f"`{path}` is accessible to other users; run `chmod 600` on it")
    try:
        key = load_pem_private_key(content, password=None)
    except (ValueError, TypeError) as error:
        raise InvalidKeyError(f"`{path}` is not a private key without a password, as PEM") from error
    if not isinstance(key, Ed25519PrivateKey):
        raise InvalidKeyError(f"`{path}` is a key, but not an Ed25519 one")
    return SigningKey(key)


def read_public_key(path: Path) -> PublicKey:
    """Read a public key.

    Args:
        path: PEM file.

    Returns:
        The key.

    Raises:
        InvalidKeyError: the file cannot be read, is not an Ed25519 key, or `cryptography` is not installed.
    """
    try:
        from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
        from cryptography.hazmat.primitives.serialization import load_pem_public_key
    except ImportError as missing:
        raise InvalidKeyError(_MISSING) from missing
    try:
        key = load_pem_public_key(_read(path))
    except ValueError as error:
        raise InvalidKeyError(f"`{path}` is not a public key, as PEM") from error
    if not isinstance(key, Ed25519PublicKey):
        raise InvalidKeyError(f"`{path}` is a public key, but not an Ed25519 one")
    return PublicKey(key)


def _read(path: Path) -> bytes:
    try:
        with open_regular(path) as file:
            return file.read(_MAX_KEY_BYTES)
    except OSError as error:
        raise InvalidKeyError(f"the key `{path}` cannot be read: {error.strerror}") from error


def _write_new(path: Path, content: bytes, mode: int) -> None:
    try:
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, mode)
        with os.fdopen(file, "wb") as opened:
            opened.write(content)
            opened.flush()
            os.fsync(opened.fileno())
    except OSError as error:
        raise InvalidKeyError(f"`{path}` cannot be written: {error.strerror}") from error
