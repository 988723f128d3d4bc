// The frame around the straight-line code of one robot: from memory to registers, eight configurations at a
// time, and back. ROBOT is a file with that code and the robot's sizes.

#include <string.h>

typedef double v8 __attribute__((vector_size(64)));
typedef double anywhere __attribute__((vector_size(64), aligned(8)));
typedef long whole __attribute__((vector_size(64)));
#define INLINE static inline __attribute__((always_inline))

#define casadi_real v8
#define casadi_int long
INLINE v8 casadi_sq(v8 x) { return x * x; }
INLINE v8 in_all_lanes(double x) { return (v8){x, x, x, x, x, x, x, x}; }

#include ROBOT

INLINE void exchange_1(v8 *x, v8 *y) {
    v8 one = *x, other = *y;
    *x = __builtin_shufflevector(one, other, 0, 8, 2, 10, 4, 12, 6, 14);
    *y = __builtin_shufflevector(one, other, 1, 9, 3, 11, 5, 13, 7, 15);
}

INLINE void exchange_2(v8 *x, v8 *y) {
    v8 one = *x, other = *y;
    *x = __builtin_shufflevector(one, other, 0, 1, 8, 9, 4, 5, 12, 13);
    *y = __builtin_shufflevector(one, other, 2, 3, 10, 11, 6, 7, 14, 15);
}

INLINE void exchange_4(v8 *x, v8 *y) {
    v8 one = *x, other = *y;
    *x = __builtin_shufflevector(one, other, 0, 1, 2, 3, 8, 9, 10, 11);
    *y = __builtin_shufflevector(one, other, 4, 5, 6, 7, 12, 13, 14, 15);
}

// Loops that the compiler unrolls, so that x lies in registers.
INLINE void transpose(v8 x[8]) {
    for (int i = 0; i < 8; i += 2) exchange_1(x + i, x + i + 1);
    for (int i = 0; i < 8; i += 4)
        for (int k = i; k < i + 2; k++) exchange_2(x + k, x + k + 2);
    for (int i = 0; i < 4; i++) exchange_4(x + i, x + i + 4);
}

// The numbers that stand at the places `at` in each of eight rows. What lies beyond a row's end is read as well.
INLINE void read(const double *from, int width, const int *at, v8 *to) {
    for (int first = 0; first < width; first += 8) {
        int wanted = 0;
        for (int i = 0; i < STEPS; i++) wanted |= at[i] / 8 == first / 8;
        if (!wanted) continue;
        v8 x[8];
        for (int k = 0; k < 8; k++) x[k] = *(const anywhere *)(from + k * width + first);
        transpose(x);
        for (int i = 0; i < STEPS; i++)
            if (at[i] / 8 == first / 8) to[i] = x[at[i] % 8];
    }
}

// Row after row. Where a row is shorter than eight numbers, what is written beyond it is the next row's.
INLINE void write(const v8 *results, double *to) {
    for (int j = 0; j < RESULTS; j += 8) {
        int first = j + 8 <= RESULTS || RESULTS < 8 ? j : RESULTS - 8;
        v8 x[8] = {};
        for (int i = 0; i < 8 && first + i < RESULTS; i++) x[i] = results[first + i];
        transpose(x);
        for (int k = 0; k < 8; k++) *(anywhere *)(to + k * RESULTS + first) = x[k];
    }
}

INLINE v8 polynomial(v8 z, const double *coefficients, int count) {
    v8 value = in_all_lanes(coefficients[count - 1]);
    for (int i = count - 2; i >= 0; i--) value = value * z + coefficients[i];
    return value;
}

// Cody and Waite's reduction and fdlibm's polynomials, as in urdfkin/recursion/sine.py, without what that does
// to be right to the last digit.
INLINE void sine_cosine(v8 x, v8 *sine, v8 *cosine) {
    const double no_fraction = 0x1.8p52, pi_2 = 0x1.921fb54442d18p0;
    v8 shifted = x * (1 / pi_2) + no_fraction, n = shifted - no_fraction;
    v8 r = n * -PI_2_REST + (n * -pi_2 + x), z = r * r;
    v8 s = r * z * polynomial(z, (const double[]){SINE}, 6) + r;
    v8 c = 1.0 + (z * z * polynomial(z, (const double[]){COSINE}, 6) - 0.5 * z);
    whole quarters = (whole)shifted, odd = -(quarters & 1);
    whole first = ((whole)c & odd) | ((whole)s & ~odd), second = ((whole)s & odd) | ((whole)c & ~odd);
    *sine = (v8)(first ^ ((quarters & 2) << 62));
    *cosine = (v8)(second ^ (((quarters + 1) & 2) << 62));
}

INLINE void eight(const double *q, const double *v, const double *a, double *out) {
    v8 x[STEPS], sine[STEPS], cosine[STEPS], rate[STEPS], rate_2[STEPS], results[RESULTS];
    read(q, NQ, Q_AT, x);
    if (MOVING) read(v, NV, V_AT, rate), read(a, NV, V_AT, rate_2);
#pragma GCC unroll 64
    for (int i = 0; i < STEPS; i++)
        if (TURNS[i]) sine_cosine(x[i], sine + i, cosine + i);
    const v8 *arguments[] = {x, sine, cosine, rate, rate_2};
    v8 *place = results;
    casadi_f0(arguments, &place, 0, 0, 0);
    write(results, out);
}

// The last ones: eight rows of a copy, so that nothing beyond the end is read or written.
static void few(long n, const double *q, const double *v, const double *a, double *out) {
    double own_q[8 * NQ + 8] = {}, own_v[8 * NV + 8] = {}, own_a[8 * NV + 8] = {}, own[8 * RESULTS + 8];
    memcpy(own_q, q, n * NQ * sizeof *q);
    if (MOVING) memcpy(own_v, v, n * NV * sizeof *v), memcpy(own_a, a, n * NV * sizeof *a);
    eight(own_q, own_v, own_a, own);
    memcpy(out, own, n * RESULTS * sizeof *out);
}

void compute(long n, const double *q, const double *v, const double *a, double *out) {
    for (; n > 8; n -= 8, q += 8 * NQ, v += 8 * NV, a += 8 * NV, out += 8 * RESULTS) eight(q, v, a, out);
    few(n, q, v, a, out);
}
