"""Compare two records: to the last bit, but where a tolerance with its reason is stated."""

from __future__ import annotations

import json
import tomllib
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np

EPS = np.finfo(np.float64).eps


@dataclass(frozen=True)
class Tolerance:
    """A quantity whose last bits an order of summation decides.

    `run` and `quantity` are patterns (fnmatch). `relative` is of the largest absolute value of
    the old array; `reason` says where it comes from.
    """

    run: str
    quantity: str
    relative: float
    reason: str


# Sums of n terms of one sign: whatever their order, two results differ by at most 2 (n - 1) eps,
# relatively (Higham 2002, Accuracy and Stability of Numerical Algorithms, eq. 4.4, twice, one for
# each order). The longest run has 12,000 samples; a root mean square halves it, a factor of 1.
SUMMED = 2 * 12_000 * EPS

TOLERANCES = (
    *(
        Tolerance("*", f"*/{name}", SUMMED, "a mean over samples: its last bits are of the order")
        for name in ("rms", "rms_deg", "rms_in_sd", "rms_m", "mean_nis", "mean_nees")
    ),
    # Likewise a standard deviation: the root of a sum of squares over the unknowns of a crash.
    *(
        Tolerance(run, quantity, SUMMED, "a sum of squares over unknowns: its order")
        for run, quantity in (
            ("crash-*", "crash/trajectory.csv/*_sd_*"),
            ("demo", "demo/pole/trajectory.csv/*_sd_*"),
            ("crash-paths", "crash_paths/path/share/*"),
            ("crash-*", "crash/crash.json/answers/*/path/variances_at_the_end_m2/*"),
            ("crash-*", "crash/crash.json/answers/*/path/end/*"),
            ("demo", "demo/pole/crash.json/answers/*/path/variances_at_the_end_m2/*"),
            ("demo", "demo/pole/crash.json/answers/*/path/end/*"),
        )
    ),
)


@dataclass(frozen=True)
class Difference:
    run: str
    quantity: str
    old: str
    new: str
    size: str
    relative: float = np.inf  # of the largest absolute value of the old array, where both are one


@dataclass(frozen=True)
class Change:
    """A line of changes.toml: what is meant to change, by at most `relative` if it is stated."""

    run: str
    quantity: str
    reason: str
    changelog: str
    relative: float = np.inf

    def covers(self, difference):
        return (
            fnmatchcase(difference.run, self.run)
            and fnmatchcase(difference.quantity, self.quantity)
            and difference.relative <= self.relative
        )


def read_changes(path):
    """Read changes.toml; every entry has run, quantity, reason and changelog, some `relative`."""
    entries = tomllib.loads(path.read_text(encoding="utf-8")).get("change", [])
    return [Change(**entry) for entry in entries]


def read_record(folder, run):
    """Read a run of a record: arrays and words by quantity; None where it is missing."""
    numbers, words = folder / f"{run}.npz", folder / f"{run}.json"
    if not (numbers.is_file() and words.is_file()):
        return None
    document = json.loads(words.read_text(encoding="utf-8"))
    out = {f"exit {step}": [code] for step, code in document["exit"].items()}
    out |= {
        name: value if isinstance(value, list) else [value]
        for name, value in document["status"].items()
    }
    with np.load(numbers, allow_pickle=False) as archive:
        out |= {name: archive[name] for name in archive.files}
    return out


def tolerance_of(run, quantity, tolerances=TOLERANCES):
    """Return the tolerance of a quantity, relative to its largest value; 0: to the last bit."""
    for entry in tolerances:
        if fnmatchcase(run, entry.run) and fnmatchcase(quantity, entry.quantity):
            return entry.relative
    return 0.0


def _bits(values):
    """Bits of an array, with one pattern for all NaN."""
    return np.where(np.isnan(values), np.nan, values).view(np.int64)


def _arrays(run, quantity, old, new, tolerances):
    if old.shape != new.shape:
        return Difference(run, quantity, f"shape {old.shape}", f"shape {new.shape}", "")
    old, new = np.atleast_1d(old), np.atleast_1d(new)  # a number of a document has no axis
    changed = _bits(old) != _bits(new)
    if not changed.any():
        return None
    with np.errstate(invalid="ignore"):
        apart = np.abs(new - old)
    finite = np.abs(old[np.isfinite(old)])
    scale = finite.max() if finite.size else 0.0
    relative = tolerance_of(run, quantity, tolerances)
    if relative and not (changed & ~(apart <= relative * scale)).any():
        return None
    at = tuple(int(i[0]) for i in np.nonzero(changed))
    worst = np.nanmax(apart) if np.isfinite(apart).any() else np.nan
    size = f"{int(changed.sum())} of {changed.size}, at most {worst:.3g}"
    if scale:
        size += f" ({worst / scale:.2g} of the largest)"
    # A change of what is not finite has no size.
    share = worst / scale if scale and np.isfinite(apart[changed]).all() else np.inf
    return Difference(run, quantity, repr(float(old[at])), repr(float(new[at])), size, share)


def compare_runs(run, old, new, tolerances=TOLERANCES):
    """Return the differences of two records of a run, and how many quantities are new."""
    if old is None or new is None:
        sides = ("missing" if side is None else "recorded" for side in (old, new))
        return [Difference(run, "(run)", *sides, "")], 0
    found = []
    for name, value in old.items():
        if name not in new:
            found.append(Difference(run, name, "recorded", "missing", ""))
            continue
        other = new[name]
        if isinstance(value, np.ndarray) and isinstance(other, np.ndarray):
            difference = _arrays(run, name, value, other, tolerances)
            if difference is not None:
                found.append(difference)
        elif isinstance(value, np.ndarray) or isinstance(other, np.ndarray):
            found.append(Difference(run, name, _kind(value), _kind(other), ""))
        elif value != other:
            found.append(Difference(run, name, _words(value), _words(other), ""))
    return found, len(new.keys() - old.keys())


def _kind(value):
    return "numbers" if isinstance(value, np.ndarray) else "words"


def _words(values):
    text = " ".join(str(value) for value in values)
    return text if len(text) <= 40 else f"{text[:37]}…"


@dataclass(frozen=True)
class Outcome:
    passed: tuple[str, ...]
    failed: tuple[str, ...]
    unlisted: tuple[Difference, ...]
    listed: int
    faults: tuple[str, ...]  # of the list of changes
    added: int

    @property
    def good(self):
        return not self.failed and not self.faults


def compare(old, new, runs, changes=(), changelog="", tolerances=TOLERANCES, *, partly=False):
    """Compare the records in two folders.

    Parameters
    ----------
    old, new : Path
        Folders with an .npz and a .json for each run.
    runs : iterable of str
    changes : iterable of Change
        What is meant to change. One that does not occur is a fault, as is one that CHANGELOG
        does not mention.
    changelog : str
        The text of CHANGELOG.md.
    tolerances : iterable of Tolerance
    partly : bool
        Only some of the runs are compared, so that a listed change need not occur.
    """
    used, unlisted, passed, failed = set(), [], [], []
    listed = added = 0
    for run in runs:
        differences, more = compare_runs(
            run, read_record(old, run), read_record(new, run), tolerances
        )
        added += more
        open_ones = []
        for difference in differences:
            covering = [change for change in changes if change.covers(difference)]
            used.update(covering)
            if covering:
                listed += 1
            else:
                open_ones.append(difference)
        (failed if open_ones else passed).append(run)
        unlisted += open_ones
    flat = " ".join(changelog.split())
    faults = [
        f"changes.toml: {change.run}, {change.quantity}: listed, and nothing changed"
        for change in changes
        if change not in used and not partly
    ]
    faults += [
        f"changes.toml: {change.run}, {change.quantity}: CHANGELOG.md does not say "
        f"{change.changelog!r}"
        for change in changes
        if " ".join(change.changelog.split()) not in flat or not change.changelog.strip()
    ]
    return Outcome(tuple(passed), tuple(failed), tuple(unlisted), listed, tuple(faults), added)


def table(differences, most=12):
    """Return the differences as lines, at most so many of each run."""
    lines = []
    for run in dict.fromkeys(d.run for d in differences):
        own = [d for d in differences if d.run == run]
        lines.append(f"{run}: {len(own)} quantities differ")
        for d in own[:most]:
            lines.append(f"  {d.quantity}\n    old {d.old}   new {d.new}   {d.size}".rstrip())
        if len(own) > most:
            lines.append(f"  and {len(own) - most} more")
    return "\n".join(lines)
