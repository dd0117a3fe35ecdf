"""Signatures of bundles: Ed25519 over ``manifest.json``, each in a file of its own beside it.

The manifest holds the SHA-256 of every file, so that its signature covers all files. Any program
with Ed25519 can check it: the signed message is the bytes of ``manifest.json``. Keys are PEM files
(PKCS 8), or those of OpenSSH (``ssh-ed25519``).
"""

from __future__ import annotations

import base64
import hashlib
import json
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from strapdown.bundle import (
    MANIFEST,
    SIGNATURE_FILE,
    atomic_folder,
    read_manifest,
    to_json,
    unsealed_changes,
)
from strapdown.errors import ConfigError, DataError

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import (
        Ed25519PrivateKey,
        Ed25519PublicKey,
    )

SCHEMA = "strapdown signature 1"
_LARGEST = 10_000  # bytes of a file of a key or a signature


@dataclass(frozen=True)
class Signature:
    """Signature of a bundle.

    Attributes
    ----------
    file : str
        Name in the bundle.
    signer : str
        SHA-256 of the 32 bytes of the public key, in hexadecimal: the name of the key.
    valid : bool
        Whether it fits the manifest. Whose key it is, the bundle cannot say.
    """

    file: str
    signer: str
    valid: bool


def new_key(path: str | Path, password: str | None = None) -> str:
    """Make a key: the secret one in `path`, for its owner alone, the public one in ``PATH.pub``.

    `password`: encrypts the secret key. Returns the name of the key (`Signature.signer`).
    ConfigError: one of the files exists or cannot be written.
    """
    _library()
    from cryptography.hazmat.primitives import serialization as form
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

    secret = Path(path)
    public = secret.with_name(secret.name + ".pub")
    for file in (secret, public):
        if file.exists():
            raise ConfigError("bundle.key-exists", file=str(file), quantity="--new-key")
    key = Ed25519PrivateKey.generate()
    closed: form.KeySerializationEncryption = (
        form.NoEncryption() if password is None else form.BestAvailableEncryption(password.encode())
    )
    private = key.private_bytes(form.Encoding.PEM, form.PrivateFormat.PKCS8, closed)
    open_part = form.Encoding.PEM, form.PublicFormat.SubjectPublicKeyInfo
    try:
        with os.fdopen(os.open(secret, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as out:
            out.write(private)
        with public.open("xb") as out:
            out.write(key.public_key().public_bytes(*open_part))
    except OSError as error:
        raise ConfigError(
            "bundle.key-not-written", file=str(error.filename), reason=error.strerror
        ) from None
    return _name(key.public_key())


def sign(bundle: str | Path, key: str | Path, password: str | None = None) -> Signature:
    """Sign a bundle, which is to be as it was sealed; the run is not repeated.

    Parameters
    ----------
    bundle : str or Path
    key : str or Path
        Secret key of `new_key`, or of OpenSSH.
    password : str, optional
        Of an encrypted key.

    Returns
    -------
    Signature
        Written into the bundle as ``signature-XXXXXXXXXXXXXXXX.json``, named by the key. A
        signature by the same key is replaced.

    Raises
    ------
    DataError
        A file differs from the seal.
    ConfigError
        The key is not an Ed25519 key, or its password is wrong or missing.
    """
    root = Path(bundle).absolute()
    changes = unsealed_changes(root, read_manifest(root))
    if changes:
        raise DataError("bundle.changed-not-signed", file=root.name, changes=changes)
    secret = _secret_key(Path(key), password)
    manifest = (root / MANIFEST).read_bytes()
    name = _name(secret.public_key())
    content = {
        "schema": SCHEMA,
        "algorithm": "Ed25519",
        "signed": MANIFEST,
        "sha256": hashlib.sha256(manifest).hexdigest(),
        "public_key": base64.b64encode(secret.public_key().public_bytes_raw()).decode(),
        "signature": base64.b64encode(secret.sign(manifest)).decode(),
    }
    file = f"signature-{name[:16]}.json"
    atomic_folder.replace_file(root / file, to_json(content).encode(), root)
    return Signature(file, name, True)


def signatures(bundle: Path) -> list[Signature]:
    """Check the signatures in a bundle, in order of their names.

    DataError: a file of this name is not a signature. ConfigError: the library is not installed.
    """
    files = sorted(p for p in bundle.iterdir() if SIGNATURE_FILE.fullmatch(p.name))
    if not files:
        return []
    _library()
    manifest = (bundle / MANIFEST).read_bytes()
    return [_checked(path, manifest) for path in files]


def _checked(path: Path, manifest: bytes) -> Signature:
    from cryptography.exceptions import InvalidSignature
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

    try:
        content = json.loads(_small(path))
        if content["schema"] != SCHEMA:
            raise ValueError
        key = Ed25519PublicKey.from_public_bytes(
            base64.b64decode(content["public_key"], validate=True)
        )
        signature = base64.b64decode(content["signature"], validate=True)
    except (ValueError, TypeError, KeyError, RecursionError):
        raise DataError("bundle.no-signature", file=path.name) from None
    name = _name(key)
    try:
        key.verify(signature, manifest)
    except InvalidSignature:
        return Signature(path.name, name, False)
    return Signature(path.name, name, path.name == f"signature-{name[:16]}.json")


def signer_of(signer: str | Path) -> str:
    """Return the name of a key.

    `signer`: file of a public key, or the name itself, 64 hexadecimal digits. ConfigError: neither.
    """
    text = str(signer)
    if re.fullmatch(r"[0-9a-fA-F]{64}", text):
        return text.lower()
    _library()
    from cryptography.exceptions import UnsupportedAlgorithm
    from cryptography.hazmat.primitives import serialization as form
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

    path = Path(signer)
    if not path.is_file():
        raise ConfigError("bundle.no-public-key", file=text, quantity="--signer")
    data = _small(path)
    try:
        key = (
            form.load_ssh_public_key(data)
            if data.startswith(b"ssh-")
            else form.load_pem_public_key(data)
        )
    except (ValueError, UnsupportedAlgorithm):
        key = None
    if not isinstance(key, Ed25519PublicKey):
        raise ConfigError("bundle.no-public-key", file=text, quantity="--signer")
    return _name(key)


def _secret_key(path: Path, password: str | None) -> Ed25519PrivateKey:
    _library()
    from cryptography.exceptions import UnsupportedAlgorithm
    from cryptography.hazmat.primitives import serialization as form
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

    if not path.is_file():
        raise ConfigError("bundle.no-key-file", file=str(path), quantity="--key")
    data = _small(path)
    load: Any = (
        form.load_ssh_private_key if b"OPENSSH PRIVATE KEY" in data else form.load_pem_private_key
    )
    try:
        key = load(data, None if password is None else password.encode())
    except TypeError:  # a password is missing, or not needed
        code = "bundle.key-needs-password" if password is None else "bundle.key-has-no-password"
        raise ConfigError(code, file=str(path), quantity="--key") from None
    except (ValueError, UnsupportedAlgorithm):
        code = "bundle.no-secret-key" if password is None else "bundle.wrong-password"
        raise ConfigError(code, file=str(path), quantity="--key") from None
    if not isinstance(key, Ed25519PrivateKey):
        raise ConfigError("bundle.no-secret-key", file=str(path), quantity="--key")
    return key


def _name(key: Ed25519PublicKey) -> str:
    return hashlib.sha256(key.public_bytes_raw()).hexdigest()


def _small(path: Path) -> bytes:
    with path.open("rb") as stream:
        return stream.read(_LARGEST)


def _library() -> None:
    try:
        import cryptography  # noqa: F401
    except ImportError:
        raise ConfigError("bundle.no-cryptography") from None
