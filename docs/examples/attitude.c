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

typedef struct { real_t f0, f1, f2; } real3;
typedef struct { real_t f0, f1; } real2;
typedef struct { real_t f0, f1, f2, f3; } real4;

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
static real2 half_angle(real_t u)
{
    if (u < SERIES_LIMIT) {
        real_t c = R(1.0) - u * (R(0.5) - u * (R(1.0) / R(24.0) - u * (R(1.0) / R(720.0) - u
            * (R(1.0) / R(40320.0) - u * (R(1.0) / R(3628800.0) - u * (R(1.0)
            / R(479001600.0)))))));
        real_t s = R(0.5) * (R(1.0) - u * (R(1.0) / R(6.0) - u * (R(1.0) / R(120.0) - u * (R(1.0)
            / R(5040.0) - u * (R(1.0) / R(362880.0) - u * (R(1.0) / R(39916800.0)))))));
        const real2 t1_ = {c, s};
        return t1_;
    }
    real_t x = SQRT(u);
    const real2 t2_ = {COS(x), R(0.5) * SIN(x) / x};
    return t2_;
}

/* Exponential: Alexiev (14)-(17), with the series near zero that they lack. */
static real4 quat_from_rotvec(real_t x, real_t y, real_t z)
{
    const real2 t1_ = half_angle(R(0.25) * (x * x + y * y + z * z));
    real_t c = t1_.f0, s = t1_.f1;
    const real4 t2_ = {c, s * x, s * y, s * z};
    return t2_;
}

/* A (x) sigma_q of Alexiev (20); order 0 is the limit of the series. */
static real4 quaternion_increment(real_t x, real_t y, real_t z)
{
    return quat_from_rotvec(x, y, z);
}

/* Hamilton product: q_ac = q_ab q_bc. */
static real4 quat_multiply(real_t aw, real_t ax, real_t ay, real_t az, real_t bw, real_t bx,
    real_t by, real_t bz)
{
    const real4 t1_ = {aw * bw - ax * bx - ay * by - az * bz, aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx, aw * bz + ax * by - ay * bx + az * bw};
    return t1_;
}

/* Scale to unit norm; the zero quaternion gives NaN, which the tables refuse. */
static real4 quat_normalise(real_t w, real_t x, real_t y, real_t z)
{
    real_t k = R(1.0) / SQRT(w * w + x * x + y * y + z * z);
    const real4 t1_ = {w * k, x * k, y * k, z * k};
    return t1_;
}

static real4 quaternion_turned(real_t w, real_t x, real_t y, real_t z, real_t tx, real_t ty,
    real_t tz)
{
    const real4 t1_ = quaternion_increment(tx, ty, tz);
    real_t dw = t1_.f0, dx = t1_.f1, dy = t1_.f2, dz = t1_.f3;
    const real4 t2_ = quat_multiply(w, x, y, z, dw, dx, dy, dz);
    w = t2_.f0; x = t2_.f1; y = t2_.f2; z = t2_.f3;
    return quat_normalise(w, x, y, z);
}

static void quaternion_step(real_t *state, real_t tx, real_t ty, real_t tz)
{
    const real4 t1_ = quaternion_turned(state[0], state[1], state[2], state[3], tx, ty, tz);
    state[0] = t1_.f0; state[1] = t1_.f1; state[2] = t1_.f2; state[3] = t1_.f3;
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
static real3 euler_from_quat(real_t w, real_t x, real_t y, real_t z)
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
    real_t roll = half_sum - half_difference, heading = half_sum + half_difference;
    /* A remainder takes longer than to see that nothing is to be wrapped. */
    if (FABS(roll) >= PI || FABS(heading) >= PI) {
        roll = wrap_pi(roll);
        heading = wrap_pi(heading);
    }
    const real3 t1_ = {roll, pitch, heading};
    return t1_;
}

void attitude_init(struct attitude *a, const real_t q_nb[4])
{
    const real4 unit = quat_normalise(q_nb[0], q_nb[1], q_nb[2], q_nb[3]);
    const real_t w = unit.f0, x = unit.f1, y = unit.f2, z = unit.f3;
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
    const real4 result = quat_normalise(a->state[0], a->state[1], a->state[2], a->state[3]);
    q_nb[0] = result.f0; q_nb[1] = result.f1; q_nb[2] = result.f2; q_nb[3] = result.f3;
}

void attitude_euler(const struct attitude *a, real_t euler[3])
{
    real_t q[4];
    attitude_quaternion(a, q);
    const real3 result = euler_from_quat(q[0], q[1], q[2], q[3]);
    euler[0] = result.f0; euler[1] = result.f1; euler[2] = result.f2;
}

#ifdef ATTITUDE_TEST
#include <float.h>
#endif
#if defined ATTITUDE_TEST || defined ATTITUDE_FILTER
#include <stdio.h>

/* Numbers of a row: dt in s, rates in rad/s. */
#define COLUMNS 4
#define RESULTS 4

static void test_start(struct attitude *s)
{
    static const real_t start[4] = {
        R(1.0),
        R(0.0),
        R(0.0),
        R(0.0)};
    attitude_init(s, start);
}

/* Take a row. Returns the number of its results, less than none if it is refused. */
static int test_take(struct attitude *s, const double *v, double *out)
{
    const real_t gyro[3] = {R(v[1]), R(v[2]), R(v[3])};
    const int refused = attitude_update(s, R(v[0]), gyro);
    real_t q[4];
    attitude_quaternion(s, q);
    for (int i = 0; i < 4; i++) {
        out[i] = (double)q[i];
    }
    return refused ? -RESULTS : RESULTS;
}
#endif

#ifdef ATTITUDE_TEST
#define ROWS 48
#define TEST_FIRST 0 /* samples by which the attitude is behind */

/* Single precision holds each exactly. */
static const double test_rows[ROWS][COLUMNS] = {
    {0.0, 0.0, 0.0, 0.0},
    {0.0625, 0.20000000298023224, 0.062666155397892, 0.06118737533688545},
    {0.0625, 0.4000000059604645, 0.15581561625003815, 0.027194742113351822},
    {0.0625, 0.6000000238418579, 0.10257117450237274, -0.12116306275129318},
    {0.0625, 0.800000011920929, -0.14160653948783875, -0.30151113867759705},
    {0.0625, 1.0, -0.391012042760849, -0.3745826780796051},
    {0.0625, 1.2000000476837158, -0.37092694640159607, -0.2353251874446869},
    {0.0625, 1.399999976158142, 0.009415783919394016, 0.10444692522287369},
    {0.0625, 1.600000023841858, 0.5079474449157715, 0.4963621497154236},
    {0.0625, 1.7999999523162842, 0.6983206868171692, 0.7198982238769531},
    {0.0625, 2.0, 0.3296947777271271, 0.603121817111969},
    {0.0625, 2.200000047683716, -0.40263158082962036, 0.13496899604797363},
    {0.0625, 2.4000000953674316, -0.9416987895965576, -0.49851709604263306},
    {0.0625, 2.5999999046325684, -0.792462944984436, -0.985630452632904},
    {0.0625, 2.799999952316284, 0.03765781223773956, -1.0420774221420288},
    {0.0625, 3.0, 0.9645413160324097, -0.5706443190574646},
    {0.0625, 3.200000047683716, 1.2360419034957886, 0.2598462402820587},
    {0.0625, 3.4000000953674316, 0.5395671725273132, 1.0690555572509766},
    {0.0625, 3.5999999046325684, -0.6802876591682434, 1.4391858577728271},
    {0.0625, 3.799999952316284, -1.4957787990570068, 1.1289787292480469},
    {0.0625, 4.0, -1.2015795707702637, 0.2187795490026474},
    {0.0625, 4.199999809265137, 0.08471011370420456, -0.8964217901229858},
    {0.0625, 4.400000095367432, 1.432065725326538, -1.6771970987319946},
    {0.0625, 4.599999904632568, 1.7685210704803467, -1.700404405593872},
    {0.0625, 4.800000190734863, 0.7320009469985962, -0.8845028877258301},
    {0.0625, 5.0, -0.9743490219116211, 0.43887993693351746},
    {0.0625, 5.199999809265137, -2.0527844429016113, 1.656413197517395},
    {0.0625, 5.400000095367432, -1.5979217290878296, 2.157252311706543},
    {0.09375, 5.599999904632568, 0.1505460888147354, 1.6383048295974731},
    {0.09375, 5.800000190734863, 1.9101325273513794, 0.2785436511039734},
    {0.0625, 6.0, 2.295302152633667, -1.3145502805709839},
    {0.0625, 6.199999809265137, 0.9068185091018677, -2.375628709793091},
    {0.0625, 6.400000095367432, -1.2845805883407593, -2.3489997386932373},
    {0.09375, 6.599999904632568, -2.612245798110962, -1.1766215562820435},
    {0.09375, 6.800000190734863, -1.9811413288116455, 0.6414114236831665},
    {0.0625, 7.0, 0.2351284772157669, 2.257946491241455},
    {0.0625, 7.199999809265137, 2.3983473777770996, 2.873488187789917},
    {0.0625, 7.400000095367432, 2.8159329891204834, 2.1306560039520264},
    {0.09375, 7.599999904632568, 1.0638521909713745, 0.31419211626052856},
    {0.09375, 7.800000190734863, -1.6107381582260132, -1.7525641918182373},
    {0.0625, 8.0, -3.173692226409912, -3.080338716506958},
    {0.0625, 8.199999809265137, -2.3508975505828857, -2.9873054027557373},
    {0.0625, 8.399999618530273, 0.3384094536304474, -1.4467333555221558},
    {0.09375, 8.600000381469727, 2.8963098526000977, 0.867290735244751},
    {0.09375, 8.800000190734863, 3.3299643993377686, 2.873159646987915},
    {0.0625, 9.0, 1.202944278717041, 3.587284564971924},
    {0.0625, 9.199999809265137, -1.9525681734085083, 2.605597734451294},
    {0.0625, 9.399999618530273, -3.7366511821746826, 0.32566937804222107},
};

/* q_nb at each sample, by the kernels of strapdown in the same precision. */
static const double test_expected[ROWS][RESULTS] = {
#if JOIN(IS_, REAL) == IS_float
    {1.0, 0.0, 0.0, 0.0},
    {0.9999941807982302, 0.003124994155017384, 0.0009791567203155354, 0.0009560509005225091},
    {0.9999094965726658, 0.012497711818352375, 0.004397454771404289, 0.0023384299512243718},
    {0.9995686252412038, 0.028103077522744453, 0.008488514750368568, 0.0008518124752406628},
    {0.9987035979653831, 0.04990385914945679, 0.008080902950250905, -0.005952080350466328},
    {0.9968193849485724, 0.07782872363366478, 0.00012666805631885263, -0.01714023113929208},
    {0.9932780910957566, 0.11182607020584988, -0.011585594212168098, -0.027556084232656097},
    {0.9877772201892683, 0.15194044464701636, -0.018075426484991275, -0.029724459843950394},
    {0.979922019927368, 0.19811638171358553, -0.012890910105401531, -0.01834553337568165},
    {0.9682612567555307, 0.2498943396966595, 0.0008536804365471552, 0.0047147516883938},
    {0.9512852551814079, 0.30676054482329485, 0.011511404634373895, 0.028667385257515738},
    {0.9287402255895322, 0.3686268181192883, 0.008747290467673958, 0.038462283403719426},
    {0.9000543406576403, 0.4350358282158675, -0.005913495659112089, 0.024719275898868},
    {0.8632042773093913, 0.5044688199746097, -0.018245036554155925, -0.007530202476295953},
    {0.8166816978765234, 0.5756074890590213, -0.013009621997708474, -0.03921444412667705},
    {0.7601027680213536, 0.6478325975859143, 0.010753030316439156, -0.049407285802569874},
    {0.692824742596996, 0.7195538480207642, 0.03514807476783384, -0.03163461212077377},
    {0.6143534276125805, 0.7882108638513192, 0.0359567225317518, -0.0007837041570291474},
    {0.5243029353933883, 0.8513430562531407, 0.0034594091862650434, 0.01759161719456795},
    {0.4213199531354566, 0.9056784925824273, -0.046389373955737244, 0.009164668436643974},
    {0.3055206429859943, 0.9485714431413387, -0.08160493287016697, -0.014490993666346454},
    {0.18018474352706482, 0.9802436977366694, -0.07807177694031858, -0.023675913773460393},
    {0.047983463393742376, 0.998161485165903, -0.03691247442751968, 0.0029505938008775995},
    {-0.09040411945543524, 0.9941923817097901, 0.0188101429426549, 0.05527008104010109},
    {-0.2332182602872451, 0.9657938754212777, 0.06313411291194021, 0.09415687470473308},
    {-0.3768993940113107, 0.9188086323366436, 0.08433280276524457, 0.0813973114748367},
    {-0.5159198034131963, 0.852448997965315, 0.08384050410018776, 0.011323965129130302},
    {-0.6434117528836184, 0.7585455040981836, 0.06302903727517645, -0.08159273818071525},
    {-0.8030966464660452, 0.5690824772388849, -0.005188239621796445, -0.17650493677025833},
    {-0.9149369676019405, 0.3439754053122807, -0.1151045048702158, -0.17698084307122192},
    {-0.9556923008848477, 0.18315946097952937, -0.19951533227840695, -0.11531899266361599},
    {-0.9669743487137441, 0.015562721994015698, -0.2541464789202463, -0.011312730272051397},
    {-0.9510209524094339, -0.15519531011948867, -0.24394969549048062, 0.10937143075442932},
    {-0.866690770706195, -0.4018585755248198, -0.12545761694966867, 0.2676138628680779},
    {-0.7053595386295505, -0.6172692430029773, 0.05056282594749124, 0.34480429744862934},
    {-0.5701634050433088, -0.7413640309639752, 0.16988112815189166, 0.31053738493151894},
    {-0.42255431236018687, -0.8446711862342061, 0.26891434079612253, 0.18884786884075658},
    {-0.2546028841507402, -0.9072324341044742, 0.33414414232448136, 0.02131605125797243},
    {0.04332302362201743, -0.917297033807726, 0.34733273388188673, -0.18986637239366075},
    {0.3624716024870355, -0.8561469131760979, 0.2269015561261952, -0.29007323950518193},
    {0.5534008784050773, -0.7753511727037861, 0.0573548008453732, -0.2988117360267834},
    {0.7018440018730214, -0.636954156849548, -0.13922280874826715, -0.28691707622793594},
    {0.8156036762147726, -0.43337824900246297, -0.27307955507434645, -0.2690752557127925},
    {0.9339200078591552, -0.05860729776849869, -0.30076630264365817, -0.18411473260631134},
    {0.9254276668797805, 0.3160952991535363, -0.20767186546868324, 0.023233413852455167},
    {0.8085378955583344, 0.5327495304315368, -0.1586517682018017, 0.1930648225791508},
    {0.6028175502535926, 0.7224444328932325, -0.15756355614270676, 0.2997645213555086},
    {0.34059728407538875, 0.8801649948920796, -0.1497435343170155, 0.29475404285156737},
#else
    {1.0, 0.0, 0.0, 0.0},
    {0.9999941807987194, 0.0031249939848956862, 0.0009791567787841811, 0.0009560508851503401},
    {0.9999094965834855, 0.012497711010602996, 0.004397454579503805, 0.0023384300027307413},
    {0.9995686252923962, 0.02810307588008654, 0.008488514147968598, 0.0008518126010007907},
    {0.9987035980276947, 0.04990385817568975, 0.00808090154393682, -0.0059520799687772285},
    {0.9968193852092224, 0.0778287207203782, 0.00012666691792096024, -0.01714022921752496},
    {0.993278091465702, 0.11182606779677252, -0.011585594617419016, -0.027556080503676916},
    {0.9877772206991686, 0.15194044225753972, -0.018075426260378724, -0.029724455250093772},
    {0.9799220197515911, 0.19811638284437605, -0.012890910916197673, -0.018345529983450216},
    {0.9682612545489772, 0.249894348213413, 0.000853681968624029, 0.004714753156944553},
    {0.9512852559437289, 0.3067605423877115, 0.011511406706461134, 0.028667385191363574},
    {0.9287402146444316, 0.36862684610346763, 0.008747292430849329, 0.03846227904265447},
    {0.9000543135654052, 0.43503588464544174, -0.005913495326420614, 0.02471926932758256},
    {0.8632042605319727, 0.5044688486232017, -0.01824503351308974, -0.007530213830806917},
    {0.816681695588951, 0.5756074917172079, -0.013009619345204405, -0.03921445362966891},
    {0.7601027763422094, 0.6478325865499788, 0.01075303233967691, -0.04940730205477259},
    {0.6928246931736961, 0.7195538948580534, 0.035148073135055795, -0.03163463099630094},
    {0.6143533637433537, 0.7882109137212301, 0.03595672016054131, -0.0007837239736909959},
    {0.5243028688956917, 0.851343097757367, 0.0034594045045337495, 0.017591591432033322},
    {0.42131988501512047, 0.9056785242621047, -0.046389379945243205, 0.009164639084973263},
    {0.30552056863284216, 0.9485714665218566, -0.0816049337217283, -0.014491026019962848},
    {0.1801846633886256, 0.9802437108521482, -0.07807178768519482, -0.023675945218211772},
    {0.04798339109075365, 0.9981614879758979, -0.03691249459911002, 0.002950566664889162},
    {-0.09040418758765244, 0.994192377099413, 0.018810113080189685, 0.05527006269171243},
    {-0.23321830877142055, 0.9657938677758061, 0.06313407823175435, 0.09415685628924662},
    {-0.37689941202642374, 0.9188086296005179, 0.08433276492843488, 0.08139729814483804},
    {-0.5159198478948187, 0.8524489753038236, 0.08384046140939408, 0.011323960539850964},
    {-0.643411779407553, 0.7585454851172242, 0.06302898973620141, -0.08159274220612708},
    {-0.8030966576995143, 0.5690824663457378, -0.005188286920789074, -0.17650491938909008},
    {-0.9149369924200081, 0.34397533740584285, -0.11510455398258691, -0.17698081480894015},
    {-0.955692309644511, 0.18315938891275585, -0.19951537668156488, -0.1153189577088656},
    {-0.9669743415007397, 0.015562653681383914, -0.25414651246375647, -0.011312687218961571},
    {-0.9510209346731652, -0.15519535215197114, -0.24394971684750708, 0.10937147769791745},
    {-0.8666907204972264, -0.40185864240750724, -0.12545762683223932, 0.26761392040777027},
    {-0.705359438303407, -0.6172693150711162, 0.050562844805783755, 0.3448043709019416},
    {-0.5701632738962272, -0.7413640884632234, 0.16988117545102324, 0.3105374625780411},
    {-0.4225541769989397, -0.8446712245183913, 0.2689143927730738, 0.18884792646687795},
    {-0.25460272499768855, -0.9072324488985831, 0.3341442200510628, 0.021316104139789353},
    {0.043323137733260644, -0.9172969999605934, 0.34733283180262403, -0.18986633074932002},
    {0.3624717462573807, -0.8561468326304765, 0.22690164038252214, -0.29007323167374205},
    {0.5534010044733411, -0.7753510692027588, 0.0573548941355783, -0.2988117532038066},
    {0.7018440973997493, -0.6369540538804771, -0.13922271230602287, -0.2869171179426419},
    {0.8156037454273226, -0.43337811993611575, -0.2730794576624858, -0.26907535265855126},
    {0.9339200206378716, -0.05860712970749747, -0.30076623608992625, -0.18411483000427975},
    {0.9254276169552786, 0.31609546190041965, -0.20767185192091142, 0.02323330932462434},
    {0.8085377856677998, 0.5327497281477072, -0.15865179566049012, 0.19306471464163888},
    {0.6028173627712499, 0.722444617398148, -0.15756363865980816, 0.29976441033958723},
    {0.34059703978062134, 0.880165112789143, -0.14974360617679677, 0.29475393658223004},
#endif
};

/* Angle between the attitude and an expected one, rad. */
static double test_apart(const double *q, const double *q_nb)
{
    double sum = 0.0, difference = 0.0;
    for (int i = 0; i < 4; i++) {
        difference += (q[i] - q_nb[i]) * (q[i] - q_nb[i]);
        sum += (q[i] + q_nb[i]) * (q[i] + q_nb[i]);
    }
    return 2.0 * sqrt(difference < sum ? difference : sum);
}

/* 48 steps of 32 roundings that another compiler or another sine may make otherwise. */
#define EPSILON (sizeof(real_t) == sizeof(float) ? (double)FLT_EPSILON : DBL_EPSILON)
#define BOUND (1536 * EPSILON)

int main(void)
{
    static struct attitude s;
    static double v[COLUMNS], out[RESULTS];
    double largest = 0.0;
    int failed = 0;
    test_start(&s);
    for (int k = 0; k < ROWS; k++) {
        for (int i = 0; i < COLUMNS; i++) {
            v[i] = test_rows[k][i];
        }
        failed |= test_take(&s, v, out) < 0;
        if (k >= TEST_FIRST) {
            const double off = test_apart(out, test_expected[k - TEST_FIRST]);
            failed |= !(off <= BOUND); /* so written NaN fails, too */
            largest = off > largest ? off : largest;
        }
    }
    printf("largest difference %.3g rad, bound %.3g rad: %s\n", largest, BOUND,
        failed ? "FAILED" : "passed");
    return failed;
}
#endif

#ifdef ATTITUDE_FILTER
static void test_put(int count, const double *out)
{
    for (int i = 0; i < count; i++) {
        printf("%.17g%c", out[i], i + 1 < count ? ' ' : '\n');
    }
}

int main(void)
{
    static struct attitude s;
    static double v[COLUMNS], out[RESULTS];
    int column = 0;
    test_start(&s);
    while (scanf("%lf", v + column) == 1) {
        column = (column + 1) % COLUMNS;
        if (column == 0) {
            const int count = test_take(&s, v, out);
            if (count < 0) {
                fprintf(stderr, "refused\n");
            }
            test_put(count < 0 ? -count : count, out);
        }
    }
    return column != 0;
}
#endif
