"""`simulate`: samples, fixes and exact truth of a scenario, a trajectory or a crash, in memory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import as_file, files
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from strapdown.api.reading import GnssFixes, Imu
from strapdown.attitude_comparison.source import simulate_scenario
from strapdown.bundle import Seal
from strapdown.config.motions import FIXES_FORMS, TrajectorySpec
from strapdown.config.sources import (
    CrashSimulationSpec,
    ScenarioSpec,
    SimulateSpec,
    is_scenario_file,
)
from strapdown.config.spec import specify
from strapdown.errors import ConfigError, check_choice
from strapdown.simulation import SCENARIOS, GnssReceiver, simulate_gnss
from strapdown.simulation.crash_cases import CASES, RecordedCase, find_case, record_case
from strapdown.systems.trajectory_source import SimulatedTrajectory, simulate_trajectory

if TYPE_CHECKING:
    import pandas as pd

    from strapdown.sensors.crash_unit import CrashUnit


@dataclass(frozen=True, eq=False, repr=False)
class Simulation:
    """A simulated motion, with its samples and its exact truth. `save` writes it.

    Attributes
    ----------
    name : str
    imu : Imu or None
        Samples in body axes; None for a crash, whose recorders have their own clocks.
    truth : DataFrame
        Exact, on the stamps of `imu`: the attitude of a scenario; position, velocity and attitude
        of a trajectory. Of a crash the path of the reference point, by time from the impact.
    gnss : GnssFixes or None
        Fixes along a trajectory.
    recorders : mapping of str to CrashUnit
        Recorders of a crash by name, as `reconstruct_crash` takes them.
    """

    name: str
    imu: Imu | None
    truth: pd.DataFrame
    gnss: GnssFixes | None = None
    recorders: Mapping[str, CrashUnit] = field(default_factory=dict)
    _source: SimulateSpec | TrajectorySpec | CrashSimulationSpec = field(kw_only=True)
    _made: object = field(kw_only=True)

    def save(
        self,
        out: str | Path,
        *,
        formats: str | Sequence[str] | None = None,
        fixes: str | None = None,
        force: bool = False,
    ) -> Seal:
        """Write log and truth as a sealed bundle, which `verify` runs again.

        Parameters
        ----------
        out : str or Path
            New folder.
        formats : str or sequence of str
            Of the log: ``csv``, ``npz``, ``h5``, ``mat`` or ``all``; of a crash ``csv``, ``mme``.
            By default those of the trajectory's file, else ``csv``.
        fixes : {'csv', 'none'}, optional
            Of the fixes along a trajectory; by default as its file says, else ``csv``. Those of a
            receiver that is given in Python are not written, because the file does not state it.
        force : bool
            Overwrite an existing bundle.

        Returns
        -------
        Seal
            Its folder has ``log.*`` (rad/s, m/s², body forward-right-down, with the true attitude),
            ``scenario.json``, and ``truth.csv`` or ``fixes.csv`` and ``trajectory.csv``. Of a
            crash: the records, ``cameras.csv``, ``truth.csv``, ``scenario.json`` and ``case.toml``.

        Raises
        ------
        ConfigError
            A format is unknown, or `out` may not be written.
        """
        from strapdown.report.crash_simulation import write_crash_simulation
        from strapdown.report.simulation import write_simulation, write_trajectory_simulation

        wanted = [formats] if isinstance(formats, str) else formats
        if wanted is not None and not wanted:
            raise ConfigError("report.none-named", quantity="--format")
        told: dict[str, Any] = {}
        if wanted is not None:
            told["formats"] = tuple(f.lower() for f in wanted)
        if fixes is not None:
            check_choice("report.no-writer", FIXES_FORMS, quantity="--fixes", name=fixes)
            if self.gnss is None:
                raise ConfigError("report.no-fixes", quantity="--fixes", name=self.name)
            told["fixes"] = fixes
        source = self._source.model_copy(update=told)
        write = {
            SimulateSpec: write_simulation,
            TrajectorySpec: write_trajectory_simulation,
            CrashSimulationSpec: write_crash_simulation,
        }[type(source)]
        seal: Seal = write(source, Path(out), force=force, made=self._made)  # type: ignore[operator]
        return seal

    def __repr__(self) -> str:
        if self.imu is None:
            return f"<Simulation {self.name}: {', '.join(self.recorders)}>"
        span = float(self.imu.index[-1] - self.imu.index[0])
        fixes = "" if self.gnss is None else f", {len(self.gnss)} fixes"
        return f"<Simulation {self.name}: {len(self.imu)} samples, {span:.6g} s{fixes}>"


def simulate(
    source: str | Path,
    *,
    rate_hz: float | None = None,
    sampling: str | None = None,
    seed: int | None = None,
    sensor: str | None = None,
    receiver: GnssReceiver | None = None,
    recorders: Sequence[str] = (),
) -> Simulation:
    """Simulate a scenario, a trajectory or a crash.

    Arguments that are None take the value of the trajectory, else the default stated here.

    Parameters
    ----------
    source : str or Path
        Name of a scenario, of a crash, or of a trajectory (``drive-town``), or the file of a
        scenario or a trajectory, which ends in ``.toml``.
    rate_hz : float
        100; for a crash each recorder's own rate.
    sampling : {'instantaneous', 'mean'}
        The rate at each stamp (default), or its exact mean over the interval that ends there.
    seed : int
        Of the errors; 0.
    sensor : str, optional
        Of the catalogue, or a file in the same form: the errors of one unit, drawn with the seed,
        replace those of the scenario.
    receiver : GnssReceiver, optional
        Of the fixes along a trajectory; by default that of its file, else 5 Hz, white noise of 1 m
        and 0.1 m/s.
    recorders : sequence of str
        For a crash: names of its recorders, or ``all``.

    Raises
    ------
    ConfigError
        The source, the rate, the sampling or the sensor is unknown, or an entry of the file is
        invalid; the message names the key.
    """
    name = str(source)
    if name.lower() in CASES:
        if sensor is not None:
            raise ConfigError("report.recorders-crash-parts-their-own", quantity="--sensor")
        crash = specify(
            CrashSimulationSpec,
            name=name.lower(),
            units=tuple(recorders),
            rate_hz=rate_hz,
            sampling=(sampling or "instantaneous").lower(),
            seed=seed or 0,
        )
        return _crash(crash)
    if recorders:
        raise ConfigError("report.no-crash-no-recorders", quantity="--units", name=name)
    stated: dict[str, Any] = {
        "rate_hz": rate_hz,
        "sampling": sampling and sampling.lower(),
        "seed": seed,
        "sensor": sensor,
    }
    if name.lower().endswith(".toml"):
        if is_scenario_file(Path(name)):
            return _scenario(ScenarioSpec.of_file(Path(name), **stated))
        return _trajectory(TrajectorySpec.read(Path(name), **stated), receiver)
    packaged = files("strapdown").joinpath("simulation", "trajectories")
    trajectories = {
        entry.name.removesuffix(".toml"): entry
        for entry in packaged.iterdir()
        if entry.name.endswith(".toml")
    }
    if name.lower() in trajectories:
        with as_file(trajectories[name.lower()]) as path:
            return _trajectory(TrajectorySpec.read(path, **stated), receiver)
    if name.lower() not in SCENARIOS:
        raise ConfigError(
            "report.no-scenario-no-crash",
            quantity="scenario",
            name=name,
            word=name.lower(),
            known=[*SCENARIOS, *trajectories, *CASES],
        )
    scenario = specify(
        ScenarioSpec,
        name=name.lower(),
        rate_hz=100.0 if rate_hz is None else rate_hz,
        sampling=(sampling or "instantaneous").lower(),
        seed=seed or 0,
        sensor=sensor,
    )
    return _scenario(scenario)


def _scenario(scenario: ScenarioSpec) -> Simulation:
    imu, truth = simulate_scenario(scenario)
    spec = specify(SimulateSpec, scenario=scenario)
    return Simulation(scenario.name, _imu(imu), truth, _source=spec, _made=(imu, truth))


def _imu(table: pd.DataFrame) -> Imu:
    """The samples as the public type, with their kind of sampling."""
    imu = Imu(table)
    imu.attrs = dict(table.attrs)
    return imu


def _trajectory(spec: TrajectorySpec, receiver: GnssReceiver | None) -> Simulation:
    made: SimulatedTrajectory = simulate_trajectory(spec)
    motion, _, imu, _, trajectory, fixes = made
    if receiver is not None:
        spec = spec.model_copy(update={"fixes": "none"})
        fixes = simulate_gnss(motion, receiver, seed=spec.seed, source=spec.name)
    gnss = GnssFixes(fixes)
    gnss.attrs = dict(fixes.attrs)
    return Simulation(spec.name, _imu(imu), trajectory, gnss, _source=spec, _made=made)


def _crash(spec: CrashSimulationSpec) -> Simulation:
    made: RecordedCase = record_case(
        find_case(spec.name), spec.units, rate=spec.rate_hz, sampling=spec.sampling, seed=spec.seed
    )
    recorders = MappingProxyType({one.unit.name: one.unit for one in made.units})
    return Simulation(spec.name, None, made.truth, recorders=recorders, _source=spec, _made=made)
