"""Write extrinsics as a sealed bundle: page, JSON, TOML with the bridges to other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from strapdown import rotation
from strapdown.bundle import write_json
from strapdown.config.navigation import ExtrinsicsSpec
from strapdown.config.toml_text import array, number, string
from strapdown.evaluation.extrinsics import Estimate
from strapdown.navigation.record import innovation_labels
from strapdown.report import document
from strapdown.report.chart import AXIS_COLOURS, GREY, Chart, Panel, curve
from strapdown.report.report_bundle import bundle_by_specification, finite, with_page
from strapdown.report.values import bounded
from strapdown.systems.extrinsics_run import ExtrinsicsRun, run_extrinsics
from strapdown.tables.checks import index_of

DEG = np.pi / 180.0
CONVENTION = (
    "v_a = R v_b: R turns a vector from the axes of b into those of a (of the gyros: those of "
    "accelerometers differ by their misalignment)",
    "lever arm: from the origin of a to that of b, along the axes of a",
    "t_b = t_a + offset + drift (t_a - middle): stamps of one instant",
)
#: What b is, by kind.
OTHER = {"imu": "unit", "magnetometer": "magnetometer", "gnss": "antenna"}
#: Names of a parameter, its factor and unit; by the longest beginning of its name.
SHOWN = {
    "lever_arm": ("lever arm", 1.0, "m"),
    "time_offset": ("time offset", 1e3, "ms"),
    "clock_drift": ("clock drift", 1e6, "ppm"),
    "mounting_pitch": ("mounting, pitch", 1.0 / DEG, "deg"),
    "mounting_yaw": ("mounting, yaw", 1.0 / DEG, "deg"),
    "gyro_bias": ("gyro bias, a less b", 1.0 / DEG, "deg/s"),
    "accel_bias": ("accelerometer bias, a less b", 1.0, "m/s²"),
    "hard_iron": ("hard iron", 1.0, "unit of b"),
}
METHOD = (
    "Time offset by correlation of the rates, or of the change of the field; then "
    "all parameters together by least squares with whitened residuals.",
    "Bounds: covariance of the residuals summed over blocks, so that correlated residuals count, "
    "with Student's t of the blocks that determine a parameter.",
    "Assumed beside: scale factors and nonorthogonality of 1 to 2 %, accelerometers misaligned to "
    "the gyros by 0.6 deg. A difference of the delays of filters is part of the offset.",
)
METHOD_GNSS = (
    "Lever arm, offset of the stamps, and mounting of the unit in the vehicle are states of the "
    "error-state filter, smoothed over the whole record: about the result of the pass before, with "
    "its offset, until arm and offset stay where they are (Gauss-Newton).",
    "Each pass begins with an unknown position, velocity and attitude: an alignment by the same "
    "fixes would use them twice, with arm and offset as they were assumed.",
    "A state is observable where the record leaves a quarter of its variance at most.",
)


def _write_data(result: ExtrinsicsRun, folder: Path) -> None:
    write_json(folder / "extrinsics.json", extrinsics_json(result))
    text = extrinsics_toml(result)
    (folder / "extrinsics.toml").write_text(text, encoding="utf-8", newline="\n")


def extrinsics_json(result: ExtrinsicsRun) -> dict[str, Any]:
    """Return the extrinsics as plain data for programs, in SI.

    Returns
    -------
    dict
        ``estimates`` by name with ``covariance`` in their order; ``rotation`` R and ``transform``
        T_ab; the convention in words; the findings.
    """
    found = result.result
    return finite(
        {
            "kind": found.kind,
            "a": result.name,
            "b": result.other,
            "convention": list(CONVENTION),
            "span_s": [found.start, found.end],
            "middle_s": found.middle,
            "rotation": None if found.rotation is None else found.rotation.tolist(),
            "transform": result.transform.tolist(),
            "soft_iron": None if found.soft_iron is None else found.soft_iron.tolist(),
            "estimates": {one.name: {**vars(one)} for one in found.estimates},
            "covariance": found.covariance.tolist(),
            "not_observable": {
                group: [axis.tolist() for axis in axes] for group, axes in found.hidden.items()
            },
            "residual_before_after": {k: list(v) for k, v in found.residual.items()},
            "findings": [one.plain("cli") for one in result.findings],
        }
    )


def _angles(result: ExtrinsicsRun) -> tuple[np.ndarray, np.ndarray]:
    """Roll, pitch, yaw of R and their 95 % bounds, deg."""
    found = result.result
    assert found.rotation is not None
    angles = rotation.euler_from_dcm(found.rotation)
    angles = (angles + 180.0) % 360.0 - 180.0
    names = [one.name for one in found.estimates]
    at = [names.index(f"rotation_{axis}") for axis in "xyz"]
    sd = rotation.euler_sd(angles, found.covariance[np.ix_(at, at)])
    wider = max(found.estimates[k].bound / max(found.estimates[k].sd, 1e-300) for k in at)
    return angles, wider * sd


def _chosen(result: ExtrinsicsRun, group: str) -> list[Estimate]:
    return [one for one in result.result.estimates if one.name.startswith(group)]


def extrinsics_toml(result: ExtrinsicsRun) -> str:
    """The extrinsics with the lines that kalibr, ROS, URDF and a navigation configuration take."""
    found = result.result
    lines = [*(f"# {text}" for text in CONVENTION), "", f"kind = {string(found.kind)}"]
    lines += [f"a = {string(result.name)}", f"b = {string(result.other)}"]
    if found.rotation is not None:
        angles, bounds = _angles(result)
        seen = all(one.observed for one in _chosen(result, "rotation"))
        rows = ", ".join(array([float(x) for x in row]) for row in found.rotation)
        lines += ["", "[rotation]", f"matrix = [{rows}]"]
        lines += [f"roll_pitch_yaw_deg = {array([float(x) for x in angles])}"]
        lines += [f"bound_95_deg = {array([float(x) for x in bounds])}"]
        lines += [f"observable = {str(seen).lower()}"]
    if arm := _chosen(result, "lever_arm"):
        lines += ["", "[lever_arm]", f"m = {array([one.value for one in arm])}"]
        lines += [f"bound_95_m = {array([one.bound for one in arm])}"]
        flags = ", ".join(str(one.observed).lower() for one in arm)
        lines += [f"observable = [{flags}]"]
    lines += ["", "[clock]", f"middle_s = {float(found.middle)!r}"]
    for one in (*_chosen(result, "time_offset"), *_chosen(result, "clock_drift")):
        key = "offset_s" if one.name == "time_offset" else "drift"
        lines += [f"{key} = {number(one.value)}", f"{key}_bound_95 = {number(one.bound)}"]
    if found.soft_iron is not None:
        iron = [one.value for one in _chosen(result, "hard_iron")]
        rows = ", ".join(array([float(x) for x in row]) for row in found.soft_iron)
        lines += ["", "[magnetometer]", f"hard_iron = {array(iron)}", f"soft_iron = [{rows}]"]
    lines += ["", "[bridge]", *(f"{k} = {string(text)}" for k, text in bridges(result).items())]
    if found.kind == "gnss":
        lines += ["", *(f"# {line}" if line else "" for line in navigation_lines(result))]
    return "\n".join(lines) + "\n"


def bridges(result: ExtrinsicsRun) -> dict[str, str]:
    """The transform as other programs write it: kalibr, ROS 2 and URDF."""
    T = result.transform
    inverse = np.linalg.inv(T)
    x, y, z = (f"{v:.6g}" for v in T[:3, 3])
    q = rotation.quaternion_from_dcm(T[:3, :3])
    roll, pitch, yaw = np.radians((rotation.euler_from_dcm(T[:3, :3]) + 180.0) % 360.0 - 180.0)
    rows = ", ".join("[" + ", ".join(f"{v:.9g}" for v in row) + "]" for row in inverse)
    turn = " ".join(f"--q{k} {v:.9g}" for k, v in zip("xyzw", (*q[1:], q[0]), strict=True))
    return {
        "kalibr": f"T_i_b: [{rows}]",
        "ros2": "ros2 run tf2_ros static_transform_publisher "
        f"--x {x} --y {y} --z {z} {turn} --frame-id a --child-frame-id b",
        "urdf": f'<origin xyz="{x} {y} {z}" rpy="{roll:.9g} {pitch:.9g} {yaw:.9g}"/>',
    }


def navigation_lines(result: ExtrinsicsRun) -> list[str]:
    """Lines of a navigation configuration with what the drive shows of an antenna."""
    lines = ["[aiding.gnss]"]
    if arm := _chosen(result, "lever_arm"):
        lines.append(f"lever_arm_m = {array([round(one.value, 3) for one in arm])}")
        lines.append(f"lever_arm_sd_m = {array([float(f'{one.sd:.2g}') for one in arm])}")
    for one in _chosen(result, "time_offset"):
        lines += [f"time_offset_s = {one.value:.4f}", f"time_offset_sd_s = {one.sd:.2g}"]
    if mounting := _chosen(result, "mounting"):
        lines += ["", "[aiding.no_slip]"]
        lines += [f"{one.name[9:]}_deg = {one.value / DEG:.3f}" for one in mounting]
        sds = array([float(f"{one.sd / DEG:.2g}") for one in mounting])
        lines.append(f"mounting_sd_deg = {sds}")
    return lines


# The answer, which page and terminal share.


def headline(result: ExtrinsicsRun) -> str:
    """Say what was compared, and how well both agree."""
    found = result.result
    span = f"{found.end - found.start:.4g} s"
    agree = {
        "gyro": ("rates", 1.0 / DEG, "deg/s"),
        "accel": ("specific forces", 1.0, "m/s²"),
        "mag": ("fields", 100.0, "%"),
    }
    parts = [
        f"{agree[k][0]} differ by {agree[k][1] * after:.3g} {agree[k][2]}, before by "
        f"{agree[k][1] * before:.3g} (rms)"
        for k, (before, after) in found.residual.items()
    ]
    return f"{result.name} (a) and {OTHER[found.kind]} {result.other} (b), {span}: " + (
        "; ".join(parts) or "states of a smoothed run"
    )


def table(result: ExtrinsicsRun) -> document.TableBlock:
    """Return the parameters with their bounds."""
    rows = []
    if result.result.rotation is not None:
        seen = all(one.observed for one in _chosen(result, "rotation"))
        for word, value, bound in zip(("roll", "pitch", "yaw"), *_angles(result), strict=True):
            rows.append((f"rotation R, {word}", *_value(value, bound, 1.0), "deg", _seen(seen)))
    for one in result.result.estimates:
        key = next((k for k in SHOWN if one.name.startswith(k)), None)
        if key is None:
            continue
        words, factor, unit = SHOWN[key]
        axis = f" {one.name[-1]}" if one.name[-2:] in ("_x", "_y", "_z") else ""
        state = _seen(one.observed)
        if one.prior_share >= 0.05:
            state += f", {one.prior_share:.0%} assumed"
        rows.append((words + axis, *_value(one.value, one.bound, factor), unit, state))
    columns = ("parameter", "value", "±, 95 %", "unit", "")
    return document.TableBlock(columns, tuple(rows), (0, 3, 4), "; ".join(CONVENTION) + ".")


def _seen(observed: bool) -> str:
    return "observable" if observed else "NOT observable"


def _value(value: float, bound: float, factor: float) -> tuple[str, str]:
    """Value and bound."""
    said, half = bounded(factor * value, factor * bound)
    return said, half.removeprefix("±").strip() or "–"


def extrinsics_document(result: ExtrinsicsRun, name: str = "") -> document.Document:
    """Return the report of the extrinsics of two sensors."""
    found = result.result
    gnss = found.kind == "gnss"
    lines = "\n".join(navigation_lines(result)) if gnss else None
    sections = (
        document.section("match", "Match", match_chart(result)),
        document.section(
            "navigation", "For a navigation configuration", document.paragraph(lines, "mono")
        ),
        document.section(
            "bridge", "For another program", document.Items(tuple(bridges(result).items()))
        ),
        document.section(
            "method", "Method", document.listed(METHOD_GNSS if gnss else METHOD), folded=True
        ),
        document.section("again", "Check this folder", *document.run_again(name)),
    )
    good = all(one.observed for one in found.estimates)
    return document.document_of(
        result.name,
        "Extrinsics",
        (("Used", f"{found.start:.6g} s to {found.end:.6g} s"),),
        (
            document.Paragraph(headline(result), "lead" if good else "warning"),
            table(result),
            document.findings_list(result.findings, "cli") if result.findings else None,
        ),
        sections,
        links=(
            ("extrinsics.json", "estimates with covariance, SI"),
            ("extrinsics.toml", "matrices and lines for other programs"),
        ),
    )


def match_chart(result: ExtrinsicsRun) -> Chart:
    """Return what a measured, and what b measured before and after the fit, by axis."""
    found = result.result
    time = index_of(found.series)
    if found.kind == "gnss":
        panels = [
            Panel(label, (curve(label, time, found.series[f"nu {label}"], AXIS_COLOURS[k % 3]),))
            for k, label in enumerate(innovation_labels(found.series))
        ]
        title = "Innovations of position with these states"
        return Chart("match", title, "", "time, s", tuple(panels))
    factor, label = (1.0 / DEG, "deg/s") if found.kind == "imu" else (1.0, "share of the field")
    panels = []
    for axis, colour in zip("xyz", AXIS_COLOURS, strict=True):
        of = {w: factor * found.series[f"{w}_{axis}"].to_numpy() for w in ("a", "before", "after")}
        lines = (
            curve("b, before", time, of["before"], GREY, width=0.8),
            curve("a", time, of["a"], "#000000"),
            curve("b, after", time, of["after"], colour, "dash"),
        )
        panels.append(Panel(f"{axis}, {label}", lines))
        left = (curve("a less b, after", time, of["a"] - of["after"], colour),)
        panels.append(Panel(f"a less b, {axis}", left))
    what = "Rates" if found.kind == "imu" else "Field"
    return Chart("match", f"{what} of a and b, before and after", "", "time of a, s", tuple(panels))


#: Page, JSON and TOML of two sensors.
EXTRINSICS = bundle_by_specification(
    "extrinsics", ExtrinsicsSpec, run_extrinsics, with_page(_write_data, extrinsics_document)
)
