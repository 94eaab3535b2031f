"""Ed25519 keys of the audit log: made, read, signed and checked with.  The sole importer of `cryptography`.

`cryptography` is the extra `audit` of this distribution; whoever signs nothing need not have it.
Files are PEM, so that OpenSSL and others read them too.
"""

from __future__ import annotations

import hashlib
import os
import stat
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey

PUBLIC_SUFFIX: Final = ".pub"
_OWNER_ONLY: Final = 0o600
_MISSING: Final = "signing needs the package `cryptography`: pip install 'aeros[audit]'"


class InvalidKeyError(Exception):
    """A key that is not there, is none, or is open to others; the message says which."""


class PublicKey:
    """Checks signatures.  `id` is the SHA-256 of the raw key, in hexadecimal."""

    def __init__(self, key: Ed25519PublicKey) -> None:
        self._key = key
        self.id = hashlib.sha256(key.public_bytes_raw()).hexdigest()

    def verify(self, signature: str, message: bytes) -> bool:
        """Whether `signature`, in hexadecimal, is this key's over `message`."""
        from cryptography.exceptions import InvalidSignature

        try:
            raw = bytes.fromhex(signature)
            self._key.verify(raw, message)
        except (ValueError, InvalidSignature):
            return False
        return raw.hex() == signature  # one signature has one spelling


class SigningKey:
    """Signs; `public` checks what it signed."""

    def __init__(self, key: Ed25519PrivateKey) -> None:
        self._key = key
        self.public = PublicKey(key.public_key())

    def sign(self, message: bytes) -> str:
        """The signature over `message`, in hexadecimal."""
        return self._key.sign(message).hex()


def make_key(path: Path) -> Path:
    """Write a new private key to `path`, readable by its owner alone; the path of its public key.

    Raises `InvalidKeyError` where either is there already: a key that is gone can never sign again.
    """
    try:
        from cryptography.hazmat.primitives import serialization as form
        from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
    except ImportError as missing:
        raise InvalidKeyError(_MISSING) from missing
    key = Ed25519PrivateKey.generate()
    private = key.private_bytes(form.Encoding.PEM, form.PrivateFormat.PKCS8, form.NoEncryption())
    public = key.public_key().public_bytes(form.Encoding.PEM, form.PublicFormat.SubjectPublicKeyInfo)
    public_path = path.with_name(path.name + PUBLIC_SUFFIX)
    if public_path.exists():
        raise InvalidKeyError(f"`{public_path}` is there already")
    _write_new(path, private, _OWNER_ONLY)
    _write_new(public_path, public, 0o644)
    return public_path


def read_signing_key(path: Path) -> SigningKey:
    """The private key at `path`; refused where its group or others may read or write it."""
    try:
        from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
        from cryptography.hazmat.primitives.serialization import load_pem_private_key
    except ImportError as missing:
        raise InvalidKeyError(_MISSING) from missing
    content = _read(path)
    if stat.S_IMODE(path.stat().st_mode) & 0o077:
        raise InvalidKeyError(f"`{path}` is open to others than its owner: chmod 600 it")
    try:
        key = load_pem_private_key(content, password=None)
    except (ValueError, TypeError) as error:
        raise InvalidKeyError(f"`{path}` is not a private key without a password, as PEM") from error
    if not isinstance(key, Ed25519PrivateKey):
        raise InvalidKeyError(f"`{path}` is a key, but not an Ed25519 one")
    return SigningKey(key)


def read_public_key(path: Path) -> PublicKey:
    """The public key at `path`."""
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
        return path.read_bytes()
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
