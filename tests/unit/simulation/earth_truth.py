"""What sensors feel, derived apart from the code: in Cartesian inertial axes, in many digits."""

from __future__ import annotations

import math

import mpmath
import numpy as np
from mpmath import mpf

from strapdown._kernels import earth

DIGITS = 40


def turns(angles):
    """C_nb of roll, pitch, heading in rad."""
    roll, pitch, heading = angles
    cr, sr = mpmath.cos(roll), mpmath.sin(roll)
    cp, sp = mpmath.cos(pitch), mpmath.sin(pitch)
    ch, sh = mpmath.cos(heading), mpmath.sin(heading)
    return (
        mpmath.matrix([[ch, -sh, 0], [sh, ch, 0], [0, 0, 1]])
        * mpmath.matrix([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
        * mpmath.matrix([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    )


def felt(ellipsoid, place, angles):
    """Body rate and specific force at time zero, of a course that is given as functions of time.

    `place` gives latitude and longitude in rad and height; `angles` roll, pitch, heading in rad.
    The Earth's axes coincide with the inertial ones at time zero. Gravity is the kernel's; as
    a field in inertial axes it is gravitation, which lacks the centrifugal part.
    """
    a = mpf(ellipsoid.semi_major_axis)
    f = 1 / mpf(ellipsoid.inverse_flattening)
    e2 = f * (2 - f)
    omega = mpf(ellipsoid.rotation_rate)

    def position(t):
        lat, lon, alt = place(t)
        n = a / mpmath.sqrt(1 - e2 * mpmath.sin(lat) ** 2)
        across, lon = (n + alt) * mpmath.cos(lat), lon + omega * t
        return [
            across * mpmath.cos(lon),
            across * mpmath.sin(lon),
            (n * (1 - e2) + alt) * mpmath.sin(lat),
        ]

    def axes(t):
        """North, east, down as columns, in inertial axes."""
        lat, lon, _ = place(t)
        lon = lon + omega * t
        sl, cl, so, co = mpmath.sin(lat), mpmath.cos(lat), mpmath.sin(lon), mpmath.cos(lon)
        return mpmath.matrix([[-sl * co, -so, -cl * co], [-sl * so, co, -cl * so], [cl, 0, -sl]])

    def body(t):
        return axes(t) * turns(angles(t))

    with mpmath.workdps(DIGITS):
        acceleration = mpmath.matrix(
            [mpmath.diff(lambda t, k=k: position(t)[k], 0, 2) for k in range(3)]
        )
        lat, _, alt = place(mpf(0))
        p = ellipsoid.parameters()
        north, down = earth.gravity(
            math.sin(lat),
            math.cos(lat),
            float(alt),
            *(p[k] for k in (earth.A, earth.E2, earth.GAMMA, earth.K, earth.F, earth.M)),
        )
        x, y, _ = position(mpf(0))
        centrifugal = mpmath.matrix([omega**2 * x, omega**2 * y, 0])
        gravitation = axes(mpf(0)) * mpmath.matrix([mpf(north), 0, mpf(down)]) - centrifugal
        c = body(mpf(0))
        force = c.T * (acceleration - gravitation)
        slope = mpmath.matrix(
            [
                [mpmath.diff(lambda t, i=i, j=j: body(t)[i, j], 0) for j in range(3)]
                for i in range(3)
            ]
        )
        skew = c.T * slope
    rate = [skew[2, 1], skew[0, 2], skew[1, 0]]
    return np.array([float(x) for x in rate]), np.array([float(x) for x in force])


def turned_twice(ellipsoid, place, angles):
    """Derivative of the body rate at time zero, in body axes: ``C^T C''`` is its cross product
    matrix and a square, which is symmetric.
    """
    omega = mpf(ellipsoid.rotation_rate)

    def body(t):
        lat, lon, _ = place(t)
        lon = lon + omega * t
        sl, cl, so, co = mpmath.sin(lat), mpmath.cos(lat), mpmath.sin(lon), mpmath.cos(lon)
        level = mpmath.matrix([[-sl * co, -so, -cl * co], [-sl * so, co, -cl * so], [cl, 0, -sl]])
        return level * turns(angles(t))

    with mpmath.workdps(DIGITS):
        second = mpmath.matrix(3, 3)
        for i in range(3):
            for j in range(3):
                second[i, j] = mpmath.diff(lambda t, i=i, j=j: body(t)[i, j], 0, 2)
        m = body(mpf(0)).T * second
        swing = [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]]
    return np.array([float(x) for x in swing]) / 2.0


def gravitation(ellipsoid, position):
    """Attraction at a point in inertial axes, as these stand at time zero, from the kernel."""
    a = mpf(ellipsoid.semi_major_axis)
    f = 1 / mpf(ellipsoid.inverse_flattening)
    e2 = f * (2 - f)
    omega = mpf(ellipsoid.rotation_rate)
    x, y, z = position
    across = mpmath.sqrt(x * x + y * y)
    lat = mpmath.atan2(z, across * (1 - e2))
    for _ in range(20):
        n = a / mpmath.sqrt(1 - e2 * mpmath.sin(lat) ** 2)
        lat = mpmath.atan2(z + e2 * n * mpmath.sin(lat), across)
    lon = mpmath.atan2(y, x)
    alt = across / mpmath.cos(lat) - a / mpmath.sqrt(1 - e2 * mpmath.sin(lat) ** 2)
    p = ellipsoid.parameters()
    north, down = earth.gravity(
        math.sin(lat),
        math.cos(lat),
        float(alt),
        *(p[k] for k in (earth.A, earth.E2, earth.GAMMA, earth.K, earth.F, earth.M)),
    )
    sl, cl, so, co = mpmath.sin(lat), mpmath.cos(lat), mpmath.sin(lon), mpmath.cos(lon)
    level = mpmath.matrix([[-sl * co, -so, -cl * co], [-sl * so, co, -cl * so], [cl, 0, -sl]])
    centrifugal = mpmath.matrix([omega**2 * x, omega**2 * y, 0])
    return level * mpmath.matrix([mpf(north), 0, mpf(down)]) - centrifugal


def course(ellipsoid, start, velocity):
    """Functions of the place, right to the second derivative at time zero, of a velocity.

    `start` is latitude and longitude in rad and height; `velocity` gives north, east, down.
    """
    a = mpf(ellipsoid.semi_major_axis)
    f = 1 / mpf(ellipsoid.inverse_flattening)
    e2 = f * (2 - f)

    def rates(t, lat, alt):
        w2 = 1 - e2 * mpmath.sin(lat) ** 2
        north, east, down = velocity(t)
        n = a / mpmath.sqrt(w2)
        return [
            north / (n * (1 - e2) / w2 + alt),
            east / ((n + alt) * mpmath.cos(lat)),
            -down,
        ]

    with mpmath.workdps(DIGITS):
        lat, lon, alt = (mpf(x) for x in start)
        first = rates(mpf(0), lat, alt)
        second = [
            mpmath.diff(lambda t, k=k: rates(t, lat + first[0] * t, alt + first[2] * t)[k], 0)
            for k in range(3)
        ]
    return lambda t: [
        x + d * t + dd * t * t / 2 for x, d, dd in zip((lat, lon, alt), first, second, strict=True)
    ]
