"""Re-run a sealed bundle and compare, bit for bit, and elsewhere by content."""

from __future__ import annotations

import math
import re
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from strapdown import __version__
from strapdown.attitude_comparison.comparison import run_comparison
from strapdown.attitude_comparison.options import AttitudeSpec
from strapdown.bundle import (
    KEYS,
    MANIFEST,
    SIGNATURE_FILE,
    TIMESTAMP,
    environment,
    found_references,
    machine,
    names_file,
    read_manifest,
    resolved,
    sha256,
    unsealed_changes,
    versions,
    with_paths,
)
from strapdown.bundle.signature import signatures, signer_of
from strapdown.config.crash_case import CaseSpec
from strapdown.config.motions import TrajectorySpec
from strapdown.config.reading import changed_options
from strapdown.config.sources import CrashSimulationSpec, SimulateSpec
from strapdown.errors import ConfigError, DataError, Finding, Severity, StrapdownError
from strapdown.lazy_names import Choices
from strapdown.report import crash_live
from strapdown.report.alignment import ALIGNMENT
from strapdown.report.allan import ALLAN
from strapdown.report.attitude import write_attitude
from strapdown.report.calibrate import CALIBRATE
from strapdown.report.compare import COMPARE
from strapdown.report.content import EQUAL, Comparison, compare_files, json_of
from strapdown.report.crash_case import CRASH
from strapdown.report.crash_simulation import write_crash_simulation
from strapdown.report.doctor import DOCTOR
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
from strapdown.report.extrinsics import EXTRINSICS
from strapdown.report.navigation import NAVIGATION
from strapdown.report.outage import OUTAGE
from strapdown.report.report_bundle import ReportBundle
from strapdown.report.sensors import SENSORS_BUNDLE
from strapdown.report.simulation import write_simulation, write_trajectory_simulation

#: Verdicts, from best to worst.
VERDICTS = ("identical", "numerically equal", "equal in part", "changed")


@dataclass(frozen=True)
class Verification:
    """Result of re-running a bundle.

    Attributes
    ----------
    verdict : str
        ``identical``; ``numerically equal`` on another platform or with other versions; ``equal in
        part``, if of some files only the text could be compared, or nothing; or ``changed``.
    within : float
        Largest difference of a number, relative if it exceeds 1; zero if identical.
    digest : str
        SHA-256 of the manifest, to be compared with the printed or recorded one.
    findings : tuple of Finding
        Changes and differences; signatures as notes.
    files : tuple of (str, str)
        Each sealed output with its result: ``same bytes``, or the code of its finding.
    """

    verdict: str
    within: float
    digest: str
    findings: tuple[Finding, ...]
    files: tuple[tuple[str, str], ...] = ()

    @property
    def details(self) -> tuple[str, ...]:
        """The findings, one sentence each."""
        return tuple(found.text() for found in self.findings)


#: Commands with a `ReportBundle`; ``attitude``, ``simulate`` and ``crash --live`` write theirs.
BUNDLES: dict[str, ReportBundle[Any]] = {
    bundle.command: bundle
    for bundle in (
        *(ALIGNMENT, ALLAN, CALIBRATE, SENSORS_BUNDLE, OUTAGE, CRASH),
        *(COMPARE, DOCTOR, EXTRINSICS, NAVIGATION),
    )
}


#: Of commands on a floor above this one: ``module:attribute``.
ABOVE: Choices = Choices({"campaign": "strapdown.campaign.run:CAMPAIGN_BUNDLE"})


def _rerun(command: str, configuration: dict[str, Any], out: Path, sealed: set[str]) -> None:
    """Repeat a run from its configuration; `sealed`: names of the sealed files."""
    if command in BUNDLES or command in ABOVE:
        (BUNDLES.get(command) or ABOVE[command]).rerun(configuration, out)
    elif command == "attitude":
        keys = {key: value for key, value in configuration.items() if key != "report"}
        report = bool(configuration.get("report", True))
        # PNG figures are not part of the configuration.
        png = any(name.endswith(".png") for name in sealed)
        bench = run_comparison(AttitudeSpec.model_validate(keys))
        write_attitude(bench, out, png=png, report=report)
    elif command == crash_live.COMMAND:
        crash_live.rerun(configuration, out)
    elif "trajectory" in configuration:
        # Earlier versions wrote no fixes.
        trajectory = TrajectorySpec.model_validate({"fixes": "none"} | configuration["trajectory"])
        write_trajectory_simulation(trajectory, out)
    elif "crash" in configuration:
        crash = CrashSimulationSpec.model_validate(configuration["crash"])
        write_crash_simulation(crash, out)
    else:
        write_simulation(SimulateSpec.model_validate(configuration), out)


def verify(
    bundle: str | Path,
    *,
    seal: str | None = None,
    signer: str | Path | None = None,
    inputs: Sequence[str | Path] = (),
    again: str | Path | None = None,
) -> Verification:
    """Check a bundle against its seal, re-run it from its configuration, and compare.

    Parameters
    ----------
    bundle : str or Path
        A folder written by a run.
    seal : str, optional
        SHA-256 that was printed when the bundle was made. Without it a bundle vouches only for
        itself: who changes a result can seal it again.
    signer : str or Path, optional
        Public key by which it is to be signed: its file, or its name (`Signature.signer`).
    inputs : sequence of (str or Path)
        Files and folders outside the bundle that may be read: inputs that it refers to.
    again : str or Path, optional
        Folder to keep the repeated run in; by default it is not kept.

    Returns
    -------
    Verification
        ``changed`` if a file differs from its seal (then it is not re-run), if a number differs by
        more than 1e-6, or if any byte differs under the same versions on the same platform.

    Raises
    ------
    DataError
        The folder is not a bundle, or its manifest is damaged.
    ConfigError
        The bundle refers to inputs that are not in `inputs`; `seal` or `signer` is none.
    """
    root = Path(bundle).absolute()
    manifest = read_manifest(root)
    if again is not None and Path(again).resolve().is_relative_to(root.resolve()):
        raise ConfigError("verify.inside", file=str(again), quantity="--again")
    digest = sha256(root / MANIFEST)
    moved = found_references(manifest, [Path(path) for path in inputs])
    notes = _beside_the_seal(root, signer)
    changes = [n for n in notes if n.severity == "error"]
    notes = [n for n in notes if n.severity != "error"]
    if seal is not None and _digest(seal) != digest:
        changes.append(Finding("verify.other-seal", file=MANIFEST, seal=_digest(seal)))
    changes += [] if _is_ours(root, manifest) else [Finding("verify.form", file=MANIFEST)]
    changes += unsealed_changes(root, manifest, moved)
    if changes or manifest["command"] == "crash":
        changes += changed_case(root, manifest)
    if changes:
        return Verification("changed", math.inf, digest, (*changes, *notes))
    if manifest["command"] == "reproduce":
        raise DataError("report.reproduced-paper", file=MANIFEST)
    if manifest["command"] not in (*BUNDLES, *ABOVE, "attitude", "simulate", crash_live.COMMAND):
        raise DataError("report.command-not-known", file=MANIFEST, manifest=manifest["command"])
    with tempfile.TemporaryDirectory(prefix="strapdown-verify-") as folder:
        repeated = Path(folder) / "again" if again is None else Path(again).absolute()
        moved = _of_recorded_name(moved, Path(folder))
        configuration = resolved(manifest["configuration"], root, moved)
        try:
            sealed = {item["name"] for item in manifest["outputs"]}
            _rerun(manifest["command"], configuration, repeated, sealed)
        except ValidationError as error:
            raise DataError(
                "report.configuration-not-understood",
                file=MANIFEST,
                errors=error.errors()[0]["msg"],
            ) from None
        return _compare(root, repeated, manifest, digest, moved, notes)


def _of_recorded_name(moved: dict[str, Path], folder: Path) -> dict[str, Path]:
    """Give an input that has another name now its recorded one, which is in the result."""
    found = {}
    for number, (name, path) in enumerate(moved.items()):
        place = path
        if path.is_file() and path.name != Path(name).name:
            place = folder / f"input-{number}" / Path(name).name
            place.parent.mkdir()
            try:
                place.symlink_to(path.resolve())
            except OSError:  # not allowed to everybody on Windows
                shutil.copyfile(path, place)
        found[name] = place
    return found


def _digest(seal: str) -> str:
    """Return a digest as it is in a manifest; it may be written as it was printed."""
    digest = seal.strip().lower().removeprefix("seal").strip().removeprefix("sha256").strip(" :")
    if not re.fullmatch(r"[0-9a-f]{64}", digest):
        raise ConfigError("verify.no-digest", quantity="--seal", seal=seal)
    return digest


def _beside_the_seal(root: Path, signer: str | Path | None) -> list[Finding]:
    """Check signatures; what speaks against the bundle has the severity of an error."""
    wanted = None if signer is None else signer_of(signer)
    found = []
    try:
        signed = signatures(root)
    except DataError as error:
        return [error.finding]
    except ConfigError as error:
        if wanted is not None:
            raise
        return [Finding("verify.signatures-unchecked", severity="note", reason=error.finding)]
    for one in signed:
        code = "verify.signed" if one.valid else "verify.signature-wrong"
        severity: Severity = "note" if one.valid else "error"
        found.append(Finding(code, severity=severity, file=one.file, signer=one.signer))
    if wanted is not None and not any(one.valid and one.signer == wanted for one in signed):
        found.append(Finding("verify.not-signed", severity="error", signer=wanted))
    if (root / TIMESTAMP).is_file():
        found.append(Finding("verify.timestamp", severity="note", file=TIMESTAMP))
    return found


def _is_ours(root: Path, manifest: dict[str, Any]) -> bool:
    """Whether a manifest repeats no name or key, so that readers agree, and has none unknown."""
    try:
        json_of((root / MANIFEST).read_text(encoding="utf-8"))
    except ValueError:
        return False
    names = [item["name"] for item in [*manifest["inputs"], *manifest["outputs"]]]
    reserved = [n for n in names if n in (MANIFEST, TIMESTAMP) or SIGNATURE_FILE.fullmatch(n)]
    keys = {frozenset(item) for item in manifest["inputs"]}
    keys |= {frozenset({"role", "kept", *item}) for item in manifest["outputs"]}
    return (
        set(manifest) == set(KEYS)
        and keys <= {frozenset({"role", "name", "kept", "sha256", "bytes"})}
        and len(names) == len(set(names))
        and not reserved
    )


def _compare(
    root: Path,
    again: Path,
    manifest: dict[str, Any],
    digest: str,
    moved: dict[str, Path],
    notes: Sequence[Finding],
) -> Verification:
    now = read_manifest(again)
    written = {item["name"]: sha256(again / item["name"]) for item in now["outputs"]}
    sealed = {item["name"]: item["sha256"] for item in manifest["outputs"]}
    # An extra, which results without PDF and PNG do not need.
    typeset = any(name.endswith((".pdf", ".png")) for name in sealed)
    conditions = [c for c in _other_conditions(manifest) if typeset or c.data["name"] != "typst"]
    alike = not any(found.data["name"] in DRAWING for found in conditions)
    changes = [Finding("verify.not-written", file=n) for n in sorted(sealed.keys() - written)]
    changes += [Finding("verify.not-sealed", file=n) for n in sorted(written.keys() - sealed)]
    if _read(manifest) != _read(now):
        changes.append(Finding("verify.roles", file=MANIFEST))
    changes += _other_configuration(manifest, now, moved, exact=not conditions)
    files, differences, within = [], list[Finding](), 0.0
    for name in sorted(sealed.keys() & written):
        if written[name] == sealed[name]:
            files.append((name, "same bytes"))
            continue
        if not conditions:
            # The same code on the same machine must give the same bytes.
            result = Finding("verify.bytes-differ", file=name)
        else:
            content = compare_files(root / name, again / name, drawn_alike=alike)
            drawn = name.removesuffix(".png") + ".svg"
            if name.endswith(".png") and alike and sealed.get(drawn) == written.get(drawn):
                # The same figure has the same points on every machine.
                content = Comparison(math.inf)
            within = max(within, content.within)
            result = _finding(name, content)
        files.append((name, result.code))
        (differences if result.severity == "note" else changes).append(result)
    if changes:
        verdict = "changed"
    elif any(found.code in PARTIAL for found in differences):
        verdict = "equal in part"
    elif conditions:
        verdict = "numerically equal"
        if not differences:
            differences.append(Finding("verify.same-bytes", severity="note"))
    else:
        verdict = "identical"
    found = (*changes, *differences, *conditions, *_other_environment(manifest), *notes)
    return Verification(verdict, within, digest, found, tuple(files))


#: Packages that draw pages, figures and PDF.
DRAWING = ("strapdown", "strapdown source", "typst")
#: Codes of files that were not compared as a whole.
PARTIAL = ("verify.drawing", "verify.not-compared")


def _finding(name: str, content: Comparison) -> Finding:
    """Return what the comparison of a file found; a note where it agrees."""
    if content.drawing:
        code = "verify.not-compared" if name.endswith(".png") else "verify.drawing"
        return Finding(code, file=name, severity="note")
    if math.isinf(content.within):
        return Finding("verify.content", file=name)
    if content.within == 0.0:
        return Finding("verify.last-digits", file=name, severity="note")
    severity: Severity = "note" if content.within <= EQUAL else "warning"
    return Finding("verify.numbers", file=name, severity=severity, difference=content.within)


def _read(manifest: dict[str, Any]) -> list[tuple[str, str]]:
    return sorted((str(item["role"]), str(item["sha256"])) for item in manifest["inputs"])


def _other_configuration(
    manifest: dict[str, Any], now: dict[str, Any], moved: dict[str, Path], *, exact: bool
) -> list[Finding]:
    """Compare the sealed configuration with the one of the repeated run, which it led to.

    `exact`: whether both have the same options; another version may have others.
    """
    before = {str(p): name for name, place in moved.items() for p in (place, place.resolve())}
    had = with_paths(now["configuration"], lambda path: before.get(path, path))
    sealed = manifest["configuration"]
    if not exact:
        sealed, had = _in_both(sealed, had), _in_both(had, sealed)
    options = changed_options(sealed, had)
    return [Finding("verify.configuration", file=MANIFEST, options=options)] if options else []


def _in_both(one: Any, other: Any) -> Any:
    """Return the part of a configuration whose keys another one has, too."""
    if isinstance(one, dict) and isinstance(other, dict):
        return {k: _in_both(v, other[k]) for k, v in one.items() if k in other}
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        return [_in_both(*pair) for pair in zip(one, other, strict=True)]
    return one


def conditions_of(manifest: dict[str, Any]) -> dict[str, tuple[str, str]]:
    """Return versions and platform, as a manifest states them and as they are now, by name."""
    now = versions() | {f"platform {k}": v for k, v in machine().items()}
    then = manifest["versions"] | {f"platform {k}": v for k, v in manifest["platform"].items()}
    names = sorted(now.keys() | then.keys())
    return {name: (then.get(name, "absent"), now.get(name, "absent")) for name in names}


def _other_conditions(manifest: dict[str, Any]) -> Iterator[Finding]:
    for name, (then, now) in conditions_of(manifest).items():
        if then != now:
            yield Finding("verify.condition", severity="note", name=name, then=then, now=now)


def _other_environment(manifest: dict[str, Any]) -> list[Finding]:
    """Count the packages that no number depends on and that are of other versions."""
    others = set(manifest["environment"]) ^ set(environment())
    names = {line.partition("==")[0] for line in others} - set(versions())
    if not names:
        return []
    return [Finding("verify.environment", severity="note", count=len(names))]


# Differences between a sealed crash case and the case file in its bundle.


def changed_case(root: Path, manifest: dict[str, Any]) -> list[Finding]:
    """Name the options in which a bundle's case file and its sealed configuration differ.

    One finding per option, with the sealed value first; empty if both agree, or if the bundle is
    not of a crash.
    """
    configuration = manifest["configuration"]
    if manifest["command"] != "crash" or not isinstance(configuration, dict):
        return []
    name = configuration.get("case_path")
    if not isinstance(name, str) or not (path := root / name).is_file():
        return []
    try:
        stated = CaseSpec.read(path, files=False).model_dump(mode="json", exclude_none=True)
    except StrapdownError as error:
        return [Finding("verify.case-invalid", file=name, reason=error.finding)]
    stated.pop("name", None)
    sealed = {k: v for k, v in configuration.get("case", {}).items() if k != "name"}
    return [
        Finding("verify.case", file=name, option=what)
        for what in changed_options(_without_files(sealed), _without_files(stated))
    ]


def _without_files(value: Any, key: str = "") -> Any:
    """Remove file names, which differ in a bundle."""
    if isinstance(value, dict):
        return {k: _without_files(v, k) for k, v in value.items() if not names_file(k, v)}
    if isinstance(value, list):
        return [_without_files(v, key) for v in value if not names_file(key, v)]
    return value


# A verification as one page, for a file that people keep.

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
