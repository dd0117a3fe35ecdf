"""A verification as one page, for a file that people keep."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from strapdown import __version__
from strapdown.bundle import environment, read_manifest
from strapdown.report.document import (
    Block,
    Document,
    Facts,
    Paragraph,
    items_of,
    section,
    table_of,
)
from strapdown.report.document_html import document_page
from strapdown.report.verify import Verification, conditions_of

_AGAIN = "The run was repeated from its sealed configuration and inputs"
_ELSEWHERE = f"{_AGAIN}, on another platform or with other versions"
_MEANING = {
    "identical": f"{_AGAIN}. Every result has the same bytes.",
    "numerically equal": f"{_ELSEWHERE}. Every number agrees within {{within:.1e}}, relative above "
    "1, or to the last digit shown, and every word is the same.",
    "equal in part": f"{_ELSEWHERE}. Numbers and words agree; of the files named below, drawings "
    "and styles were not compared.",
    "changed": "The result is not confirmed. What differs is listed below.",
}
_RESULT = {
    "verify.last-digits": "equal to the last digit shown",
    "verify.numbers": "numbers differ",
    "verify.drawing": "text equal, drawing not compared",
    "verify.not-compared": "not compared",
    "verify.bytes-differ": "differs",
    "verify.content": "differs",
}


def verification_page(
    result: Verification,
    bundle: str | Path,
    *,
    seal: str | None = None,
    signer: str | Path | None = None,
) -> str:
    """Lay out a verification as one HTML page.

    Parameters
    ----------
    result : Verification
    bundle : str or Path
        The folder that was verified.
    seal, signer : optional
        As they were given to `verify`: whether they were is part of the result.
    """
    root = Path(bundle).absolute()
    manifest = read_manifest(root)
    compared = dict(result.files)
    facts = (
        ("Bundle", root.name),
        ("Command", str(manifest["command"])),
        ("Seal", f"SHA-256 {result.digest}"),
        ("Verified with", f"strapdown {__version__}"),
    )
    answer = _MEANING[result.verdict].format(within=result.within)
    front = (
        Paragraph(f"{result.verdict.capitalize()}. {answer}", "lead"),
        Paragraph(_of_seal(seal, signer), "note"),
    )
    rows = [
        (item["name"], _outcome(result, compared, item["name"]), str(item["bytes"]), item["sha256"])
        for item in manifest["outputs"]
    ]
    inputs = [
        (item["role"], item["name"], str(item["bytes"]), item["sha256"])
        for item in manifest["inputs"]
    ]
    conditions = conditions_of(manifest)
    differ = [(f.file or "", f.sentence()) for f in result.findings]
    document = Document(
        title=f"Verification of {root.name}",
        subtitle="A sealed result of strapdown, run again and compared",
        facts=facts,
        front=front,
        sections=(
            section("findings", "Findings", items_of(differ) or Paragraph("Nothing differs.")),
            section(
                "outputs",
                "Results",
                table_of("file | compared | bytes | SHA-256", rows, text=(0, 1, 3)),
            ),
            section(
                "inputs",
                "Inputs",
                table_of("role | file | bytes | SHA-256", inputs, text=(0, 1, 3))
                or Paragraph("None: the run is of a simulation."),
            ),
            section(
                "conditions",
                "Versions and platform",
                table_of(
                    "| when it was sealed | now",
                    ((name, *pair) for name, pair in conditions.items()),
                    text=(0, 1, 2),
                    strong=(k for k, (a, b) in enumerate(conditions.values()) if a != b),
                ),
            ),
            section("repeat", "To repeat this", *_how(root.name, manifest["environment"])),
        ),
        footer=f"Verification of {root.name}, seal {result.digest}",
    )
    return document_page(document)


def _of_seal(seal: str | None, signer: str | Path | None) -> str:
    given = [
        *(["the seal was given from outside the bundle"] if seal is not None else []),
        *(["the signer was given from outside the bundle"] if signer is not None else []),
    ]
    if given:
        return f"For this verification {' and '.join(given)}, and compared."
    return (
        "Neither seal nor signer was given from outside the bundle. Who could change a result "
        "could seal it again: compare the seal above with the one that was printed at the time."
    )


def _outcome(result: Verification, compared: dict[str, str], name: str) -> str:
    """Return the result of a file in words."""
    if any(f.file == name and f.code.startswith("bundle.") for f in result.findings):
        return next(f.sentence() for f in result.findings if f.file == name)
    code = compared.get(name)
    return "as sealed; not repeated" if code is None else _RESULT.get(code, code)


def _how(name: str, packages: list[str]) -> Iterator[Block]:
    yield Paragraph(
        "With the packages below, the bytes of every result are the same on the same kind of "
        "processor. Each is in the manifest of the bundle, too."
    )
    yield Paragraph(f"strapdown verify {name} --seal DIGEST", "mono")
    yield Facts(
        (("Packages then", ", ".join(packages)), ("Packages now", ", ".join(environment())))
    )
