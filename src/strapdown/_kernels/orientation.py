"""Orientation filters, sample by sample: error-state (Kalman) and complementary.

One float64 array, the record, holds everything between samples, so that a batch, a stream, and a
batch cut anywhere do the same operations. Vectors are forward-right-down in the body (b) and
north-east-down in the level frame (n); without a magnetometer "north" is the heading at the start.

Errors of the error-state filter are true - estimated, in the level frame:
``q_true = exp(delta) q``, ``b_true = b + db``, ``v_true = v + dv``.
Its state is (delta_N, delta_E, delta_D, db_x, db_y, db_z, dv_N, dv_E, da_x, da_y, da_z), with the
biases b of the gyros and a of the accelerometers.
"""

from __future__ import annotations

import math

from strapdown._kernels.compilation import njit
from strapdown._kernels.increments import LARGEST

# --- The record: what both filters have ---------------------------------------------------

TIME, SAMPLES, MEAN, STEP = 0, 1, 2, 3
RATE, Q, BIAS = 4, 7, 11
LEVELED, HEADED, AGE, GAPS = 14, 15, 16, 17
# Headed: 0 never, 1 by the field, or by the field before a gap.
LOST = -1.0
# Seconds with a magnetometer, of them disturbed, and seconds stationary.
MAG_TIME, DISTURBED_TIME, REST_TIME = 18, 19, 20
OPTIONS = 21  # five numbers of the filter
COMMON = 26

G = 9.80665
NAN = float("nan")
# Without any information: the standard deviation of an angle uniform over the circle, pi/sqrt(3).
UNKNOWN = 1.8137993642342178

# A step is a gap if it is longer than this many usual steps, and than this time.
GAP_STEPS, GAP_S = 5.0, 0.1
# In a gap the rate is unknown: its standard deviation is this, or the last rate.
GAP_RATE = 0.5  # rad/s
# Beyond this uncertainty roll and pitch are leveled anew.
RELEVEL = 0.3  # rad
# A specific force below this, as in flight, levels nothing.
WEIGHTLESS = 0.3 * G


@njit(cache=True, error_model="numpy")
def usable(x, y, z):
    """Whether three numbers are finite; NaN is not."""
    return abs(x) < LARGEST and abs(y) < LARGEST and abs(z) < LARGEST


@njit(cache=True, error_model="numpy")
def step_of(r, time, gyro, accel, mag):
    """Step to a sample, s; 0 for the first one; negative or NaN for one to be refused."""
    if gyro.shape[0] != 3 or accel.shape[0] != 3 or mag.shape[0] != 3:
        return NAN
    if not (usable(gyro[0], gyro[1], gyro[2]) and abs(time) < LARGEST):
        return NAN
    if r[SAMPLES] == 0.0:
        return 0.0
    dt = time - r[TIME]
    return dt if dt > 0.0 else -1.0


@njit(cache=True, error_model="numpy")
def turned(w, x, y, z, tx, ty, tz):
    """Quaternion turned by a rotation vector in body axes; its norm by one Newton step."""
    u = 0.25 * (tx * tx + ty * ty + tz * tz)
    if u < 0.04:
        c = 1.0 - u * (0.5 - u * (1.0 / 24.0 - u * (1.0 / 720.0)))
        s = 0.5 * (1.0 - u * (1.0 / 6.0 - u * (1.0 / 120.0 - u * (1.0 / 5040.0))))
    else:
        a = math.sqrt(u)
        c, s = math.cos(a), 0.5 * math.sin(a) / a
    tx, ty, tz = s * tx, s * ty, s * tz
    a = w * c - x * tx - y * ty - z * tz
    b = w * tx + x * c + y * tz - z * ty
    d = w * ty - x * tz + y * c + z * tx
    e = w * tz + x * ty - y * tx + z * c
    n = 1.5 - 0.5 * (a * a + b * b + d * d + e * e)
    return n * a, n * b, n * d, n * e


@njit(cache=True, error_model="numpy")
def usual_step(r, dt):
    """Length of a step without its gap, and whether there is one; follows the usual step."""
    usual = r[STEP]
    if usual == 0.0:
        r[STEP] = dt
        return dt, False
    if dt > GAP_STEPS * usual and dt > GAP_S:
        r[GAPS] += 1.0
        return usual, True
    r[STEP] = usual + 0.05 * (dt - usual)
    return dt, False


@njit(cache=True, error_model="numpy")
def level(r, ax, ay, az):
    """Roll and pitch from one specific force; the heading is kept."""
    w, x, y, z = r[Q], r[Q + 1], r[Q + 2], r[Q + 3]
    heading = math.atan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z))
    roll = 0.5 * math.atan2(-ay, -az)
    pitch = 0.5 * math.atan2(ax, math.sqrt(ay * ay + az * az))
    cr, sr, cp, sp = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
    r[Q], r[Q + 1], r[Q + 2], r[Q + 3] = cr * cp, sr * cp, cr * sp, -sr * sp
    turn_about_down(r, heading)
    r[LEVELED] = 1.0


@njit(cache=True, error_model="numpy")
def lose_attitude(r):
    """Level and head anew with the next samples."""
    r[LEVELED] = 0.0
    if r[HEADED] != 0.0:
        r[HEADED] = LOST


@njit(cache=True, error_model="numpy")
def turn_about_down(r, angle):
    c, s = math.cos(0.5 * angle), math.sin(0.5 * angle)
    w, x, y, z = r[Q], r[Q + 1], r[Q + 2], r[Q + 3]
    r[Q], r[Q + 1] = c * w - s * z, c * x - s * y
    r[Q + 2], r[Q + 3] = c * y + s * x, c * z + s * w


# --- The error-state filter ---------------------------------------------------------------

# Options: variance of the velocity m²/s², bias prior rad/s, gyro noise density (rad/s)²/Hz,
# length of a block s, and whether the attitude was given.
VELOCITY, BIAS_SD, GYRO_NOISE, BLOCK = OPTIONS, OPTIONS + 1, OPTIONS + 2, OPTIONS + 3

V, FAST, POWER, SPAN = 26, 28, 31, 32
# Sums over a block: force in n and its count, force in b, rate, C dt, field in n and its count.
FORCE, FORCES, BODY, TURN, MATRIX, FIELD, FIELDS = 33, 36, 37, 40, 43, 52, 55
SMOOTH_RATE, SMOOTH_FORCE, REST = 56, 59, 62
NORM, DIP, DISTURBANCE = 63, 64, 65
ACCEL_BIAS = 66
N = 11
P, X, H, K = 69, 190, 201, 212
STILL = 223
STATE = 226
# Of a row of the history: quaternion, and the covariance of delta: NN, NE, ND, EE, ED, DD.
ROW = 10

# Model. Each number is a property of bodies and sensors, none of a recording.
LEVEL_SD = 0.1  # rad: one sample of a moving body, acceleration 1 m/s²
GIVEN_SD = 0.05  # rad: an attitude given by the user
VELOCITY_TIME = 2.0  # s: correlation of the velocity of a body that is carried
FAST_TIME = 1.5  # s: the velocity that is seen by itself, without gravity's error
POWER_TIME = 6.0  # s: memory of its power
SOON, EARLY = 0.05, 0.15  # s, and share of the time since the start
UNSEEN = 2.0  # power of the velocity over that of what is seen of it, above 0.1 Hz
SCALE = 0.005  # gyro scale factor and misalignment; constant for 1 s of one rotation axis
BIAS_WALK = 5e-5  # rad/s/sqrt(s): 0.003 deg/s
ACCEL_NOISE = 0.01  # m/s²/sqrt(Hz), vibration included
ACCEL_BIAS_SD = 0.05  # m/s², scale factor and misalignment included
ACCEL_WALK = 2e-4  # m/s²/sqrt(s)
REST_AFTER = 1.5  # s
REST_RATE = 0.012  # rad/s: 0.7 deg/s from their mean over 0.5 s
REST_FORCE = 0.15  # m/s²
REST_LIMIT = 0.0035  # rad/s: 0.2 deg/s, of a bias since it was known
REST_FIELD = 0.03  # of the field: its change in a body at rest, noise included
REST_BIAS = 0.0175  # rad/s: 1 deg/s; a larger bias waits until a turn would have shown
REST_TURN = 0.1  # rad: shows as that change up to a dip of 72 deg
REST_VELOCITY = 1e-2  # m²/s: density of the 0.07 m/s that REST_FORCE may hide, correlated over 1 s
REST_DRIFT = 9e-4  # rad/s/sqrt(Hz): 0.05 deg/s
FIELD_SD = 0.02  # of the magnetometer, of the total field, correlated over 1 s
FIELD_FREE = 0.1  # of the horizontal field: deviations of norm and dip that mean nothing
FIELD_LAG = 0.01  # s: magnetometers sample at 50 to 100 Hz
FIELD_TIME = 20.0  # s: correlation of a disturbance
FIELD_MEMORY = 2.0  # s
FIELD_REFERENCE = 20.0  # s: norm and dip follow the undisturbed field
FIELD_BEGIN = 10.0  # s: until then the dip is found with the tilt
DISTURBED = 0.1  # rad of heading, by norm and dip
HUBER = 3.0


@njit(cache=True, error_model="numpy")
def forget(r, first, last, variance):
    """Make states uncorrelated, with a variance."""
    for i in range(first, last):
        for j in range(N):
            r[P + N * i + j] = 0.0
            r[P + N * j + i] = 0.0
        r[P + (N + 1) * i] = variance


@njit(cache=True, error_model="numpy")
def add(r, first, last, variance):
    """Add a variance to states."""
    for i in range(first, last):
        r[P + (N + 1) * i] += variance


@njit(cache=True, error_model="numpy")
def clear_block(r):
    for i in range(SPAN, SMOOTH_RATE):
        r[i] = 0.0


@njit(cache=True, error_model="numpy")
def error_state_level(r, ax, ay, az):
    """Level with one sample; its distance from g shows how far it may be from the vertical."""
    size = math.sqrt(ax * ax + ay * ay + az * az)
    if size < WEIGHTLESS:
        return
    level(r, ax, ay, az)
    r[AGE] = 0.0
    r[SMOOTH_FORCE], r[SMOOTH_FORCE + 1], r[SMOOTH_FORCE + 2] = ax, ay, az
    off = size / G - 1.0
    forget(r, 0, 2, min(LEVEL_SD * LEVEL_SD + off * off, 1.0))
    forget(r, 6, 8, max(r[VELOCITY], 0.25))
    r[V], r[V + 1] = 0.0, 0.0
    for i in range(3):
        r[FAST + i] = 0.0
    clear_block(r)


@njit(cache=True, error_model="numpy")
def error_state_head(r, north, east, down):
    """Heading from one sample of the field in the level frame."""
    flat = math.sqrt(north * north + east * east)
    norm = math.sqrt(flat * flat + down * down)
    if flat < 0.02 * norm:
        return
    turn_about_down(r, -math.atan2(east, north))
    # The level frame turned: what was known in it is isotropic at this time.
    r[V], r[V + 1] = 0.0, 0.0
    clear_block(r)
    slope = down / flat
    own = FIELD_SD * norm / flat
    forget(r, 2, 3, 0.0)
    for j in range(N):
        r[P + 2 * N + j] = slope * r[P + j]
        r[P + N * j + 2] = r[P + 2 * N + j]
    r[P + 2 * N + 2] = slope * slope * r[P] + own * own
    if r[NORM] == 0.0:
        r[NORM], r[DIP] = norm, math.atan2(down, flat)
    r[HEADED] = 1.0


@njit(cache=True, error_model="numpy")
def observe(r, i, slope, innovation, noise, kind, dx, dy, dz):
    """One scalar measurement of state i less `slope` times state 0.

    Kind 0: all states are corrected. 1, by a velocity: not the gyro bias about the vertical
    (dx, dy, dz), which it does not observe, and only seems to. 2, by a field: of the gyro bias
    only that part, and neither tilt nor velocity, which a magnetic disturbance must not move. For
    any gain K, ``P - K (H P) - (P H') K' + K S K'`` is exact.
    """
    innovation -= r[X + i] - slope * r[X]
    for j in range(N):
        r[H + j] = r[P + N * i + j] - slope * r[P + j]
    s = r[H + i] - slope * r[H] + noise
    for j in range(N):
        r[K + j] = r[H + j] / s
    if kind > 0:
        down = dx * r[K + 3] + dy * r[K + 4] + dz * r[K + 5]
        if kind == 1:
            r[K + 3] -= down * dx
            r[K + 4] -= down * dy
            r[K + 5] -= down * dz
        else:
            r[K + 3], r[K + 4], r[K + 5] = down * dx, down * dy, down * dz
            r[K], r[K + 1] = 0.0, 0.0
            for j in range(6, N):
                r[K + j] = 0.0
    for j in range(N):
        r[X + j] += r[K + j] * innovation
    for j in range(N):
        a, b = r[K + j], r[H + j] - s * r[K + j]
        for k in range(j, N):
            value = r[P + N * j + k] - a * r[H + k] - b * r[K + k]
            r[P + N * j + k] = value
            r[P + N * k + j] = value


@njit(cache=True, error_model="numpy")
def propagate(r, span, lift, felt, squared):
    """Covariance over a block: delta' = -C db, dv' = delta x f - C da, with f vertical.

    Only the vertical force enters: rotated with the heading the velocity stays what it is, so that
    a bounded velocity must not seem to observe the heading.
    """
    m = MATRIX
    for j in range(P, P + N):
        a, b, c = r[j + 3 * N], r[j + 4 * N], r[j + 5 * N]
        x, y, z = r[j + 8 * N], r[j + 9 * N], r[j + 10 * N]
        r[j + 6 * N] += lift * r[j + N] - felt * (r[m] * x + r[m + 1] * y + r[m + 2] * z)
        r[j + 7 * N] -= lift * r[j] + felt * (r[m + 3] * x + r[m + 4] * y + r[m + 5] * z)
        r[j] -= r[m] * a + r[m + 1] * b + r[m + 2] * c
        r[j + N] -= r[m + 3] * a + r[m + 4] * b + r[m + 5] * c
        r[j + 2 * N] -= r[m + 6] * a + r[m + 7] * b + r[m + 8] * c
    for j in range(P, P + N * N, N):
        a, b, c = r[j + 3], r[j + 4], r[j + 5]
        x, y, z = r[j + 8], r[j + 9], r[j + 10]
        r[j + 6] += lift * r[j + 1] - felt * (r[m] * x + r[m + 1] * y + r[m + 2] * z)
        r[j + 7] -= lift * r[j] + felt * (r[m + 3] * x + r[m + 4] * y + r[m + 5] * z)
        r[j] -= r[m] * a + r[m + 1] * b + r[m + 2] * c
        r[j + 1] -= r[m + 3] * a + r[m + 4] * b + r[m + 5] * c
        r[j + 2] -= r[m + 6] * a + r[m + 7] * b + r[m + 8] * c
    add(r, 0, 3, (r[GYRO_NOISE] + SCALE * SCALE * squared) * span)
    add(r, 3, 6, BIAS_WALK * BIAS_WALK * span)
    add(r, 6, 8, ACCEL_NOISE * ACCEL_NOISE * span)
    add(r, 8, 11, ACCEL_WALK * ACCEL_WALK * span)


@njit(cache=True, error_model="numpy")
def field_turned(r):
    """Whether the field has turned in the body since it came to rest; its strength stays then."""
    n = r[FIELDS]
    m = MATRIX
    off, size, still = 0.0, 0.0, 0.0
    for i in range(3):
        along = (
            r[m + i] * r[FIELD] + r[m + 3 + i] * r[FIELD + 1] + r[m + 6 + i] * r[FIELD + 2]
        ) / (n * r[SPAN])
        before = r[STILL + i]
        if r[REST] == 0.0:
            r[STILL + i] = along
        else:
            off += (along - before) * (along - before)
            still += before * before
        size += along * along
    stronger = abs(size - still) > 2.0 * REST_FIELD * size
    if off > REST_FIELD * REST_FIELD * size and not stronger:
        r[REST] = 0.0
        return True
    return False


@njit(cache=True, error_model="numpy")
def at_rest(r, span, gx, gy, gz):
    """Whether rate and force have been steady for long enough, and the rate is a bias's.

    A steady slow turn looks the same, but to the field: where the rate is beyond what the bias is
    known to, it is one of rest only once a turn would have shown.
    """
    share = min(1.0, 2.0 * span)
    n = r[FORCES]
    rate, force, squared = 0.0, 0.0, 0.0
    for i in range(3):
        g = gx if i == 0 else (gy if i == 1 else gz)
        off = g - r[SMOOTH_RATE + i]
        r[SMOOTH_RATE + i] += share * off
        rate += off * off
        off = r[BODY + i] / n - r[SMOOTH_FORCE + i]
        r[SMOOTH_FORCE + i] += share * off
        force += off * off
        off = r[SMOOTH_RATE + i] - r[BIAS + i]
        squared += off * off
    limit = 3.0 * math.sqrt(r[P + 3 * N + 3] + r[P + 4 * N + 4] + r[P + 5 * N + 5]) + REST_LIMIT
    steady = rate < REST_RATE * REST_RATE and force < REST_FORCE * REST_FORCE
    steady = steady and squared < limit * limit
    if not steady:
        r[REST] = 0.0
    if r[FIELDS] > 0.0 and r[HEADED] == 1.0 and field_turned(r):
        steady = False
    if steady:
        r[REST] += span
    after = REST_AFTER
    if r[HEADED] == 1.0 and squared > REST_BIAS * REST_BIAS:
        after = max(after, REST_TURN / math.sqrt(squared))
    return r[REST] > after


@njit(cache=True, error_model="numpy")
def bounded(innovation, variance, noise):
    """Noise of a measurement by Huber's weight: the influence of a large innovation is bounded."""
    ratio = innovation * innovation / (HUBER * HUBER * variance)
    return noise * math.sqrt(ratio) if ratio > 1.0 else noise


@njit(cache=True, error_model="numpy")
def observe_field(r, span, squared, dx, dy, dz):
    """Heading by the mean field of a block, and its norm and dip against the reference."""
    n = r[FIELDS]
    north, east, down = r[FIELD] / n, r[FIELD + 1] / n, r[FIELD + 2] / n
    flat = math.sqrt(north * north + east * east)
    norm = math.sqrt(flat * flat + down * down)
    r[MAG_TIME] += span
    if flat < 0.02 * norm:
        return
    dip = math.atan2(down, flat)
    # A disturbance has three components. Norm and dip show two; the one that turns the heading is
    # as large as either of them.
    usual = r[NORM] * math.cos(r[DIP])
    longer = norm - r[NORM]
    steeper = (dip - r[DIP]) * r[NORM]
    seen = 0.5 * (longer * longer + steeper * steeper) / (usual * usual)
    lag = squared * FIELD_LAG * FIELD_LAG
    own = FIELD_SD * norm / flat
    own = own * own + lag
    slope = down / flat
    innovation = -math.atan2(east, north)
    variance = r[P + 2 * N + 2] + slope * slope * r[P] + own
    if seen > r[DISTURBANCE]:
        r[DISTURBANCE] = seen
    else:
        r[DISTURBANCE] += min(1.0, span / FIELD_MEMORY) * (seen - r[DISTURBANCE])
    ratio = r[NORM] / usual
    free = FIELD_FREE * FIELD_FREE + (r[P] + r[P + N + 1]) * ratio * ratio
    excess = max(0.0, r[DISTURBANCE] - free)
    if excess > DISTURBED * DISTURBED + lag * ratio * ratio:
        r[DISTURBED_TIME] += span
    noise = 2.0 * (own + excess * FIELD_TIME) / span
    noise = bounded(innovation, variance + excess, noise)
    observe(r, 2, slope, innovation, noise, 2, dx, dy, dz)
    share = min(1.0, span / FIELD_REFERENCE) / (1.0 + r[DISTURBANCE] / (FIELD_FREE * FIELD_FREE))
    r[NORM] += share * longer
    if r[MAG_TIME] < FIELD_BEGIN and abs(longer) < FIELD_FREE * usual:
        # The first dip has the tilt error of the start, which the norm has not.
        share = min(1.0, 3.0 * span / r[MAG_TIME])
    r[DIP] += share * (dip - r[DIP])


@njit(cache=True, error_model="numpy")
def end_block(r):
    """Propagate the covariance over a block, and correct by its means."""
    span = r[SPAN]
    gx, gy, gz = r[TURN] / span, r[TURN + 1] / span, r[TURN + 2] / span
    ox, oy, oz = gx - r[BIAS], gy - r[BIAS + 1], gz - r[BIAS + 2]
    squared = ox * ox + oy * oy + oz * oz
    for i in range(N):
        r[X + i] = 0.0
    n = r[FORCES]
    w, x, y, z = r[Q], r[Q + 1], r[Q + 2], r[Q + 3]
    dx, dy, dz = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)
    if n > 0.0:
        ux, uy, uz = span * r[FORCE] / n, span * r[FORCE + 1] / n, span * r[FORCE + 2] / n
        propagate(r, span, uz, 1.0, squared)
        r[V] += ux
        r[V + 1] += uy
        keep = 1.0 - min(1.0, span / FAST_TIME)
        r[FAST] = keep * r[FAST] + ux
        r[FAST + 1] = keep * r[FAST + 1] + uy
        r[FAST + 2] = keep * r[FAST + 2] + uz + G * span
        now = (r[FAST] * r[FAST] + r[FAST + 1] * r[FAST + 1] + r[FAST + 2] * r[FAST + 2]) * (
            1.0 / 3.0
        )
        r[POWER] += min(1.0, span / POWER_TIME) * (now - r[POWER])
        if at_rest(r, span, gx, gy, gz):
            r[REST_TIME] += span
            r[POWER] -= min(1.0, 2.0 * span) * r[POWER]
            for i in range(3):
                r[FAST + i] = 0.0
            # A body that came to a constant velocity, as in a train, seems stationary: what was
            # integrated on the way then says nothing of the tilt.
            limit = HUBER * HUBER
            if r[V] * r[V] > limit * (r[P + 6 * N + 6] + REST_VELOCITY) or r[V + 1] * r[
                V + 1
            ] > limit * (r[P + 7 * N + 7] + REST_VELOCITY):
                forget(r, 6, 8, REST_VELOCITY)
                r[V], r[V + 1] = 0.0, 0.0
            noise = REST_VELOCITY / span
            observe(r, 6, 0.0, -r[V], noise, 1, dx, dy, dz)
            observe(r, 7, 0.0, -r[V + 1], noise, 1, dx, dy, dz)
            noise = (r[GYRO_NOISE] + REST_DRIFT * REST_DRIFT) / span
            observe(r, 3, 0.0, ox, noise, 0, 0.0, 0.0, 0.0)
            observe(r, 4, 0.0, oy, noise, 0, 0.0, 0.0, 0.0)
            observe(r, 5, 0.0, oz, noise, 0, 0.0, 0.0, 0.0)
        else:
            own = r[VELOCITY] + UNSEEN * max(r[POWER], now)
            # Soon after the start the velocity is one, not many: its mean is no better known.
            noise = 2.0 * own * min(VELOCITY_TIME, SOON + EARLY * r[AGE]) / span
            a = bounded(r[V], own + r[P + 6 * N + 6], noise)
            observe(r, 6, 0.0, -r[V], a, 1, dx, dy, dz)
            a = bounded(r[V + 1], own + r[P + 7 * N + 7], noise)
            observe(r, 7, 0.0, -r[V + 1], a, 1, dx, dy, dz)
    else:
        # The velocity is unknown without an accelerometer, and says nothing of the tilt.
        propagate(r, span, 0.0, 0.0, squared)
        forget(r, 6, 8, r[P + 6 * N + 6] + span)
        r[REST] = 0.0
    if r[FIELDS] > 0.0 and r[HEADED] == 1.0:
        observe_field(r, span, squared, dx, dy, dz)
    correct(r)
    clear_block(r)


@njit(cache=True, error_model="numpy")
def correct(r):
    """Move the estimated errors into attitude, bias and velocity."""
    a, b, c = 0.5 * r[X], 0.5 * r[X + 1], 0.5 * r[X + 2]
    w, x, y, z = r[Q], r[Q + 1], r[Q + 2], r[Q + 3]
    d = w - a * x - b * y - c * z
    e = x + a * w + b * z - c * y
    f = y + b * w + c * x - a * z
    g = z + c * w + a * y - b * x
    n = 1.0 / math.sqrt(d * d + e * e + f * f + g * g)
    r[Q], r[Q + 1], r[Q + 2], r[Q + 3] = n * d, n * e, n * f, n * g
    for i in range(3):
        r[BIAS + i] += r[X + 3 + i]
        r[ACCEL_BIAS + i] += r[X + 8 + i]
    r[V] += r[X + 6]
    r[V + 1] += r[X + 7]


@njit(cache=True, error_model="numpy")
def bridge_gap(r, dt):
    """Widen the covariance over a time without samples."""
    x, y, z = r[RATE] - r[BIAS], r[RATE + 1] - r[BIAS + 1], r[RATE + 2] - r[BIAS + 2]
    angle = max(GAP_RATE * GAP_RATE, x * x + y * y + z * z) * dt * dt
    angle = min(angle, UNKNOWN * UNKNOWN)
    for i in range(3):
        j = P + (N + 1) * i
        r[j] = min(r[j] + angle, UNKNOWN * UNKNOWN)
    add(r, 3, 6, BIAS_WALK * BIAS_WALK * dt)
    forget(r, 6, 8, max(r[VELOCITY], 0.25))
    r[V], r[V + 1] = 0.0, 0.0
    for i in range(3):
        r[FAST + i] = 0.0
    r[REST] = 0.0
    clear_block(r)
    if angle > RELEVEL * RELEVEL:
        lose_attitude(r)


@njit(cache=True, error_model="numpy")
def error_state_sample(r, dt, gx, gy, gz, ax, ay, az, mx, my, mz):
    """One sample, `dt` s after the one before; NaN for a missing specific force or field."""
    if r[SAMPLES] == 0.0:
        tx, ty, tz, step = 0.0, 0.0, 0.0, 0.0
        r[SMOOTH_RATE], r[SMOOTH_RATE + 1], r[SMOOTH_RATE + 2] = gx, gy, gz
    else:
        step, gap = usual_step(r, dt)
        if gap:
            bridge_gap(r, dt)
        past = 0.0 if r[MEAN] != 0.0 else 0.5
        tx = (gx + past * (r[RATE] - gx) - r[BIAS]) * step
        ty = (gy + past * (r[RATE + 1] - gy) - r[BIAS + 1]) * step
        tz = (gz + past * (r[RATE + 2] - gz) - r[BIAS + 2]) * step
        r[Q], r[Q + 1], r[Q + 2], r[Q + 3] = turned(r[Q], r[Q + 1], r[Q + 2], r[Q + 3], tx, ty, tz)
        r[SPAN] += step
        r[AGE] += step
        r[TURN] += gx * step
        r[TURN + 1] += gy * step
        r[TURN + 2] += gz * step
    r[SAMPLES] += 1.0
    r[RATE], r[RATE + 1], r[RATE + 2] = gx, gy, gz
    felt = usable(ax, ay, az)
    if felt and r[LEVELED] == 0.0:
        error_state_level(r, ax - r[ACCEL_BIAS], ay - r[ACCEL_BIAS + 1], az - r[ACCEL_BIAS + 2])
    w, x, y, z = r[Q], r[Q + 1], r[Q + 2], r[Q + 3]
    c00, c01, c02 = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
    c10, c11, c12 = 2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)
    c20, c21, c22 = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)
    r[MATRIX] += c00 * step
    r[MATRIX + 1] += c01 * step
    r[MATRIX + 2] += c02 * step
    r[MATRIX + 3] += c10 * step
    r[MATRIX + 4] += c11 * step
    r[MATRIX + 5] += c12 * step
    r[MATRIX + 6] += c20 * step
    r[MATRIX + 7] += c21 * step
    r[MATRIX + 8] += c22 * step
    if felt and r[LEVELED] != 0.0 and step > 0.0:
        r[BODY] += ax
        r[BODY + 1] += ay
        r[BODY + 2] += az
        ax, ay, az = ax - r[ACCEL_BIAS], ay - r[ACCEL_BIAS + 1], az - r[ACCEL_BIAS + 2]
        if r[MEAN] != 0.0:
            # The mean over the step belongs to its middle.
            bx = ax - 0.5 * (ty * az - tz * ay)
            by = ay - 0.5 * (tz * ax - tx * az)
            az -= 0.5 * (tx * ay - ty * ax)
            ax, ay = bx, by
        r[FORCE] += c00 * ax + c01 * ay + c02 * az
        r[FORCE + 1] += c10 * ax + c11 * ay + c12 * az
        r[FORCE + 2] += c20 * ax + c21 * ay + c22 * az
        r[FORCES] += 1.0
    # Zeros, as drivers give them before the first conversion, are not a field.
    if usable(mx, my, mz) and r[LEVELED] != 0.0 and mx * mx + my * my + mz * mz > 0.0:
        north = c00 * mx + c01 * my + c02 * mz
        east = c10 * mx + c11 * my + c12 * mz
        down = c20 * mx + c21 * my + c22 * mz
        if r[HEADED] != 1.0:
            error_state_head(r, north, east, down)
        elif step > 0.0:
            r[FIELD] += north
            r[FIELD + 1] += east
            r[FIELD + 2] += down
            r[FIELDS] += 1.0
    if r[SPAN] > 0.0 and r[SPAN] + 0.5 * step >= r[BLOCK]:
        end_block(r)


@njit(cache=True, error_model="numpy")
def euler_deviation(w, x, y, z, nn, ne, nd, ee, ed, dd):
    """Standard deviations of roll, pitch, heading, rad, to first order, at most pi.

    From a unit quaternion and the covariance of the attitude error in the level frame. Near +-90
    deg pitch, roll and heading are not separate, and theirs are large.
    """
    c11, c21 = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z)
    flat = max(math.sqrt(c11 * c11 + c21 * c21), 1e-6)
    heading = math.atan2(c21, c11)
    north, east = math.cos(heading), math.sin(heading)
    # Of the rotation vector about the horizontal axis that the body points along, and across it.
    along = max(north * north * nn + 2.0 * north * east * ne + east * east * ee, 0.0)
    across = max(east * east * nn - 2.0 * north * east * ne + north * north * ee, 0.0)
    slope = 2.0 * (w * y - x * z) / flat
    about = slope * slope * along + 2.0 * slope * (north * nd + east * ed) + dd
    return (
        min(math.sqrt(along) / flat, math.pi),
        min(math.sqrt(across), math.pi),
        min(math.sqrt(max(about, 0.0)), math.pi),
    )


@njit(cache=True, error_model="numpy")
def euler_deviations(q, covariance, out):
    """`euler_deviation` of many attitudes, (n, 4), with their covariances, (n, 3, 3)."""
    for k in range(q.shape[0]):
        out[k, 0], out[k, 1], out[k, 2] = euler_deviation(
            q[k, 0],
            q[k, 1],
            q[k, 2],
            q[k, 3],
            covariance[k, 0, 0],
            covariance[k, 0, 1],
            covariance[k, 0, 2],
            covariance[k, 1, 1],
            covariance[k, 1, 2],
            covariance[k, 2, 2],
        )


@njit(cache=True, error_model="numpy")
def error_state_advance(r, dt, gyro, accel, mag, history):
    """Process many samples; without a magnetometer `mag` has no rows."""
    fields = mag.shape[0]
    for k in range(dt.shape[0]):
        mx, my, mz = NAN, NAN, NAN
        if fields > 0:
            mx, my, mz = mag[k, 0], mag[k, 1], mag[k, 2]
        error_state_sample(
            r,
            dt[k],
            gyro[k, 0],
            gyro[k, 1],
            gyro[k, 2],
            accel[k, 0],
            accel[k, 1],
            accel[k, 2],
            mx,
            my,
            mz,
        )
        for i in range(4):
            history[k, i] = r[Q + i]
        history[k, 4], history[k, 5], history[k, 6] = r[P], r[P + 1], r[P + 2]
        history[k, 7], history[k, 8], history[k, 9] = r[P + N + 1], r[P + N + 2], r[P + 2 * N + 2]


@njit(cache=True, error_model="numpy")
def error_state_update(r, time, gyro, accel, mag):
    """Process one sample; a refused one leaves the record unchanged."""
    dt = step_of(r, time, gyro, accel, mag)
    if dt >= 0.0:
        error_state_sample(
            r,
            dt,
            gyro[0],
            gyro[1],
            gyro[2],
            accel[0],
            accel[1],
            accel[2],
            mag[0],
            mag[1],
            mag[2],
        )
        r[TIME] = time
    return dt


# --- The complementary filter -------------------------------------------------------------

# Options: time constants of tilt, heading and bias, s.
TILT_TIME, HEADING_TIME, BIAS_TIME = OPTIONS, OPTIONS + 1, OPTIONS + 2
COMPLEMENTARY = COMMON
# At the start the time constants are the time since then, and this, s.
START_TIME = 0.2
# At the start the bias is found as the mean of the correction since then, and this before, s.
BIAS_SOON = 5.0


@njit(cache=True, error_model="numpy")
def complementary_sample(r, dt, gx, gy, gz, ax, ay, az, mx, my, mz):
    """As `error_state_sample`: the rate, corrected towards the vertical and the north."""
    felt = usable(ax, ay, az)
    if r[SAMPLES] == 0.0:
        step = 0.0
    else:
        step, gap = usual_step(r, dt)
        if gap:
            lose_attitude(r)
            r[AGE] = 0.0
    r[SAMPLES] += 1.0
    r[AGE] += step
    if felt and r[LEVELED] == 0.0 and ax * ax + ay * ay + az * az > WEIGHTLESS * WEIGHTLESS:
        level(r, ax, ay, az)
        step = 0.0
    w, x, y, z = r[Q], r[Q + 1], r[Q + 2], r[Q + 3]
    past = 0.0 if r[MEAN] != 0.0 else 0.5
    ox = gx + past * (r[RATE] - gx) - r[BIAS]
    oy = gy + past * (r[RATE + 1] - gy) - r[BIAS + 1]
    oz = gz + past * (r[RATE + 2] - gz) - r[BIAS + 2]
    r[RATE], r[RATE + 1], r[RATE + 2] = gx, gy, gz
    dx, dy, dz = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)
    ex, ey, ez = 0.0, 0.0, 0.0
    if felt and r[LEVELED] != 0.0:
        gain = 1.0 / (G * min(r[TILT_TIME], START_TIME + r[AGE]))
        ex = gain * (dy * az - dz * ay)
        ey = gain * (dz * ax - dx * az)
        ez = gain * (dx * ay - dy * ax)
    # Zeros, as drivers give them before the first conversion, are not a field.
    if usable(mx, my, mz) and r[LEVELED] != 0.0 and mx * mx + my * my + mz * mz > 0.0:
        north = (1.0 - 2.0 * (y * y + z * z)) * mx + 2.0 * (
            (x * y - w * z) * my + (x * z + w * y) * mz
        )
        east = (
            2.0 * ((x * y + w * z) * mx + (y * z - w * x) * mz) + (1.0 - 2.0 * (x * x + z * z)) * my
        )
        if r[HEADED] != 1.0:
            turn_about_down(r, -math.atan2(east, north))
            w, x, y, z = r[Q], r[Q + 1], r[Q + 2], r[Q + 3]
            r[HEADED] = 1.0
        else:
            flat = math.sqrt(north * north + east * east)
            if flat > 0.0:
                # Beyond 90 deg the sine decreases; its largest value keeps pulling there.
                sine = -east / flat
                if north < 0.0:
                    sine = 1.0 if sine > 0.0 else -1.0
                gain = sine / min(r[HEADING_TIME], START_TIME + r[AGE])
                ex, ey, ez = ex + gain * dx, ey + gain * dy, ez + gain * dz
    ease = step / min(r[BIAS_TIME], BIAS_SOON + r[AGE])
    r[BIAS] -= ease * ex
    r[BIAS + 1] -= ease * ey
    r[BIAS + 2] -= ease * ez
    r[Q], r[Q + 1], r[Q + 2], r[Q + 3] = turned(
        w, x, y, z, (ox + ex) * step, (oy + ey) * step, (oz + ez) * step
    )


@njit(cache=True, error_model="numpy")
def complementary_advance(r, dt, gyro, accel, mag, history):
    """Process many samples; without a magnetometer `mag` has no rows."""
    fields = mag.shape[0]
    for k in range(dt.shape[0]):
        mx, my, mz = NAN, NAN, NAN
        if fields > 0:
            mx, my, mz = mag[k, 0], mag[k, 1], mag[k, 2]
        complementary_sample(
            r,
            dt[k],
            gyro[k, 0],
            gyro[k, 1],
            gyro[k, 2],
            accel[k, 0],
            accel[k, 1],
            accel[k, 2],
            mx,
            my,
            mz,
        )
        for i in range(4):
            history[k, i] = r[Q + i]


@njit(cache=True, error_model="numpy")
def complementary_update(r, time, gyro, accel, mag):
    """Process one sample; a refused one leaves the record unchanged."""
    dt = step_of(r, time, gyro, accel, mag)
    if dt >= 0.0:
        complementary_sample(
            r,
            dt,
            gyro[0],
            gyro[1],
            gyro[2],
            accel[0],
            accel[1],
            accel[2],
            mag[0],
            mag[1],
            mag[2],
        )
        r[TIME] = time
    return dt
