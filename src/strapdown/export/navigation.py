"""A step of a mechanization as C: motion increments to position, velocity and attitude."""

from __future__ import annotations

import numpy as np

from strapdown import rotation
from strapdown._kernels import level
from strapdown.ellipsoids import find_ellipsoid
from strapdown.export.device import comment, number, unpacked
from strapdown.export.kernels import Kernels
from strapdown.export.program import Harness, StepParts, listed
from strapdown.mechanization import Mechanization, WanderAzimuth
from strapdown.nav_state import NavState
from strapdown.tables.checks import Array

#: Start of the test: latitude and longitude in rad, m; m/s; and the attitude.
PLACE, VELOCITY = (0.96875, 0.65625, 150.0), (20.0, -30.0, 0.5)
ATTITUDE = tuple(rotation.quaternion_from_euler([5.0, -10.0, 130.0]).tolist())

_NAVIGATION = """\
struct navigation {{
{state}
    real_t state[{size}];
}};

/* Start: latitude and longitude in rad, height over the ellipsoid in m; velocity north, east, down
 * in m/s; unit quaternion body to north-east-down.
 */
void navigation_init(struct navigation *n, const real_t place[3], const real_t v_n[3],
    const real_t q_nb[4]);

/* Motion increments between two samples, rates in rad/s and specific forces in m/s² at their
 * instants and linear between: rotation vector in rad, and the first and second integral of the
 * specific force in the body axes of the start, m/s and m.
 */
void navigation_increments(real_t dt, const real_t gyro_before[3], const real_t accel_before[3],
    const real_t gyro[3], const real_t accel[3], real_t increments[9]);

{about}
int navigation_step(struct navigation *n, real_t dt, const real_t increments[9]{argument});

/* Position, velocity and attitude, as of navigation_init{wrap}. */
void navigation_read(const struct navigation *n, real_t place[3], real_t v_n[3], real_t q_nb[4]);
"""

_NAVIGATION_CODE = """\
{init}
void navigation_increments(real_t dt, const real_t gyro_before[3], const real_t accel_before[3],
    const real_t gyro[3], const real_t accel[3], real_t increments[9])
{{
{increments}
}}

int navigation_step(struct navigation *n, real_t dt, const real_t increments[9]{argument})
{{
    /* Semi-major axis in m, square of the eccentricity, gravity at the equator in m/s²,
     * Somigliana's constant, rate of rotation in rad/s, flattening, centrifugal over gravity.
     */
    static const real_t earth[7] = {{
        {earth}}};
    /* Mode of the height and time constant of its loop in s, decrease of gravity with height in
     * 1/s²; limits: cosine of the latitude, speed in m/s, heights in m.
     */
    static const real_t options[7] = {{
        {options}}};
    real_t row[1][10], history[1][{width}];
    if (!(dt > R(0.0) && dt < LARGEST)) {{
        return -1;
    }}
    row[0][0] = dt;
    for (int i = 0; i < 9; i++) {{
        row[0][1 + i] = increments[i];
    }}
    return {advance}(n->state, row{reference}, earth, options, history);
}}

{read}"""

_NED_INIT = """\
void navigation_init(struct navigation *n, const real_t place[3], const real_t v_n[3],
    const real_t q_nb[4])
{{
    real_t *s = n->state;
    const real_t sine = SIN(place[0]);
    for (int i = 0; i < 3; i++) {{
        s[i] = place[i];
        s[3 + i] = v_n[i];
    }}
{held}    for (int i = 0; i < 4; i++) {{
        s[6 + i] = q_nb[i];
    }}
    s[10] = sine;
    s[11] = COS(place[0]);
    s[12] = R(1.0) / SQRT(R(1.0) - {squared} * sine * sine);
    s[13] = R(0.0);
    s[14] = R(0.0);
}}
"""

_NED_READ = """\
void navigation_read(const struct navigation *n, real_t place[3], real_t v_n[3], real_t q_nb[4])
{
    for (int i = 0; i < 3; i++) {
        place[i] = n->state[i];
        v_n[i] = n->state[3 + i];
    }
    for (int i = 0; i < 4; i++) {
        q_nb[i] = n->state[6 + i];
    }
}
"""

_WANDER_INIT = """\
void navigation_init(struct navigation *n, const real_t place[3], const real_t v_n[3],
    const real_t q_nb[4])
{{
    real_t *s = n->state;
    const real_t sine = SIN(place[0]);
    for (int i = 0; i < {size}; i++) {{
        s[i] = R(0.0);
    }}
    const real4 ew = wander_from_geodetic(place[0], place[1], R(0.0));
    s[0] = ew.f0; s[1] = ew.f1; s[2] = ew.f2; s[3] = ew.f3;
    s[4] = place[2];
    const real7 level = level_from_north(R(0.0), v_n[0], v_n[1], {down}, q_nb[0], q_nb[1],
        q_nb[2], q_nb[3]);
    s[5] = level.f0; s[6] = level.f1; s[7] = level.f2;
    s[8] = level.f3; s[9] = level.f4; s[10] = level.f5; s[11] = level.f6;
    const real4 ib = quat_multiply(s[0], s[1], s[2], s[3], s[8], s[9], s[10], s[11]);
    s[12] = ib.f0; s[13] = ib.f1; s[14] = ib.f2; s[15] = ib.f3;
    s[24] = R(1.0);
    s[28] = R(1.0) / SQRT(R(1.0) - {squared} * (sine * sine));
}}
"""

_WANDER_READ = """\
void navigation_read(const struct navigation *n, real_t place[3], real_t v_n[3], real_t q_nb[4])
{
    real_t row[1][12], out[1][10];
    for (int i = 0; i < 12; i++) {
        row[0][i] = n->state[i];
    }
    wander_places(row, out);
    for (int i = 0; i < 3; i++) {
        place[i] = out[0][i];
        v_n[i] = out[0][3 + i];
    }
    for (int i = 0; i < 4; i++) {
        q_nb[i] = out[0][6 + i];
    }
}
"""

_NAVIGATION_START = """\
    static const real_t place[3] = {{{place}}};
    static const real_t v_n[3] = {{{velocity}}};
    static const real_t q_nb[4] = {{
        {attitude}}};
    navigation_init(s, place, v_n, q_nb);"""

_NAVIGATION_TAKE = """\
    real_t increments[9], place[3], v_n[3], q_nb[4];
    for (int i = 0; i < 9; i++) {{
        increments[i] = R(v[1 + i]);
    }}
    if (navigation_step(s, R(v[0]), increments{argument}) != DONE) {{
        return 0;
    }}
    navigation_read(s, place, v_n, q_nb);
    for (int i = 0; i < 3; i++) {{
        out[i] = (double)place[i];
        out[3 + i] = (double)v_n[i];
    }}
    for (int i = 0; i < 4; i++) {{
        out[6 + i] = (double)q_nb[i];
    }}
    return RESULTS;"""


def navigation_parts(chosen: Mechanization) -> StepParts:
    """Parts of a mechanization; a wander azimuth has its own state, start and output."""
    wander, damped = isinstance(chosen, WanderAzimuth), chosen.height == "damped"
    options = chosen.kernel_options()
    # The kernels of a position in a wander azimuth are beside those of its corrections.
    kernels = Kernels(
        "level" if wander else "ned",
        fixed={"options[MODE]": float(options[0])},
        others=("wander", "motion_increments"),
    )
    advance = "wander_advance" if wander else "ned_advance"
    start = NavState.of_numbers(0.0, np.array([*PLACE, *VELOCITY, *ATTITUDE]))
    size = len(chosen.begin(start))
    sizes = {
        "increments": (1, 10),
        "reference": (int(damped),),
        "history": (1, chosen.row),
    }
    step = kernels.require(advance, keep=(1,), sizes=sizes)
    motion = kernels.require("linear_motion")
    if wander:
        kernels.require("wander_from_geodetic")
        kernels.require("wander_places", sizes={"history": (1, 12), "out": (1, 10)})
    ellipsoid = find_ellipsoid(chosen.ellipsoid)
    squared = number(ellipsoid.eccentricity_squared)
    held = chosen.height == "held"
    if wander:
        init = _WANDER_INIT.format(size=size, squared=squared, down="R(0.0)" if held else "v_n[2]")
        state = (
            "Quaternion level to Earth; height, m; velocity in level axes, m/s; quaternions body "
            "to level and body to inertial axes; rounding errors of sums; cosine and sine of half "
            "the Earth's angle; radius of the prime vertical; memory of the height's loop."
        )
    else:
        init = _NED_INIT.format(
            squared=squared, held="    s[5] = R(0.0); /* the height is held */\n" if held else ""
        )
        state = (
            "Latitude, longitude, rad; height, m; velocity, m/s; quaternion body to level; sine "
            "and cosine of the latitude; radius of the prime vertical; memory of the height's loop."
        )
    argument, reference = (", real_t height", ", &height") if damped else ("", "")
    before = [f"{n}_before[{i}]" for n in ("gyro",) for i in range(3)]
    now = [f"gyro[{i}]" for i in range(3)]
    forces = [f"{n}[{i}]" for n in ("accel_before", "accel") for i in range(3)]
    call = f"linear_motion({', '.join(['dt', *before, *now, *forces])})"
    rows = np.zeros((2, 10 + damped))
    # Long steps, in which the terms of higher order are seen.
    rows[:, 0] = 0.75, 0.125
    rows[1, 1:4], rows[1, 4:7], rows[1, 7:10] = 0.1, 1.0, 0.25
    rows[0, 6], rows[0, 9] = -7.25, -2.75
    if damped:
        rows[:, 10] = 150.0, 1.0
    earth = ellipsoid.parameters()

    def run(given: Array) -> Array:
        state = chosen.begin(start)
        history = np.empty((1, chosen.row))
        out, made = np.empty((len(given), 10)), 0
        for row in given:
            heights = row[10:].copy() if damped else np.empty(0)
            if not chosen.advance_rows(state, row[None, :10].copy(), heights, earth, history)[0]:
                continue
            if wander:
                level.wander_places(history, out[made : made + 1])
            else:
                out[made] = history[0]
            made += 1
        return out[:made]

    codes = {"DONE": 0, "POLE": 1, "DIVERGED": 2, "LEAP": 3}
    far = "LEAP (a step of more than 0.01 rad around the Earth)"
    pole = "POLE (beyond the limit of the latitude)"
    return StepParts(
        title=f"A step of navigation in {chosen.summary}: {chosen.source}",
        words=(
            "Axes: body forward-right-down; local level north-east-down. A step takes motion "
            "increments: the rotation vector of the body relative to inertial space, and the first "
            "and second integral of the specific force in the body axes of its start.",
            "The state needs double precision: a float holds a latitude to 0.4 m.",
        ),
        kernels=kernels,
        step=step,
        call="step",
        before=(motion, "increments"),
        memory=size,
        codes={k: v for k, v in codes.items() if k != ("POLE" if wander else "LEAP")},
        interface=_NAVIGATION.format(
            state="\n".join(comment(state, "    ")),
            size=size,
            about="\n".join(
                comment(
                    "Take a step of dt s with its motion increments"
                    + (", and the reference height in m (NAN: none)" if damped else "")
                    + f". Returns DONE; or {far if wander else pole}, DIVERGED (outside the limits "
                    "of speed and height), or -1 for a dt that is not above zero, and then has "
                    "changed nothing."
                )
            ),
            argument=argument,
            wrap="; the longitude is within half a turn" if wander else "",
        ),
        code=_NAVIGATION_CODE.format(
            init=init,
            increments=unpacked(call, [f"increments[{i}]" for i in range(9)]),
            argument=argument,
            earth=listed(earth),
            options=listed(options),
            width=chosen.row,
            advance=advance,
            reference=reference,
            read=_WANDER_READ if wander else _NED_READ,
        ),
        harness=Harness(
            "navigation",
            rows.shape[1],
            10,
            "dt and nine increments" + (", and a height" if damped else ""),
            _NAVIGATION_START.format(
                place=listed(PLACE), velocity=listed(VELOCITY), attitude=listed(ATTITUDE)
            ),
            _NAVIGATION_TAKE.format(argument=", R(v[10])" if damped else ""),
            answers=True,
        ),
        gives="latitude, longitude, height, velocity and quaternion",
        rows=rows,
        run=run,
    )
