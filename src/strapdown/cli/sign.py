"""``strapdown sign``."""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

import typer

from strapdown.cli.console import console
from strapdown.cli.shared_options import QUIET, VERBOSE, option
from strapdown.errors import ConfigError

EPILOG = (
    "Example: strapdown sign --new-key expert.pem\n\n"
    "Example: strapdown sign drive-navigate --key expert.pem"
)
signing = partial(option, "Key")


def sign(
    folder: Path | None = typer.Argument(None, metavar="DIR", help="A folder that a run wrote."),
    key: Path | None = signing("FILE", "Secret key by Ed25519, as PEM or of OpenSSH."),
    new_key: Path | None = signing("FILE", "Make a key; the public part becomes FILE.pub."),
    password: bool = signing(None, "Ask for the password of the key.", "--password", default=False),
    quiet: bool = QUIET,
    verbose: bool = VERBOSE,
) -> None:
    """Sign the seal of a result with your key, so that others can tell that it is yours.

    The signature is a file in the folder. Others check it by verify --signer FILE.pub; to give
    them the public key, or its name, by another way than the folder is up to you.
    """
    from strapdown.bundle.signature import new_key as make_key
    from strapdown.bundle.signature import sign as sign_bundle

    if (folder is None) == (new_key is None) or (folder is None) != (key is None):
        raise ConfigError("cli.sign-what", quantity="DIR, --key or --new-key")
    secret = None
    if password and not sys.stdin.isatty():
        raise ConfigError("cli.no-terminal", quantity="--password")
    if password:
        secret = str(
            typer.prompt(
                "Password", hide_input=True, confirmation_prompt=new_key is not None, err=True
            )
        )
    if new_key is not None:
        name = make_key(new_key, secret)
        if not quiet:
            console().print(f"Secret key  {new_key}: keep it to yourself")
            console().print(f"Public key  {new_key}.pub")
            console().print(f"Name        {name}")
        return
    assert folder is not None and key is not None
    signature = sign_bundle(folder, key, secret)
    if not quiet:
        console().print(f"Signed  {folder / signature.file}")
        console().print(f"Key     {signature.signer}")
