// The loop around the straight-line code of one robot.
// One step computes LANES configurations, one in each lane of a register.
// ROBOT is a file with this code and the robot's sizes.

#include <string.h>

#ifdef __AVX512F__
#define LANES 8
#else
#define LANES 4
#endif
typedef double lanes __attribute__((vector_size(8 * LANES)));
typedef double anywhere __attribute__((vector_size(8 * LANES), aligned(8)));
typedef long whole __attribute__((vector_size(8 * LANES)));
#define INLINE static inline __attribute__((always_inline))

#define casadi_real lanes
#define casadi_int long
INLINE lanes casadi_sq(lanes x) { return x * x; }
INLINE lanes in_all_lanes(double x) { return x - (lanes){}; }

#include ROBOT

// The compiler unrolls the loops of `transpose` and keeps x in registers.
// Numbers, pairs and groups of four are exchanged across the diagonal.
#if LANES == 8
#define EXCHANGE_1 {0, 8, 2, 10, 4, 12, 6, 14}, {1, 9, 3, 11, 5, 13, 7, 15}
#define EXCHANGE_2 {0, 1, 8, 9, 4, 5, 12, 13}, {2, 3, 10, 11, 6, 7, 14, 15}
#define EXCHANGE_4 {0, 1, 2, 3, 8, 9, 10, 11}, {4, 5, 6, 7, 12, 13, 14, 15}
#else
#define EXCHANGE_1 {0, 4, 2, 6}, {1, 5, 3, 7}
#define EXCHANGE_2 {0, 1, 4, 5}, {2, 3, 6, 7}
#endif
INLINE void exchange(lanes *x, lanes *y, const whole at[2]) {
    lanes one = *x, other = *y;
    *x = __builtin_shuffle(one, other, at[0]);
    *y = __builtin_shuffle(one, other, at[1]);
}

INLINE void transpose(lanes x[LANES]) {
    for (int i = 0; i < LANES; i += 2) exchange(x + i, x + i + 1, (whole[]){EXCHANGE_1});
    for (int i = 0; i < LANES; i += 4)
        for (int k = i; k < i + 2; k++) exchange(x + k, x + k + 2, (whole[]){EXCHANGE_2});
#if LANES == 8
    for (int i = 0; i < 4; i++) exchange(x + i, x + i + 4, (whole[]){EXCHANGE_4});
#endif
}

// Read the numbers with the indices `at` from LANES rows.
// The function also reads numbers beyond the end of a row.
INLINE void read(const double *from, int width, const int *at, lanes *to) {
    for (int first = 0; first < width; first += LANES) {
        int wanted = 0;
        for (int i = 0; i < STEPS; i++) wanted |= at[i] / LANES == first / LANES;
        if (!wanted) continue;
        lanes x[LANES];
        for (int k = 0; k < LANES; k++) x[k] = *(const anywhere *)(from + k * width + first);
        transpose(x);
        for (int i = 0; i < STEPS; i++)
            if (at[i] / LANES == first / LANES) to[i] = x[at[i] % LANES];
    }
}

// Write row by row. After a row that is shorter than a register, the next row overwrites the excess.
INLINE void write(const lanes *results, double *to) {
    for (int j = 0; j < RESULTS; j += LANES) {
        int first = j + LANES <= RESULTS || RESULTS < LANES ? j : RESULTS - LANES;
        lanes x[LANES] = {};
        for (int i = 0; i < LANES && first + i < RESULTS; i++) x[i] = results[first + i];
        transpose(x);
        for (int k = 0; k < LANES; k++) *(anywhere *)(to + k * RESULTS + first) = x[k];
    }
}

INLINE lanes polynomial(lanes z, const double *coefficients, int count) {
    lanes value = in_all_lanes(coefficients[count - 1]);
    for (int i = count - 2; i >= 0; i--) value = value * z + coefficients[i];
    return value;
}

// Cody and Waite's reduction and fdlibm's polynomials, as in urdfkin/compiled/machine/sine.py.
// Unlike sine.py, the function does not correct the last digit.
INLINE void sine_cosine(lanes x, lanes *sine, lanes *cosine) {
    const double no_fraction = 0x1.8p52, pi_2 = 0x1.921fb54442d18p0;
    lanes shifted = x * (1 / pi_2) + no_fraction, n = shifted - no_fraction;
    lanes r = n * -PI_2_REST + (n * -pi_2 + x), z = r * r;
    lanes s = r * z * polynomial(z, (const double[]){SINE}, 6) + r;
    lanes c = 1.0 + (z * z * polynomial(z, (const double[]){COSINE}, 6) - 0.5 * z);
    whole quarters = (whole)shifted, odd = -(quarters & 1);
    whole first = ((whole)c & odd) | ((whole)s & ~odd), second = ((whole)s & odd) | ((whole)c & ~odd);
    *sine = (lanes)(first ^ ((quarters & 2) << 62));
    *cosine = (lanes)(second ^ (((quarters + 1) & 2) << 62));
}

INLINE void block(const double *q, const double *v, const double *a, double *out) {
    lanes x[STEPS], sine[STEPS], cosine[STEPS], rate[STEPS], rate_2[STEPS], results[RESULTS];
    read(q, NQ, Q_AT, x);
    if (MOVING) read(v, NV, V_AT, rate), read(a, NV, V_AT, rate_2);
#pragma GCC unroll 64
    for (int i = 0; i < STEPS; i++)
        if (TURNS[i]) sine_cosine(x[i], sine + i, cosine + i);
    const lanes *arguments[] = {x, sine, cosine, rate, rate_2};
    lanes *place = results;
    casadi_f0(arguments, &place, 0, 0, 0);
    write(results, out);
}

// Compute the last configurations (fewer than LANES) in a copy.
// The loop thus reads and writes nothing beyond the end of the arrays.
static void few(long n, const double *q, const double *v, const double *a, double *out) {
    double own_q[LANES * NQ + 8] = {}, own_v[LANES * NV + 8] = {}, own_a[LANES * NV + 8] = {}, own[LANES * RESULTS + 8];
    memcpy(own_q, q, n * NQ * sizeof *q);
    if (MOVING) memcpy(own_v, v, n * NV * sizeof *v), memcpy(own_a, a, n * NV * sizeof *a);
    block(own_q, own_v, own_a, own);
    memcpy(out, own, n * RESULTS * sizeof *out);
}

void compute(long n, const double *q, const double *v, const double *a, double *out) {
    for (; n > LANES; n -= LANES, q += LANES * NQ, v += LANES * NV, a += LANES * NV, out += LANES * RESULTS) block(q, v, a, out);
    few(n, q, v, a, out);
}
