from __future__ import annotations

import os
from base64 import b64decode
from collections.abc import Callable
from contextlib import AbstractContextManager
from hashlib import sha256
from pathlib import Path

import pytest

from aeros.files import temporary_folder
from aeros.runtime.audit.keys import (
    InvalidKeyError,
    PublicKey,
    SigningKey,
    ensure_key,
    find_public_key,
    make_key,
    read_public_key,
    read_signing_key,
)


def test_the_private_key_is_the_owners_alone_and_never_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "key"
    public = make_key(path)
    assert path.stat().st_mode & 0o777 == 0o600
    assert read_public_key(public).id == read_signing_key(path).public.id
    content = path.read_bytes()
    with pytest.raises(InvalidKeyError, match="exists already"):
        make_key(path)
    public.unlink()
    with pytest.raises(InvalidKeyError, match="cannot be written: File exists"):
        make_key(path)
    assert path.read_bytes() == content
    path.chmod(0o640)
    with pytest.raises(InvalidKeyError, match="is accessible to other users"):
        read_signing_key(path)


@pytest.mark.parametrize("read", [read_signing_key, read_public_key])
def test_a_file_that_is_not_a_key_is_refused(
    read: Callable[[Path], SigningKey | PublicKey], tmp_path: Path
) -> None:
    from cryptography.hazmat.primitives import serialization as form
    from cryptography.hazmat.primitives.asymmetric.ec import SECP256R1, generate_private_key

    path = tmp_path / "key"
    with pytest.raises(InvalidKeyError, match="cannot be read"):
        read(path)
    path.write_bytes(b"nonsense")
    path.chmod(0o600)
    with pytest.raises(InvalidKeyError, match="is not a p"):
        read(path)
    other = generate_private_key(SECP256R1())
    private = other.private_bytes(form.Encoding.PEM, form.PrivateFormat.PKCS8, form.NoEncryption())
    public = other.public_key().public_bytes(form.Encoding.PEM, form.PublicFormat.SubjectPublicKeyInfo)
    path.write_bytes(private if read is read_signing_key else public)
    with pytest.raises(InvalidKeyError, match="not an Ed25519 one"):
        read(path)


def test_without_cryptography_signing_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "cryptography.hazmat.primitives.asymmetric.ed25519", None)
    for refused in (make_key, read_signing_key, read_public_key):
        with pytest.raises(InvalidKeyError, match="pip install cryptography"):
            refused(tmp_path / "key")


@pytest.fixture
def key(tmp_path: Path) -> SigningKey:
    make_key(tmp_path / "own")
    return read_signing_key(tmp_path / "own")


def test_a_signature_is_of_one_message_and_one_key(key: SigningKey, tmp_path: Path) -> None:
    signature = key.sign(b"message")
    assert key.public.verify(signature, b"message")
    assert not key.public.verify(signature, b"massage")
    assert not read_public_key(make_key(tmp_path / "other")).verify(signature, b"message")


def test_a_signature_has_one_spelling(key: SigningKey) -> None:
    signature = key.sign(b"message")
    assert len(signature) == 128
    for other in (
        signature.upper(),
        f" {signature}",
        f"{signature[:2]} {signature[2:]}",
        signature[:-2],
        "",
        "xy",
    ):
        assert not key.public.verify(other, b"message"), other


def test_the_id_of_a_key_is_the_hash_of_its_32_raw_bytes(tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        public = make_key(tmp_path / "key")
    finally:
        os.umask(before)
    assert public == tmp_path / "key.pub"
    assert public.stat().st_mode & 0o777 == 0o644
    # An Ed25519 key in SubjectPublicKeyInfo is 12 bytes of header and the 32 raw bytes (RFC 8410).
    raw = b64decode("".join(public.read_text().splitlines()[1:-1]))[12:]
    assert len(raw) == 32
    assert read_public_key(public).id == sha256(raw).hexdigest()


def test_a_private_key_with_a_password_is_refused(tmp_path: Path) -> None:
    from cryptography.hazmat.primitives import serialization as form
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

    path = tmp_path / "key"
    path.touch(0o600)
    locked = form.BestAvailableEncryption(b"secret")
    path.write_bytes(
        Ed25519PrivateKey.generate().private_bytes(form.Encoding.PEM, form.PrivateFormat.PKCS8, locked)
    )
    with pytest.raises(InvalidKeyError, match="is not a private key without a password"):
        read_signing_key(path)


def test_keys_in_a_folder_that_is_not_there_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(InvalidKeyError, match="cannot be written: No such file"):
        make_key(tmp_path / "absent" / "key")


def test_files_of_keys_are_made_new_with_their_modes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[tuple[Path, int, int]] = []
    original = os.open

    def spy(path: Path, flags: int, mode: int) -> int:
        opened.append((path, flags, mode))
        return original(path, flags, mode)

    monkeypatch.setattr(os, "open", spy)
    make_key(tmp_path / "key")
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC
    assert opened == [(tmp_path / "key", flags, 0o600), (tmp_path / "key.pub", flags, 0o644)]


def test_a_key_is_made_once_and_its_public_key_restored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "keys" / "key"
    folders: list[Path | None] = []

    def spy(within: Path | None) -> AbstractContextManager[Path]:
        folders.append(within)
        return temporary_folder(within)

    monkeypatch.setattr("aeros.runtime.audit.keys.temporary_folder", spy)
    assert ensure_key(path) == path
    assert folders == [path.parent]  # a link does not lead to another file system
    assert path.parent.stat().st_mode & 0o777 == 0o700
    content, public = path.read_bytes(), path.with_name("key.pub").read_bytes()
    assert public == read_signing_key(path).public.pem()
    for lost in (None, "key.pub"):
        if lost is not None:
            (path.parent / lost).unlink()
        assert ensure_key(path) == path
        assert (path.read_bytes(), path.with_name("key.pub").read_bytes()) == (content, public)
    assert {one.name for one in path.parent.iterdir() if one.is_file()} == {"key", "key.pub"}


def test_a_lost_private_key_is_not_replaced(tmp_path: Path) -> None:
    path = tmp_path / "key"
    public = make_key(path)
    path.unlink()
    with pytest.raises(InvalidKeyError) as caught:
        ensure_key(path)
    assert str(caught.value) == (
        f"the key `{path}` is gone: `{public}` is left of it. Restore it from a backup. To begin with a new "
        "key, follow docs/audit.md, section `A lost key`"
    )
    assert not path.exists()


def test_a_key_whose_folder_cannot_be_made_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    path = tmp_path / "file" / "keys" / "key"
    with pytest.raises(InvalidKeyError, match=f"^the key `{path}` cannot be made: Not a directory$"):
        ensure_key(path)


def test_messages_name_the_file_and_the_cause(tmp_path: Path) -> None:
    path, public = tmp_path / "key", tmp_path / "key.pub"

    def message(work: Callable[[Path], object]) -> str:
        with pytest.raises(InvalidKeyError) as caught:
            work(path)
        return str(caught.value)

    for read in (read_signing_key, read_public_key):
        assert message(read) == f"the key `{path}` cannot be read: No such file or directory"
    public.touch()
    assert message(make_key) == f"`{public}` exists already"
    public.unlink()
    path.write_bytes(b"nonsense")
    path.chmod(0o600)
    assert message(make_key) == f"`{path}` cannot be written: File exists"
    assert message(read_signing_key) == f"`{path}` is not a private key without a password, as PEM"
    assert message(read_public_key) == f"`{path}` is not a public key, as PEM"
    for mode in (0o610, 0o604, 0o620, 0o601):
        path.chmod(mode)
        assert message(read_signing_key) == f"`{path}` is accessible to other users; run `chmod 600` on it"
    path.unlink()
    made = make_key(path)
    key = path.read_bytes()
    path.write_bytes(b"\n" * (100_001 - len(key)) + key)  # without its last newline
    assert read_signing_key(path).public.id == read_public_key(made).id
    path.write_bytes(b"\n" * (100_002 - len(key)) + key)
    assert message(read_signing_key) == f"`{path}` is not a private key without a password, as PEM"


def test_the_public_key_is_found_by_either_file(tmp_path: Path) -> None:
    assert find_public_key(tmp_path / "key") is None
    make_key(tmp_path / "key")
    expected = read_signing_key(tmp_path / "key").public.id
    for lost in ("key.pub", None):
        found = find_public_key(tmp_path / "key")
        assert found is not None
        assert found.id == expected
        if lost is not None:
            saved = (tmp_path / lost).read_bytes()
            (tmp_path / lost).unlink()
    (tmp_path / "key.pub").write_bytes(saved)
    (tmp_path / "key").unlink()
    found = find_public_key(tmp_path / "key")
    assert found is not None
    assert found.id == expected
