/* Attitude by quaternion, Alexiev (2021), (20)-(22).
 *
 * quaternion, written by strapdown 0.2.0.dev0 from the kernels that it runs itself.
 *
 * A sample is the rate at its instant, and the rate is linear between samples (trapezoid).
 *
 * Axes: body forward-right-down; local level north-east-down. q_nb turns body into local level,
 * Hamilton, scalar first. Rates in rad/s of the body relative to inertial space, time in s.
 *
 * Power of the step with which the error falls, 0 where it does not: increments 2, rates
 * interpolated by a cubic 2 (by the trapezoid at most 2), drift on pure coning 2.
 *
 * Operations a step, from increments of angle below 0.5 rad: 28 add, 43 multiply, 1 divide, 1 sqrt.
 * Memory in single precision: 32 bytes.
 *
 * Single precision; -DREAL=double for double. Test: cc -std=c99 -O2 -DATTITUDE_TEST attitude.c -lm
 * && ./a.out. With -DATTITUDE_FILTER it reads lines of dt gx gy gz and writes a quaternion for
 * each.
 *
 * SPDX-License-Identifier: MIT. Copyright (c) 2026 The strapdown developers.
 */

#include <math.h>

#ifndef REAL
#define REAL float
#endif
typedef REAL real_t;
#define R(x) ((real_t)(x))

/* The square of what is below LARGEST is still a number. */
#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)
#define IS_float 1
#define IS_double 2
#if JOIN(IS_, REAL) == IS_float
#define LARGEST 1e18F
#define SQRT sqrtf
#define SIN sinf
#define COS cosf
#define ATAN2 atan2f
#define HYPOT hypotf
#define FABS fabsf
#define FMOD fmodf
#elif JOIN(IS_, REAL) == IS_double
#define LARGEST 1e150
#define SQRT sqrt
#define SIN sin
#define COS cos
#define ATAN2 atan2
#define HYPOT hypot
#define FABS fabs
#define FMOD fmod
#else
#error "REAL must be float or double"
#endif
#define PI R(3.141592653589793)

struct attitude {
    /* Quaternion w, x, y, z. */
    real_t state[4];
    real_t rate[3]; /* of the sample before, rad/s */
    int started;    /* whether there was one */
};

/* Start from an attitude, a quaternion of any length but zero. */
void attitude_init(struct attitude *a, const real_t q_nb[4]);

/* Take a sample: dt in s since the last sample that was taken, gyro in rad/s. Returns 0, or 1 for a
 * sample that is refused (dt not above zero, or not finite); it then has changed nothing.
 */
int attitude_update(struct attitude *a, real_t dt, const real_t gyro[3]);

/* The attitude as a unit quaternion. */
void attitude_quaternion(const struct attitude *a, real_t q_nb[4]);

/* The attitude as roll, pitch and heading, rad. */
void attitude_euler(const struct attitude *a, real_t euler[3]);

/* Below this square of the half angle (|r| = 0.5 rad) the series replaces sin and cos: the first
 * neglected term is under 1e-17 of the value there, so both sides of the switch are correct to
 * rounding, and the series needs no division by the angle.
 */
#define SERIES_LIMIT R(0.0625)
/* hypot() of the two components that vanish at pitch = +-90 deg. Under it they hold nothing but
 * rounding, and only heading -+ roll is defined.
 */
#define GIMBAL_LOCK R(1e-14)

/* Cos(x) and sin(x)/(2x) for u = x^2: the limits of Alexiev (21) and (22), x = |r|/2. */
static void half_angle(real_t u, real_t *out1, real_t *out2)
{
    if (u < SERIES_LIMIT) {
        real_t c = R(1.0) - u * (R(0.5) - u * (R(1.0) / R(24.0) - u * (R(1.0) / R(720.0) - u
            * (R(1.0) / R(40320.0) - u * (R(1.0) / R(3628800.0) - u * (R(1.0)
            / R(479001600.0)))))));
        real_t s = R(0.5) * (R(1.0) - u * (R(1.0) / R(6.0) - u * (R(1.0) / R(120.0) - u * (R(1.0)
            / R(5040.0) - u * (R(1.0) / R(362880.0) - u * (R(1.0) / R(39916800.0)))))));
        *out1 = c;
        *out2 = s;
        return;
    }
    real_t x = SQRT(u);
    *out1 = COS(x);
    *out2 = R(0.5) * SIN(x) / x;
}

/* Exponential: Alexiev (14)-(17), with the series near zero that they lack. */
static void quat_from_rotvec(real_t x, real_t y, real_t z, real_t *out1, real_t *out2, real_t *out3,
    real_t *out4)
{
    real_t c, s;
    half_angle(R(0.25) * (x * x + y * y + z * z), &c, &s);
    *out1 = c;
    *out2 = s * x;
    *out3 = s * y;
    *out4 = s * z;
}

/* A (x) sigma_q of Alexiev (20); order 0 is the limit of the series. */
static void quaternion_increment(real_t x, real_t y, real_t z, real_t *out1, real_t *out2,
    real_t *out3, real_t *out4)
{
    quat_from_rotvec(x, y, z, out1, out2, out3, out4);
}

/* Hamilton product: q_ac = q_ab q_bc. */
static void quat_multiply(real_t aw, real_t ax, real_t ay, real_t az, real_t bw, real_t bx,
    real_t by, real_t bz, real_t *out1, real_t *out2, real_t *out3, real_t *out4)
{
    *out1 = aw * bw - ax * bx - ay * by - az * bz;
    *out2 = aw * bx + ax * bw + ay * bz - az * by;
    *out3 = aw * by - ax * bz + ay * bw + az * bx;
    *out4 = aw * bz + ax * by - ay * bx + az * bw;
}

/* Scale to unit norm; the zero quaternion gives NaN, which the tables refuse. */
static void quat_normalise(real_t w, real_t x, real_t y, real_t z, real_t *out1, real_t *out2,
    real_t *out3, real_t *out4)
{
    real_t k = R(1.0) / SQRT(w * w + x * x + y * y + z * z);
    *out1 = w * k;
    *out2 = x * k;
    *out3 = y * k;
    *out4 = z * k;
}

static void quaternion_turned(real_t w, real_t x, real_t y, real_t z, real_t tx, real_t ty,
    real_t tz, real_t *out1, real_t *out2, real_t *out3, real_t *out4)
{
    real_t dw, dx, dy, dz;
    quaternion_increment(tx, ty, tz, &dw, &dx, &dy, &dz);
    quat_multiply(w, x, y, z, dw, dx, dy, dz, &w, &x, &y, &z);
    quat_normalise(w, x, y, z, out1, out2, out3, out4);
}

static void quaternion_step(real_t *state, real_t tx, real_t ty, real_t tz)
{
    quaternion_turned(state[0], state[1], state[2], state[3], tx, ty, tz, &state[0], &state[1],
        &state[2], &state[3]);
}

/* Theta and dtheta of one axis: trapezoid of instantaneous rates, or a mean rate. */
static real_t increment(real_t w0, real_t w1, real_t dt)
{
    return R(0.5) * (w0 + w1) * dt;
}

/* Angle in (-pi, pi]; unchanged to the last bit when it already lies there. */
static real_t wrap_pi(real_t angle)
{
    /* fmod is exact, so that no multiple of 2 pi is rounded twice. */
    angle = FMOD(angle, R(2.0) * PI);
    if (angle > PI) {
        return angle - R(2.0) * PI;
    }
    if (angle <= -PI) {
        return angle + R(2.0) * PI;
    }
    return angle;
}

/* Roll and heading in (-pi, pi], pitch in [-pi/2, pi/2]; at the lock roll is zero.
 *
 * Half sum and half difference of heading and roll (Bernardes and Viollet 2022,
 * doi:10.1371/journal.pone.0276302) keep full accuracy at every pitch, where the usual arcsine
 * loses half its digits near +-90 deg.
 */
static void euler_from_quat(real_t w, real_t x, real_t y, real_t z, real_t *out1, real_t *out2,
    real_t *out3)
{
    real_t up = HYPOT(w + y, z - x);
    real_t down = HYPOT(w - y, z + x);
    real_t pitch = R(2.0) * ATAN2(up, down) - R(0.5) * PI;
    real_t half_sum = ATAN2(z + x, w - y);
    real_t half_difference = ATAN2(z - x, w + y);
    if (down < GIMBAL_LOCK) {
        half_sum = half_difference;
    } else if (up < GIMBAL_LOCK) {
        half_difference = half_sum;
    }
    *out1 = wrap_pi(half_sum - half_difference);
    *out2 = pitch;
    *out3 = wrap_pi(half_sum + half_difference);
}

void attitude_init(struct attitude *a, const real_t q_nb[4])
{
    real_t w, x, y, z;
    quat_normalise(q_nb[0], q_nb[1], q_nb[2], q_nb[3], &w, &x, &y, &z);
    a->state[0] = w;
    a->state[1] = x;
    a->state[2] = y;
    a->state[3] = z;
    a->started = 0;
}

/* False for NaN and infinity, too, and for what is too large to be squared. */
static int usable(real_t dt, const real_t *gyro)
{
    return dt > R(0.0) && dt < LARGEST && FABS(gyro[0]) < LARGEST && FABS(gyro[1]) < LARGEST
        && FABS(gyro[2]) < LARGEST;
}

int attitude_update(struct attitude *a, real_t dt, const real_t gyro[3])
{
    /* The first sample ends no step: its dt does not matter. */
    if (!usable(a->started ? dt : R(1.0), gyro)) {
        return 1;
    }
    if (a->started) {
        real_t theta[3];
        for (int i = 0; i < 3; i++) {
            theta[i] = increment(a->rate[i], gyro[i], dt);
        }
        quaternion_step(a->state, theta[0], theta[1], theta[2]);
    }
    for (int i = 0; i < 3; i++) {
        a->rate[i] = gyro[i];
    }
    a->started = 1;
    return 0;
}

void attitude_quaternion(const struct attitude *a, real_t q_nb[4])
{
    quat_normalise(a->state[0], a->state[1], a->state[2], a->state[3],
        &q_nb[0], &q_nb[1], &q_nb[2], &q_nb[3]);
}

void attitude_euler(const struct attitude *a, real_t euler[3])
{
    real_t q[4];
    attitude_quaternion(a, q);
    euler_from_quat(q[0], q[1], q[2], q[3], &euler[0], &euler[1], &euler[2]);
}

#ifdef ATTITUDE_TEST
#include <float.h>
#include <stdio.h>

#define SAMPLES 48
#define LAG 0 /* samples by which the attitude is behind */

static const real_t start[4] = {
    R(0x1.0000000000000p+0), 
    R(0x0.0p+0), 
    R(0x0.0p+0), 
    R(0x0.0p+0)};

/* dt in s, rates in rad/s; single precision holds each exactly. */
static const double samples[SAMPLES][4] = {
    {0x0p+0, 0x0p+0, 0x0p+0, 0x0p+0},
    {0x1p-4, 0x1.99999ap-3, 0x1.00ae3ap-4, 0x1.f53f3ap-5},
    {0x1p-4, 0x1.99999ap-2, 0x1.3f1c42p-3, 0x1.bd8f04p-6},
    {0x1p-4, 0x1.333334p-1, 0x1.a421acp-4, -0x1.f048aep-4},
    {0x1p-4, 0x1.99999ap-1, -0x1.22029cp-3, -0x1.34bf56p-2},
    {0x1p-4, 0x1p+0, -0x1.906576p-2, -0x1.7f929ap-2},
    {0x1p-4, 0x1.333334p+0, -0x1.7bd446p-2, -0x1.e1f22cp-3},
    {0x1p-4, 0x1.666666p+0, 0x1.348952p-7, 0x1.abd08ap-4},
    {0x1p-4, 0x1.99999ap+0, 0x1.0411bp-1, 0x1.fc465cp-2},
    {0x1p-4, 0x1.ccccccp+0, 0x1.658a4ap-1, 0x1.70968p-1},
    {0x1p-4, 0x1p+1, 0x1.519b82p-2, 0x1.34cc62p-1},
    {0x1p-4, 0x1.19999ap+1, -0x1.9c4b74p-2, 0x1.146aap-3},
    {0x1p-4, 0x1.333334p+1, -0x1.e22658p-1, -0x1.fe7b44p-2},
    {0x1p-4, 0x1.4cccccp+1, -0x1.95bdb4p-1, -0x1.f8a48ep-1},
    {0x1p-4, 0x1.666666p+1, 0x1.347e28p-5, -0x1.0ac596p+0},
    {0x1p-4, 0x1.8p+1, 0x1.edd85cp-1, -0x1.242b7ep-1},
    {0x1p-4, 0x1.99999ap+1, 0x1.3c6d3ep+0, 0x1.0a1522p-2},
    {0x1p-4, 0x1.b33334p+1, 0x1.144226p-1, 0x1.11adap+0},
    {0x1p-4, 0x1.ccccccp+1, -0x1.5c4eaap-1, 0x1.706e7cp+0},
    {0x1p-4, 0x1.e66666p+1, -0x1.7eeb5cp+0, 0x1.2104cp+0},
    {0x1p-4, 0x1p+2, -0x1.339ab8p+0, 0x1.c00f7ep-3},
    {0x1p-4, 0x1.0cccccp+2, 0x1.5af8fep-4, -0x1.caf7ccp-1},
    {0x1p-4, 0x1.19999ap+2, 0x1.6e9bdcp+0, -0x1.ad5ccap+0},
    {0x1p-4, 0x1.266666p+2, 0x1.c4bdccp+0, -0x1.b34db4p+0},
    {0x1p-4, 0x1.333334p+2, 0x1.76c8d4p-1, -0x1.c4dd9p-1},
    {0x1p-4, 0x1.4p+2, -0x1.f2ddep-1, 0x1.c169bep-2},
    {0x1p-4, 0x1.4cccccp+2, -0x1.06c1a4p+1, 0x1.a80ab2p+0},
    {0x1p-4, 0x1.59999ap+2, -0x1.991166p+0, 0x1.1420d8p+1},
    {0x1.8p-4, 0x1.666666p+2, 0x1.345182p-3, 0x1.a367f2p+0},
    {0x1.8p-4, 0x1.733334p+2, 0x1.e8fe72p+0, 0x1.1d3a8cp-2},
    {0x1p-4, 0x1.8p+2, 0x1.25cc76p+1, -0x1.50865ep+0},
    {0x1p-4, 0x1.8cccccp+2, 0x1.d04a84p-1, -0x1.30149ap+1},
    {0x1p-4, 0x1.99999ap+2, -0x1.48da46p+0, -0x1.2cac06p+1},
    {0x1.8p-4, 0x1.a66666p+2, -0x1.4e5e12p+1, -0x1.2d3712p+0},
    {0x1.8p-4, 0x1.b33334p+2, -0x1.fb2c14p+0, 0x1.486714p-1},
    {0x1p-4, 0x1.cp+2, 0x1.e18b0ap-3, 0x1.210464p+1},
    {0x1p-4, 0x1.ccccccp+2, 0x1.32fd0cp+1, 0x1.6fce76p+1},
    {0x1p-4, 0x1.d9999ap+2, 0x1.68707ep+1, 0x1.10b956p+1},
    {0x1.8p-4, 0x1.e66666p+2, 0x1.10589ep+0, 0x1.41bb94p-2},
    {0x1.8p-4, 0x1.f33334p+2, -0x1.9c5956p+0, -0x1.c0a80cp+0},
    {0x1p-4, 0x1p+3, -0x1.963b8cp+1, -0x1.8a488ap+1},
    {0x1p-4, 0x1.066666p+3, -0x1.2cea36p+1, -0x1.7e6006p+1},
    {0x1p-4, 0x1.0cccccp+3, 0x1.5a8802p-2, -0x1.725d1ep+0},
    {0x1.8p-4, 0x1.133334p+3, 0x1.72ba48p+1, 0x1.bc0d88p-1},
    {0x1.8p-4, 0x1.19999ap+3, 0x1.aa3c46p+1, 0x1.6fc3b2p+1},
    {0x1p-4, 0x1.2p+3, 0x1.33f428p+0, 0x1.cb2c24p+1},
    {0x1p-4, 0x1.266666p+3, -0x1.f3db82p+0, 0x1.4d843ap+1},
    {0x1p-4, 0x1.2cccccp+3, -0x1.de4a96p+1, 0x1.4d7c46p-2},
};

/* q_nb at each sample, by the kernels of strapdown in the same precision. */
static const double expected[SAMPLES][4] = {
#if JOIN(IS_, REAL) == IS_float
    {0x1p+0, 0x0p+0, 0x0p+0, 0x0p+0},
    {0x1.ffff3cbd6ffacp-1, 0x1.9999676458e8ap-9, 0x1.00ae185d9b973p-10, 0x1.f53efacef6331p-11},
    {0x1.fff423357a95cp-1, 0x1.998667c46f9cdp-7, 0x1.20310c6dc72f7p-8, 0x1.3280b05438c2dp-9},
    {0x1.ffc77577098c9p-1, 0x1.cc70d9b823105p-6, 0x1.1626d29f4a06cp-7, 0x1.be9855c9b1b1cp-11},
    {0x1.ff5613f751552p-1, 0x1.98cffa5fb726ap-5, 0x1.08cb86f25d78fp-7, -0x1.86135672cb768p-8},
    {0x1.fe5f1c44bef3bp-1, 0x1.3ec954eb22dep-4, 0x1.09a465194aa8dp-13, -0x1.18d3570c1adffp-6},
    {0x1.fc8ef22a2dddep-1, 0x1.ca0a2225fd3c7p-4, -0x1.7ba3021f7c903p-7, -0x1.c37a982571fp-6},
    {0x1.f9bdef90e4b5ap-1, 0x1.372c8d4596cd3p-3, -0x1.2825d5675086p-6, -0x1.e7016bbaf2311p-6},
    {0x1.f5b856c86fc5dp-1, 0x1.95be0aa217f76p-3, -0x1.a668caa8c0873p-7, -0x1.2c92be7814238p-6},
    {0x1.efbff07f7f6bp-1, 0x1.ffc89a839f0ffp-3, 0x1.bf930c731ba01p-11, 0x1.34fc684f772bcp-8},
    {0x1.e70edc6857a28p-1, 0x1.3a1f6faee0744p-2, 0x1.7934a937c3aa3p-7, 0x1.d5afba8924a95p-6},
    {0x1.db83d6bec5fdfp-1, 0x1.79794f0100e7ap-2, 0x1.1ea1973e5eef7p-7, 0x1.3b15412b26927p-5},
    {0x1.ccd3ec2b7eac5p-1, 0x1.bd7a083b1a09p-2, -0x1.838bfe75ff24p-8, 0x1.950028644089ap-6},
    {0x1.b9f5e9399f4f2p-1, 0x1.0249bcb7490acp-1, -0x1.2aed3ad41f86dp-6, -0x1.ed7fd55e31ed7p-8},
    {0x1.a2241a7f3e2aep-1, 0x1.26b60659aeae6p-1, -0x1.aa4c9e81b9b72p-7, -0x1.413ea661c1b7dp-5},
    {0x1.852c30a480675p-1, 0x1.4bb0b6d7d416p-1, 0x1.605af4c560584p-7, -0x1.94be969698e29p-5},
    {0x1.62b9ecb6a09f6p-1, 0x1.70695ca9eb97p-1, 0x1.1feedaf4a58dap-5, -0x1.0326970f5f2dep-5},
    {0x1.3a8c884f90259p-1, 0x1.93905fd52fc84p-1, 0x1.268eb66b0c0b7p-5, -0x1.9ae2fdcb1e96ap-11},
    {0x1.0c716f316c3d2p-1, 0x1.b3e33cb0915efp-1, 0x1.c56e82a3112a4p-9, 0x1.2038972233f28p-6},
    {0x1.af6e7f6f79e55p-2, 0x1.cfb51764aa098p-1, -0x1.7c059180b2a1bp-5, 0x1.2c4ecf9b669f9p-7},
    {0x1.38da674782cd9p-2, 0x1.e5ab27fc6c535p-1, -0x1.4e40f95dea0e5p-4, -0x1.dad743f11690ep-7},
    {0x1.7104b2e57ec0cp-3, 0x1.f5e2807fc738bp-1, -0x1.3fc8310b303b4p-4, -0x1.83e7fad70910ep-6},
    {0x1.89149dc0cc48p-5, 0x1.ff0f05add424bp-1, -0x1.2e6311cf61593p-5, 0x1.82bd7fc1d141bp-9},
    {-0x1.724b9707c19ffp-4, 0x1.fd06c8aac0759p-1, 0x1.342f753164f98p-6, 0x1.c4c5c2d076d0cp-5},
    {-0x1.dda189061c203p-3, 0x1.ee7c88eb3914bp-1, 0x1.0298ea638004cp-4, 0x1.81aaa398ce6e6p-4},
    {-0x1.81f1ea2ca4a82p-2, 0x1.d66e15c65634ep-1, 0x1.596d5a5db539p-4, 0x1.4d67446c449acp-4},
    {-0x1.0826a3f6096f5p-1, 0x1.b47431ef89ba3p-1, 0x1.576923f30c202p-4, 0x1.73104df2011dcp-7},
    {-0x1.496d43e8fe8dbp-1, 0x1.8460138942521p-1, 0x1.022abc5cb955cp-4, -0x1.4e342fe13c77ap-4},
    {-0x1.9b2f7bd032a8p-1, 0x1.235ec748ef732p-1, -0x1.5404377fda75p-8, -0x1.697b6b9816223p-3},
    {-0x1.d4729e4380e4ep-1, 0x1.603b16b1c742bp-2, -0x1.d777d240a3395p-4, -0x1.6a74eea81343ap-3},
    {-0x1.e9508052adc78p-1, 0x1.771c4eb6e16abp-3, -0x1.989b7e997d9b2p-3, -0x1.d858ba6190f9fp-4},
    {-0x1.ef17430797c5cp-1, 0x1.fdf5930021fdcp-7, -0x1.043ef97d6c8e3p-2, -0x1.72b20f4601ccdp-7},
    {-0x1.e6ec37e0d18e9p-1, -0x1.3dd709eba570ep-3, -0x1.f39be5e001954p-3, 0x1.bffc41e34fe1ep-4},
    {-0x1.bbbee487db358p-1, -0x1.9b80d07dfc283p-2, -0x1.00efec4ea9d32p-3, 0x1.12095e53e603bp-2},
    {-0x1.6924e2acabcf9p-1, -0x1.3c0ab6d70c869p-1, 0x1.9e35ee7acf619p-5, 0x1.611460b43f9c3p-2},
    {-0x1.23ec753412f35p-1, -0x1.7b9410f6d78dfp-1, 0x1.5beaa30cf5ad6p-3, 0x1.3dfd8321dd6d4p-2},
    {-0x1.b0b213e17bab7p-2, -0x1.b078bde17fb6bp-1, 0x1.135e47ec9438p-2, 0x1.82c2abe4b907dp-3},
    {-0x1.04b69e53942ddp-2, -0x1.d080c504b2c94p-1, 0x1.5629e1cdbc061p-2, 0x1.5d3dffc21a3c2p-6},
    {0x1.62e6f733da51dp-5, -0x1.d5a7f4f1d80fp-1, 0x1.63ab313369723p-2, -0x1.84d8a92053d33p-3},
    {0x1.732bc179a461fp-2, -0x1.b658e361534c6p-1, 0x1.d0b1c357c9c33p-3, -0x1.2908f5947a668p-2},
    {0x1.1b575c24a7ab7p-1, -0x1.8cfad4335b24p-1, 0x1.d5d9bc3cc8778p-5, -0x1.31fbb42795863p-2},
    {0x1.675818d5e074ap-1, -0x1.461edaf170ac2p-1, -0x1.1d20d91372d4ep-3, -0x1.25cd970c406f2p-2},
    {0x1.a196ce17adfd1p-1, -0x1.bbc781f90da49p-2, -0x1.17a22ab9008fep-2, -0x1.138876bdcc105p-2},
    {0x1.de2ac365ab96cp-1, -0x1.e01c69671fd4dp-5, -0x1.33fc14e65f973p-2, -0x1.7911251a0c112p-3},
    {0x1.d9d1a7b81fddep-1, 0x1.43ae7c712295ep-2, -0x1.a94fddf3e600dp-3, 0x1.7ca8002aed367p-6},
    {0x1.9df8add5ffdap-1, 0x1.10c48be4535b8p-1, -0x1.44eb37df08d44p-3, 0x1.8b6591d7e24b4p-3},
    {0x1.34a4807f96896p-1, 0x1.71e43c98e84b6p-1, -0x1.42b0ae8565243p-3, 0x1.32f5787ee45aep-2},
    {0x1.5cc588d0d742fp-2, 0x1.c2a4fc784a7d8p-1, -0x1.32acbcf56eaa1p-3, 0x1.2dd400f9a5228p-2},
#else
    {0x1p+0, 0x0p+0, 0x0p+0, 0x0p+0},
    {0x1.ffff3cbd710e2p-1, 0x1.999965ee3ee82p-9, 0x1.00ae195ec16efp-10, 0x1.f53efa47bf27p-11},
    {0x1.fff423359260bp-1, 0x1.998666085efe6p-7, 0x1.20310b9ac8004p-8, 0x1.3280b0c57c44fp-9},
    {0x1.ffc775777a1f5p-1, 0x1.cc70d7f49b4a1p-6, 0x1.1626d1541dc48p-7, 0x1.be985a1be453bp-11},
    {0x1.ff5613f7da5b7p-1, 0x1.98cff9d9e1c4ep-5, 0x1.08cb83ed3c5c4p-7, -0x1.861354cf1f885p-8},
    {0x1.fe5f1c46fc20ap-1, 0x1.3ec95422efc9bp-4, 0x1.09a3c8a37a02fp-13, -0x1.18d354fbda893p-6},
    {0x1.fc8ef22d5b62ap-1, 0x1.ca0a2180704c9p-4, -0x1.7ba302fe468f4p-7, -0x1.c37a94246e5bp-6},
    {0x1.f9bdef9545fep-1, 0x1.372c8cf37cbe2p-3, -0x1.2825d52992d2p-6, -0x1.e70166cc32453p-6},
    {0x1.f5b856c6ed3c3p-1, 0x1.95be0ac8f2814p-3, -0x1.a668cc667df0dp-7, -0x1.2c92bad3a112ap-6},
    {0x1.efbff06c8b27dp-1, 0x1.ffc89ba84137ep-3, 0x1.bf934117660b5p-11, 0x1.34fc6e9e2775cp-8},
    {0x1.e70edc6ee3ff1p-1, 0x1.3a1f6f8508a53p-2, 0x1.7934adaae804cp-7, 0x1.d5afba76f59dep-6},
    {0x1.db83d660c1761p-1, 0x1.797950e1c4a08p-2, 0x1.1ea19b75a34e6p-7, 0x1.3b153ed3c53d7p-5},
    {0x1.ccd3eb42c637dp-1, 0x1.bd7a0c048ded6p-2, -0x1.838bfd0832d0cp-8, 0x1.95002155f36fp-6},
    {0x1.b9f5e8a981602p-1, 0x1.0249bdad5ff65p-1, -0x1.2aed37903384bp-6, -0x1.ed8006229ca3p-8},
    {0x1.a2241a6b97be1p-1, 0x1.26b6067084187p-1, -0x1.aa4c98cf7ef47p-7, -0x1.413eab7bd685p-5},
    {0x1.852c30ebfa28bp-1, 0x1.4bb0b67907ceap-1, 0x1.605af91da9beap-7, -0x1.94be9f50486ecp-5},
    {0x1.62b9eb0e15a3p-1, 0x1.70695e3c3fe0dp-1, 0x1.1feeda143d487p-5, -0x1.0326a1319ac02p-5},
    {0x1.3a8c862aee3b5p-1, 0x1.9390618190e04p-1, 0x1.268eb525267e1p-5, -0x1.9ae5a6b0520cp-11},
    {0x1.0c716cf63641ep-1, 0x1.b3e33e1516214p-1, 0x1.c56e5a6bd4c05p-9, 0x1.20387b78a6bd2p-6},
    {0x1.af6e7add2d7d3p-2, 0x1.cfb51874ca627p-1, -0x1.7c0594b7e3a35p-5, 0x1.2c4e909326356p-7},
    {0x1.38da624a222e8p-2, 0x1.e5ab28c542a0dp-1, -0x1.4e40f9986ee1ap-4, -0x1.dad7896bad46cp-7},
    {0x1.7104a823f5964p-3, 0x1.f5e280f07076ep-1, -0x1.3fc833ed9217ep-4, -0x1.83e81c9a80bb4p-6},
    {0x1.891476ef8d05dp-5, 0x1.ff0f05c5f7633p-1, -0x1.2e631ca3be16bp-5, 0x1.82bc96a925d46p-9},
    {-0x1.724ba951c443fp-4, 0x1.fd06c8832622p-1, 0x1.342f5520dcccap-6, 0x1.c4c5b8f6ae482p-5},
    {-0x1.dda18f8803717p-3, 0x1.ee7c88a98c82dp-1, 0x1.0298e1144bbcap-4, 0x1.81aa9ea74dc47p-4},
    {-0x1.81f1eb6223f64p-2, 0x1.d66e15aed5671p-1, 0x1.596d50359506fp-4, 0x1.4d6740d83cc9cp-4},
    {-0x1.0826a574218e9p-1, 0x1.b474312ce094ap-1, 0x1.5769187d5bbdap-4, 0x1.731044170578p-7},
    {-0x1.496d44ccd54d7p-1, 0x1.846012e636bfep-1, 0x1.022aaf99ded78p-4, -0x1.4e3430f5dc42ep-4},
    {-0x1.9b2f7c30b150fp-1, 0x1.235ec6eb5d2a7p-1, -0x1.540502a5a54e4p-8, -0x1.697b6942dfc2cp-3},
    {-0x1.d4729f18b066ep-1, 0x1.603b12232796ap-2, -0x1.d777df6f9d319p-4, -0x1.6a74eadcfd9adp-3},
    {-0x1.e950809dec7b9p-1, 0x1.771c450aaf5f8p-3, -0x1.989b848f2be9ep-3, -0x1.d858b0ff7e812p-4},
    {-0x1.ef1742c9a2354p-1, 0x1.fdf5004cddc56p-7, -0x1.043efbbdb2793p-2, -0x1.72b1b2d152127p-7},
    {-0x1.e6ec37487716fp-1, -0x1.3dd70f8fdf111p-3, -0x1.f39be8bdd3f97p-3, 0x1.bffc4e7d3e759p-4},
    {-0x1.bbbee2d89084fp-1, -0x1.9b80d4fb0553cp-2, -0x1.00efeda239d5ep-3, 0x1.120962306c41fp-2},
    {-0x1.6924df4ee049cp-1, -0x1.3c0ab9421c0ap-1, 0x1.9e35f89aac8fep-5, 0x1.611465a22ab1ap-2},
    {-0x1.23ec70cd8777ep-1, -0x1.7b9412e4c1bd1p-1, 0x1.5beaa966253d1p-3, 0x1.3dfd8857d2715p-2},
    {-0x1.b0b20acbfe9bep-2, -0x1.b078bf2a5b86fp-1, 0x1.135e4b6989449p-2, 0x1.82c2b3a0bdc13p-3},
    {-0x1.04b693a559a7cp-2, -0x1.d080c583c7603p-1, 0x1.5629e7051124ep-2, 0x1.5d3e388a25481p-6},
    {0x1.62e734772ec2ap-5, -0x1.d5a7f3cf196d5p-1, 0x1.63ab37c5ad673p-2, -0x1.84d8a38970548p-3},
    {0x1.732bcb1f990c3p-2, -0x1.b658e0ad719a9p-1, 0x1.d0b1cea6d0408p-3, -0x1.2908f50def5d1p-2},
    {0x1.1b57605f92b6ap-1, -0x1.8cfad0ba49f98p-1, 0x1.d5d9ee527dc16p-5, -0x1.31fbb54eaedfp-2},
    {0x1.67581c0a71f3ap-1, -0x1.461ed77cf14a7p-1, -0x1.1d20cc21b7e13p-3, -0x1.25cd99d8e7a6bp-2},
    {0x1.a196d06a35feep-1, -0x1.bbc7794fb5d84p-2, -0x1.17a2242f7aab1p-2, -0x1.13887d3f50051p-2},
    {0x1.de2ac3d370489p-1, -0x1.e01c0f2cff07ep-5, -0x1.33fc106efd2eap-2, -0x1.7911322c9da84p-3},
    {0x1.d9d1a60b46b9ep-1, 0x1.43ae875d1af2bp-2, -0x1.a94fdc22668acp-3, 0x1.7ca78fee89069p-6},
    {0x1.9df8aa260c02ap-1, 0x1.10c49286b1d06p-1, -0x1.44eb3b8e8201bp-3, 0x1.8b65835b2de6p-3},
    {0x1.34a47a3520814p-1, 0x1.71e442c9cae5p-1, -0x1.42b0b998a93dcp-3, 0x1.32f5710ba72b6p-2},
    {0x1.5cc5786be3831p-2, 0x1.c2a5006d04dfep-1, -0x1.32acc69a83fc2p-3, 0x1.2dd3f9d7f3a58p-2},
#endif
};

/* 48 steps of 32 roundings that another compiler or another sine may make otherwise. */
#define EPSILON (sizeof(real_t) == sizeof(float) ? (double)FLT_EPSILON : DBL_EPSILON)
#define BOUND (1536 * EPSILON)

/* Angle between the attitude and an expected one, rad. */
static double apart(const struct attitude *a, const double *q_nb)
{
    real_t q[4];
    double sum = 0.0, difference = 0.0;
    attitude_quaternion(a, q);
    for (int i = 0; i < 4; i++) {
        difference += ((double)q[i] - q_nb[i]) * ((double)q[i] - q_nb[i]);
        sum += ((double)q[i] + q_nb[i]) * ((double)q[i] + q_nb[i]);
    }
    return 2.0 * sqrt(difference < sum ? difference : sum);
}

int main(void)
{
    struct attitude a;
    double largest = 0.0;
    int failed = 0;
    attitude_init(&a, start);
    for (int k = 0; k < SAMPLES + LAG; k++) {
        if (k < SAMPLES) {
            const real_t gyro[3] = {R(samples[k][1]), R(samples[k][2]), R(samples[k][3])};
            failed |= attitude_update(&a, R(samples[k][0]), gyro);
        }
        if (k >= LAG) {
            const double angle = apart(&a, expected[k - LAG]);
            failed |= !(angle <= BOUND); /* so written NaN fails, too */
            largest = angle > largest ? angle : largest;
        }
    }
    printf("largest difference %.3g rad, bound %.3g rad: %s\n", largest, BOUND,
        failed ? "FAILED" : "passed");
    return failed;
}
#endif

#ifdef ATTITUDE_FILTER
#include <stdio.h>

static void put(const struct attitude *a)
{
    real_t q[4];
    attitude_quaternion(a, q);
    for (int i = 0; i < 4; i++) {
        printf("%.17g%c", (double)q[i], i < 3 ? ' ' : '\n');
    }
}

int main(void)
{
    static const real_t from[4] = {
        R(0x1.0000000000000p+0), 
        R(0x0.0p+0), 
        R(0x0.0p+0), 
        R(0x0.0p+0)};
    struct attitude a;
    double dt, x, y, z;
    attitude_init(&a, from);
    while (scanf("%lf %lf %lf %lf", &dt, &x, &y, &z) == 4) {
        const real_t gyro[3] = {R(x), R(y), R(z)};
        if (attitude_update(&a, R(dt), gyro)) {
            fprintf(stderr, "refused: %g %g %g %g\n", dt, x, y, z);
        }
        put(&a);
    }
    return 0;
}
#endif
