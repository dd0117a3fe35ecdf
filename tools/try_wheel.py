"""Build the wheel, install it under each Python given, and compare what they compute.

make wheels PYTHONS="python3.11 python3.12 python3.13"

One wheel serves all versions of Python on a platform (stable ABI). Each of them runs the demo in an
environment of its own, with the versions of constraints.txt; every file of the first must have the
same bytes in the others, but for those that state versions or times.
"""

from __future__ import annotations

import filecmp
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
# Versions, times, and the seals of manifests.
DIFFER = {"manifest.json", "timing.json", "index.html"}


def main(pythons: list[str]) -> int:
    """Return 1 if a file of one version differs from that of the first, 2 if a Python is missing."""
    paths = {name: shutil.which(Path(name).expanduser()) for name in pythons}
    missing = [name for name, path in paths.items() if path is None]
    if missing or len(paths) < 2:
        print(f"two Pythons are needed; not found: {', '.join(missing)}", file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory(prefix="strapdown-wheels-") as folder:
        base = Path(folder)
        run(sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", base / "dist", ROOT)
        (wheel,) = (base / "dist").glob("*.whl")
        print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.1f} MB")
        outputs = []
        for k, python in enumerate(paths.values()):
            environment, out = base / f"env{k}", base / f"out{k}"
            run(python, "-m", "venv", environment)
            own = environment / "bin"
            run(own / "pip", "install", "-q", "-c", ROOT / "constraints.txt", wheel)
            run(own / "strapdown", "demo", "--out", out, "--quiet")
            version = subprocess.check_output([own / "python", "--version"], text=True).strip()
            apart = different(outputs[0], out) if outputs else []
            outputs.append(out)
            files = sum(path.is_file() for path in out.rglob("*"))
            print(f"{version}: {files} files, {len(apart)} differ {' '.join(apart)}", flush=True)
            if apart:
                return 1
    return 0


def different(first: Path, other: Path) -> list[str]:
    """Files that only one folder has, or that have other bytes."""
    names = {str(p.relative_to(x)) for x in (first, other) for p in x.rglob("*") if p.is_file()}
    same, _, _ = filecmp.cmpfiles(first, other, sorted(names), shallow=False)
    return sorted(n for n in names - set(same) if Path(n).name not in DIFFER)


def run(*command: object) -> None:
    """Run a command, and end with its error."""
    subprocess.run([str(part) for part in command], check=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
