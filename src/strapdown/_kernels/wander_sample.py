"""A wander azimuth sample by sample: the same step, one sample a call."""

from __future__ import annotations

from numba import njit

from strapdown._kernels.ned import (
    DONE,
    FREE,
    HIGHEST,
    LOWEST,
    MODE,
    SPEED,
    SPRING,
    TAU,
    guide_height,
)
from strapdown._kernels.sample import (
    EARTH,
    FIRST,
    OPTIONS,
    STATE,
    STEP,
    TIME,
    increments_to,
    keep,
    look,
)
from strapdown._kernels.wander import (
    ALT,
    LOW_EW,
    LOW_IB,
    PRIME,
    PULL,
    Q_EW,
    Q_IB,
    Q_WB,
    SINCE,
    SPIN,
    V,
    four,
    put_state,
    wander_step,
    wander_verdict,
)


@njit(cache=True, error_model="numpy")
def wander_update(r, time, gyro, accel, reference):
    """Take one sample; a sample that is refused leaves the record as it was."""
    found = look(r, time, gyro, accel, reference)
    if found < STEP:
        return found
    dt = 0.0
    if found != FIRST:
        dt = time - r[TIME]
        px, py, pz, ux, uy, uz, sx, sy, sz = increments_to(r, dt, gyro, accel)
        e = EARTH
        q = r[STATE:]
        o = OPTIONS
        q_ew, low_ew, alt, v, q_wb, q_ib, low_ib, spin, w, t2 = wander_step(
            four(q, Q_EW),
            four(q, LOW_EW),
            q[ALT],
            (q[V], q[V + 1], q[V + 2]),
            four(q, Q_WB),
            four(q, Q_IB),
            four(q, LOW_IB),
            four(q, SPIN),
            q[PRIME],
            dt,
            (px, py, pz),
            (ux, uy, uz),
            (sx, sy, sz),
            r[e],
            r[e + 1],
            r[e + 2],
            r[e + 3],
            r[e + 4],
            r[e + 5],
            r[e + 6],
        )
        pull, since = q[PULL], q[SINCE]
        if r[o + MODE] != FREE:
            alt, vd, pull, since = guide_height(
                alt,
                -v[2],
                pull,
                since,
                q[ALT],
                reference,
                dt,
                r[o + MODE],
                r[o + TAU],
                r[o + SPRING],
            )
            v = (v[0], v[1], -vd)
        why = wander_verdict(alt, v, q_wb, q_ew, t2, r[o + SPEED], r[o + LOWEST], r[o + HIGHEST])
        if why != DONE:
            return why
        put_state(q, q_ew, low_ew, alt, v, q_wb, q_ib, low_ib, spin, w, pull, since)
    keep(r, time, dt, gyro, accel)
    return DONE
