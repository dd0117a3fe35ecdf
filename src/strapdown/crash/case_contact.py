"""Statements of the cases of a crash about the contact: deformation, and closure."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from strapdown.config.crash_case import CaseSpec, EntrySpec, PointSpec, ReferenceSpec, VehicleSpec
from strapdown.constants import STANDARD_GRAVITY, TWO_SIDED_95
from strapdown.crash.path import at_instant
from strapdown.crash.reconstruction import CrashReconstruction, UnitReconstruction
from strapdown.errors import ConfigError, DataError, Finding, add_note, add_warning

if TYPE_CHECKING:
    from strapdown.crash.case import CaseResult
    from strapdown.crash.closure import Closure, Figure, ImpactVehicle
    from strapdown.crash.deformation import Crush

#: Kinds of entry that are found from the drive before the crash.
OF_DRIVES = ("gnss", "speed_record")
#: Axes of a change of velocity that a reference may state.
AXES = {"forward": (1.0, 0.0, 0.0), "right": (0.0, 1.0, 0.0)}
#: Standard deviation of a stated mass without one: fuel, load and passengers.
MASS_SD = 0.03
#: Line of the error budget: of an entry's stated heading.
ENTRY_HEADING = "heading"


def main_event(unit: UnitReconstruction) -> int | None:
    """Number, from 0, of the event with the largest delta-V; None without an event."""
    if not unit.body:
        return None
    return max(range(len(unit.body)), key=lambda k: unit.body[k].event.resultant)


@dataclass(frozen=True)
class Deformation:
    """Crush and energy of a vehicle, as far as its case has what they need.

    `crush`: against a barrier: by the main answer, then by every recorder. `impulses`, N s: of the
    measured forces on it, with the names of their references. `energy`, J: from the residual crush
    and the stiffness; with the mass its `equivalent_speed`, m/s.
    """

    crush: tuple[Crush, ...] = ()
    impulses: tuple[tuple[str, Figure], ...] = ()
    energy: Figure | None = None
    equivalent_speed: Figure | None = None

    def __bool__(self) -> bool:
        return bool(self.crush or self.impulses or self.energy)


def deformed(
    spec: CaseSpec, made: CrashReconstruction, tables: Mapping[str, pd.DataFrame]
) -> tuple[Deformation, tuple[ReferenceSpec, ...]]:
    """Deformation of the vehicle, and its references with the forces as changes of velocity."""
    vehicle, number = spec.vehicle, main_event(made.main)
    forces = [one for one in spec.references if one.kind == "force"]
    if vehicle.deformation is None and vehicle.against != "barrier" and not forces:
        return Deformation(), tuple(spec.references)
    from strapdown.crash.deformation import (
        crush_energy,
        dynamic_crush,
        energy_equivalent_speed,
        impulse_of,
    )

    energy = equivalent = None
    if (d := vehicle.deformation) is not None:
        energy = crush_energy(
            d.crush_m,
            (d.width_m, d.width_sd_m),
            (d.stiffness_a_n_per_m, d.stiffness_a_sd_n_per_m),
            (d.stiffness_b_n_per_m2, d.stiffness_b_sd_n_per_m2),
            crush_sd=d.crush_sd_m,
            angle_deg=(d.angle_deg, d.angle_sd_deg),
        )
        if vehicle.mass_kg is not None:
            equivalent = energy_equivalent_speed(energy, _mass(vehicle, vehicle.mass_kg))
    crushed: list[Crush] = []
    if vehicle.against == "barrier":
        for unit in dict.fromkeys((made.main, *made.units)):
            own = main_event(unit)
            if own is not None:
                found = dynamic_crush(unit.name, unit.path, unit.events.events[own])
                crushed += [found] if found is not None else []
    impulses, stated = [], []
    for reference in spec.references:
        if reference.kind != "force":
            stated.append(reference)
            continue
        if number is None:
            raise ConfigError(
                "crash.force-without-event",
                quantity=f"references, {reference.name}",
                name=made.main.name,
            )
        # A part of the contact would not do: until it ends, its parts move against each other.
        whole = made.main.body[number].event.delta_v
        span = (whole.start, whole.end)
        assert reference.path is not None and reference.force_sd_percent is not None
        table = tables[reference.path]
        try:
            impulse = impulse_of(
                table.index.to_numpy(),
                table["force"].to_numpy(),
                span,
                reference.force_sd_percent / 100.0,
            )
        except DataError as error:
            raise error.replaced(file=table.attrs["source"]) from None
        impulses.append((reference.name, impulse))
        stated.append(_as_change(reference, impulse, span, spec, made.main))
    return Deformation(tuple(crushed), tuple(impulses), energy, equivalent), tuple(stated)


def _mass(vehicle: VehicleSpec, mass: float) -> tuple[float, float]:
    """Mass, and its standard deviation."""
    return mass, vehicle.mass_sd_kg or MASS_SD * mass


def _as_change(
    reference: ReferenceSpec,
    impulse: Figure,
    span: tuple[float, float],
    spec: CaseSpec,
    main: UnitReconstruction,
) -> ReferenceSpec:
    """A measured force as the change of velocity that it makes.

    Records of forces have either sign: it takes that of the change that the recorders measure. The
    tires may have made a part of this, up to their friction, in an unknown direction.
    """
    assert spec.vehicle.mass_kg is not None
    mass, mass_sd = _mass(spec.vehicle, spec.vehicle.mass_kg)
    size, sd = impulse.value / mass, impulse.half_width / TWO_SIDED_95 / mass
    tires = 0.5 * spec.options.tire_friction * STANDARD_GRAVITY * (span[1] - span[0])
    sign = 1.0
    if reference.axis != "resultant":
        change = main.delta_v
        along = 0.0 if change is None else float(change.delta_v.vector @ AXES[reference.axis])
        sign = -1.0 if along < 0.0 else 1.0
    return reference.model_copy(
        update={
            "path": None,
            "delta_v_m_per_s": sign * size,
            "delta_v_sd_m_per_s": math.hypot(sd, size * mass_sd / mass, tires),
            "over_s": span,
        }
    )


def closed_together(first: CaseResult, second: CaseResult) -> tuple[CaseResult, CaseResult]:
    """Both results with their closure, and with what contradicts it."""
    from strapdown.crash.closure import blame, blame_points, close_vehicles
    from strapdown.crash.deformation import energy_share, equal_force_share

    names = first.vehicle_names
    pair, findings = [], []
    for result, name in zip((first, second), names, strict=True):
        vehicle = _vehicle_of(result, result.reconstruction.main, name)
        if vehicle is None:
            findings.append(Finding("crash.closure-without-change", quantity="closure", name=name))
        else:
            pair.append(vehicle)
    closure = blamed = None
    if len(pair) == 2:
        friction = max(r.spec.options.tire_friction for r in (first, second))
        energies = [e for r in (first, second) if (e := r.deformation.energy) is not None]
        depths = [r.spec.vehicle for r in (first, second) if r.spec.vehicle.crush_m is not None]
        share = None
        if len(energies) == 2:
            share = energy_share(*energies)
        elif len(depths) == 2:
            share = equal_force_share(*((v.crush_m or 0.0, v.crush_sd_m) for v in depths))
        elif energies or depths:
            add_note(findings, "crash.crush-of-one", quantity="vehicle, crush_m")
        closure = close_vehicles(*pair, friction=friction, energy_share=share)
        findings += closure.findings
        findings += _deformation_apart((first, second), closure)
        blamed = blame(*pair, friction=friction) if closure.contradicted else None
        findings += [one.finding for one in blamed.candidates] if blamed is not None else []
        for result, other in ((first, pair[1]), (second, pair[0])):
            units = result.reconstruction.units
            points = [_vehicle_of(result, unit, unit.name) for unit in units]
            known = [p for p in points if p is not None]
            if len(known) > 1:
                findings += blame_points(known, other, friction=friction)
    return (
        replace(first, closure=closure, blame=blamed, findings=_once([*first.findings, *findings])),
        replace(
            second, closure=closure, blame=blamed, findings=_once([*second.findings, *findings])
        ),
    )


def closed_against_barrier(result: CaseResult) -> CaseResult:
    """A result with what it says against a rigid barrier."""
    from strapdown.crash.closure import against_barrier

    name = result.vehicle_names[0]
    vehicle = _vehicle_of(result, result.reconstruction.main, name)
    if vehicle is None:
        lacking = Finding("crash.closure-without-change", quantity="closure", name=name)
        return replace(result, findings=_once([*result.findings, lacking]))
    closure = against_barrier(vehicle, friction=result.spec.options.tire_friction)
    findings = [*result.findings, *closure.findings]
    apart = closure.separation_speed
    if closure.contradicted:
        findings.append(Finding("crash.no-rigid-barrier", quantity="vehicle, against", name=name))
    elif apart is not None and apart.high < 0.0:
        add_warning(
            findings,
            "crash.moves-on-at-barrier",
            quantity="vehicle, against",
            name=name,
            value=-apart.value,
            low=-apart.high,
        )
    findings += _deformation_apart((result,), closure)
    return replace(result, closure=closure, findings=_once(findings))


def _deformation_apart(results: Sequence[CaseResult], closure: Closure) -> Iterator[Finding]:
    """What contradicts the residual crush: the energy that was lost, and the dynamic crush."""
    energies = [r.deformation.energy for r in results if r.deformation.energy is not None]
    lost = closure.energy
    if len(energies) == len(results) and lost is not None:
        whole = math.fsum(e.value for e in energies)
        half = math.hypot(lost.half_width, *(e.half_width for e in energies))
        if abs(whole - lost.value) > half:
            yield Finding(
                "crash.deformation-energy-apart",
                quantity="vehicle, deformation",
                energy=1e-3 * whole,
                lost=1e-3 * lost.value,
                half=1e-3 * half,
            )
    for result in results:
        residual, dynamic = result.spec.vehicle.deformation, result.deformation.crush[:1]
        if residual is None or not dynamic or dynamic[0].at_least:
            continue
        deepest, least = max(residual.crush_m), TWO_SIDED_95 * residual.crush_sd_m
        if deepest - dynamic[0].depth.value > math.hypot(dynamic[0].depth.half_width, least):
            yield Finding(
                "crash.residual-crush-above-dynamic",
                quantity="vehicle, deformation",
                residual=deepest,
                dynamic=dynamic[0].depth.value,
            )


def _once(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    return tuple(dict.fromkeys(findings))


def _vehicle_of(result: CaseResult, unit: UnitReconstruction, name: str) -> ImpactVehicle | None:
    spec = result.spec
    return impact_vehicle(unit, name, spec.vehicle, spec.entry, spec.point)


def impact_vehicle(
    unit: UnitReconstruction, name: str, vehicle: VehicleSpec, entry: EntrySpec, point: PointSpec
) -> ImpactVehicle | None:
    """A vehicle by one of its answers, at the reference point; None without a resolved change.

    Its axes are those at the onset of the contact, over which its change of velocity is. The bound
    of that is of the resolved change, with what the vehicle may have turned since, but for the
    heading of the entry, which turns the entry velocity, too, and is an unknown of its own.
    """
    from strapdown.crash.closure import ImpactVehicle

    number = main_event(unit)
    over_ground = None if number is None else unit.ned[number]
    if number is None or over_ground is None:
        return None
    change, path = over_ground.event, unit.path
    start, end = change.delta_v.start, change.delta_v.end
    heading = float(np.interp(start, path.time, np.unwrap(path.table["heading"], period=360.0)))
    turned = np.radians(heading)
    into_body = np.array(
        [[np.cos(turned), np.sin(turned), 0.0], [-np.sin(turned), np.cos(turned), 0.0], [0, 0, 1.0]]
    )
    velocity = at_instant(path, start, ("VN", "VE"))
    speed = float(np.linalg.norm(velocity))
    sd = entry.speed_sd_m_per_s or 0.0
    across = speed * math.radians(entry.slip_sd_deg)
    heading_sd: float | None = entry.heading_sd_deg
    if entry.kind in OF_DRIVES:
        sd = across = float(path.sd[["VN", "VE"]].iloc[path.anchor].max())
        if entry.kind == "gnss":
            heading_sd = float(path.sd["heading"].iloc[path.anchor])
    # The path of a vehicle that stood is in its own axes.
    stated = entry.heading_deg if entry.kind == "standstill" else 0.0
    rate = rate_change = None
    if "heading" not in unit.at_point.assumed_axes:
        rate, rate_change = _yaw_rates(unit, start, end)
    parts = change.bound.by_contributor.drop(index=ENTRY_HEADING, errors="ignore")
    covariance = parts.to_numpy().sum(axis=0).reshape(3, 3)
    mass, origin = vehicle.mass_kg, point.position_m
    return ImpactVehicle(
        name,
        into_body @ change.delta_v.vector,
        into_body @ covariance @ into_body.T,
        end - start,
        mass=None if mass is None else _mass(vehicle, mass),
        heading_deg=(heading + stated, heading_sd) if heading_sd else None,
        entry=into_body[:2, :2] @ velocity,
        entry_covariance=np.diag([sd**2, across**2]),
        rate=rate,
        rate_change=rate_change,
        contact=None
        if vehicle.contact_m is None
        else (
            vehicle.contact_m[0] - origin[0],
            vehicle.contact_m[1] - origin[1],
            vehicle.contact_sd_m,
        ),
    )


def _yaw_rates(
    unit: UnitReconstruction, start: float, end: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Yaw rate at an instant, and its change until another, each with its sd, deg/s."""
    of, effects = unit.at_point, unit.at_point.effects
    first, last = np.searchsorted(of.time, [start, end]).clip(0, len(of.time) - 1)
    by_unknowns = effects.rate[:, :, 2]
    noise = float(np.median(effects.rate_noise[:, 2]))
    sd = math.hypot(float(np.linalg.norm(by_unknowns[:, first])), noise)
    apart = by_unknowns[:, last] - by_unknowns[:, first]
    change_sd = math.hypot(float(np.linalg.norm(apart)), math.sqrt(2.0) * noise)
    yaw = np.degrees(of.rate[:, 2])
    return (
        (float(yaw[first]), math.degrees(sd)),
        (float(yaw[last] - yaw[first]), math.degrees(change_sd)),
    )
