"""What is loaded when, seen in sys.modules of a fresh process."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib import import_module
from importlib.resources import as_file, files
from types import ModuleType

import pytest

# Typer itself loads pydantic where a command has options.
HEAVY = ("numba", "pandas", "typst", "jinja2", "scipy", "h5py", "pyarrow")


#: What no run needs that is asked for nothing of it, and what draws a report.
OF_OTHER_RUNS = (
    *("numba", "typst", "jinja2", "h5py", "matplotlib", "plotly", "pymap3d", "pypdf"),
    *("scipy.ndimage", "scipy.signal"),
    *("strapdown.export", "strapdown.peers", "strapdown.simulation", "strapdown.live"),
    *("strapdown.report.document_pdf", "strapdown.report.attitude_export"),
)
#: Packages of scipy that a run would load for one function: 0.1 to 0.6 s each.
OF_SCIPY = tuple(
    f"scipy.{name}"
    for name in (
        "fft",
        "interpolate",
        "linalg",
        "ndimage",
        "optimize",
        "signal",
        "stats",
    )
)
#: A doctor of one log knows no stage of a navigation, no second log and no crash record.
NOT_OF_A_LOG = (
    *("strapdown.config.alignment", "strapdown.config.navigation", "strapdown.alignment.fine"),
    *("strapdown.evaluation.second_log", "strapdown.formats.crash_records"),
)
DRAWING = tuple(
    f"strapdown.report.{name}"
    for name in (
        *("chart_svg", "svg_drawing", "scene", "plan"),
        *("attitude_charts", "attitude_document", "navigation_charts", "navigation_plan"),
    )
)


def loaded_after(code: str, modules: tuple[str, ...] = HEAVY) -> set[str]:
    """Those of some modules that are in sys.modules after `code`."""
    tell = f"import json, sys\nprint(json.dumps([m for m in {modules!r} if m in sys.modules]))"
    text = f"{code}\n{tell}"
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    return set(json.loads(done.stdout.splitlines()[-1]))


def test_import_strapdown_loads_nothing_heavy():
    assert loaded_after("import strapdown") == set()


def test_dir_and_an_unknown_name_load_nothing_either():
    code = "import strapdown\ndir(strapdown)\ntry:\n strapdown.nothing\nexcept AttributeError: pass"
    assert loaded_after(code) == set()


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments",
    [
        ["--help"],
        ["align", "--help"],
        ["attitude", "--help"],
        ["crash", "--help"],
        ["init", "align", "--help"],
        ["init", "navigate", "--help"],
        ["navigate", "--help"],
        ["outage", "--help"],
        ["init", "crash", "--help"],
        ["verify", "--help"],
        ["--version"],
    ],
)
def test_help_loads_nothing_heavy(arguments):
    code = (
        f"import sys\nsys.argv = ['strapdown', *{arguments!r}]\n"
        "from strapdown.cli.main import run\ntry:\n run()\nexcept SystemExit: pass"
    )
    assert loaded_after(code) == set()


def loaded_by(arguments: list[str], modules: tuple[str, ...]) -> set[str]:
    code = (
        f"import sys\nsys.argv = ['strapdown', *{arguments!r}]\n"
        "from strapdown.cli.main import run\n"
        "try:\n run()\nexcept SystemExit as ended:\n assert not ended.code"
    )
    return loaded_after(code, modules)


@pytest.fixture(scope="module")
def turn(tmp_path_factory):
    """Two seconds of a unit that turns about its vertical."""
    log = tmp_path_factory.mktemp("log") / "turn.csv"
    rows = [f"{0.01 * k:.2f},0,0,{0.1 + 0.001 * (k % 7)},0,0,-9.8" for k in range(200)]
    log.write_text("\n".join(["time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z", *rows]))
    return log


def test_attitude_loads_what_it_uses(turn, tmp_path):
    run = ["attitude", str(turn), "--gyro-unit", "rad/s", "--quiet", "--out"]
    unused = (*OF_OTHER_RUNS, "scipy", "strapdown.config.motions")
    assert loaded_by([*run, str(tmp_path / "a")], unused) == set()
    assert loaded_by([*run, str(tmp_path / "b"), "--no-report"], DRAWING) == set()
    assert (tmp_path / "a" / "report.html").is_file()


def test_doctor_and_read_imu_load_what_they_use(turn, tmp_path):
    unused = (*OF_OTHER_RUNS, *NOT_OF_A_LOG, "scipy")
    run = ["doctor", str(turn), "--gyro-unit", "rad/s", "--quiet", "--out", str(tmp_path / "a")]
    assert loaded_by(run, unused) == set()
    read = f"import strapdown\nstrapdown.read_imu({str(turn)!r}, units={{'gyro': 'rad/s'}})"
    assert loaded_after(read, (*unused, *DRAWING)) == set()


@pytest.mark.slow
def test_a_crash_of_one_recorder_loads_of_scipy_what_it_uses(tmp_path):
    pole = tmp_path / "pole"
    simulate = ["simulate", "pole", "--units", "IMU1", "--out", str(pole)]
    loaded_by(simulate, ())
    run = ["crash", str(pole / "case.toml"), "--quiet", "--out", str(tmp_path / "a")]
    unused = ("numba", "jinja2", "matplotlib", "plotly", *OF_SCIPY)
    assert loaded_by(run, unused) == set()


@pytest.mark.slow
def test_navigate_loads_what_it_uses(tmp_path):
    # The receiver states velocities: the delay of these is found by a spline.
    data = files("strapdown") / "demo_data"
    text = (data / "phone.toml").read_text(encoding="utf-8")
    with as_file(data / "comma2k19") as recording:
        file = tmp_path / "phone.toml"
        file.write_text(text.replace("phone-recording", recording.as_posix()))
        run = ["navigate", str(file), "--quiet", "--out"]
        unused = (*OF_OTHER_RUNS, *OF_SCIPY)
        assert loaded_by([*run, str(tmp_path / "a")], unused) == set()
        assert loaded_by([*run, str(tmp_path / "b"), "--no-report"], DRAWING) == set()


def test_the_public_names_are_there():
    import strapdown

    for name in strapdown.__all__:
        assert getattr(strapdown, name) is not None


ROOMS = (
    "alignment",
    "crash",
    "dsp",
    "estimation",
    "evaluation",
    "navigation",
    "sensors",
    "simulation",
)


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_exports_what_it_says_and_no_module_in_its_place(room):
    package = import_module(f"strapdown.{room}")
    for name in package.__all__:
        home = package.__dict__["_homes"][name]
        # The module first, as an import from inside does: its name must not hide the function's.
        module = import_module(f"strapdown.{room}.{home}")
        assert getattr(package, name) is getattr(module, name)
        assert not isinstance(getattr(package, name), ModuleType)
    with pytest.raises(AttributeError, match="nothing"):
        _ = package.nothing


def test_an_empty_room_loads_nothing():
    code = "; ".join(f"import strapdown.{room}" for room in ROOMS)
    assert loaded_after(code) == set()
