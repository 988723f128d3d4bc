@head@

#include <stddef.h>
#ifndef @UP@_REAL
#define @UP@_REAL double
#endif
#ifdef __cplusplus
extern "C" {
#endif
@declarations@
#ifdef __cplusplus
}
#endif
#ifndef @UP@_DECLARATIONS
#include <float.h>
#include <tgmath.h>

#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__)
#error "-ffast-math takes apart the reduction of angles; -O3 -ffp-contract=fast -fno-math-errno is as fast"
#endif
#ifdef __GNUC__
#define INLINE static inline __attribute__((always_inline, unused))
#define SELDOM static __attribute__((noinline, cold, unused))
#define ALIGNED __attribute__((aligned(64)))
#else
#define INLINE static inline
#define SELDOM static
#define ALIGNED
#endif

typedef @UP@_REAL real;
#define R(x) ((real)(x))
/* Number of configurations that the batch form computes together. */
#define LANES 8

/* Transposition of eight numbers of eight rows in memory, and back. */
#if (defined(__clang__) || (defined(__GNUC__) && __GNUC__ >= 12)) && !defined(@UP@_PORTABLE)
#ifdef __AVX512F__
typedef real eight __attribute__((vector_size(8 * sizeof(real))));
typedef real anywhere __attribute__((vector_size(8 * sizeof(real)), aligned(sizeof(real)), may_alias));
INLINE void get(eight *x, const real *from) { *x = *(const anywhere *)from; }
INLINE void put(real *to, const eight *x) { *(anywhere *)to = *x; }
/* Exchange of single numbers, pairs and fours across the diagonal. */
INLINE void exchange_1(eight *x, eight *y)
{
    const eight one = *x, other = *y;
    *x = __builtin_shufflevector(one, other, 0, 8, 2, 10, 4, 12, 6, 14);
    *y = __builtin_shufflevector(one, other, 1, 9, 3, 11, 5, 13, 7, 15);
}
INLINE void exchange_2(eight *x, eight *y)
{
    const eight one = *x, other = *y;
    *x = __builtin_shufflevector(one, other, 0, 1, 8, 9, 4, 5, 12, 13);
    *y = __builtin_shufflevector(one, other, 2, 3, 10, 11, 6, 7, 14, 15);
}
INLINE void exchange_4(eight *x, eight *y)
{
    const eight one = *x, other = *y;
    *x = __builtin_shufflevector(one, other, 0, 1, 2, 3, 8, 9, 10, 11);
    *y = __builtin_shufflevector(one, other, 4, 5, 6, 7, 12, 13, 14, 15);
}
#else
/* For registers of at most four numbers, the exchange of fours only renames them. */
typedef real four __attribute__((vector_size(4 * sizeof(real))));
typedef real anywhere __attribute__((vector_size(4 * sizeof(real)), aligned(sizeof(real)), may_alias));
typedef struct { four half[2]; } eight;
INLINE void get(eight *x, const real *from)
{
    for (int h = 0; h < 2; ++h) x->half[h] = *(const anywhere *)(from + 4 * h);
}
INLINE void put(real *to, const eight *x)
{
    for (int h = 0; h < 2; ++h) *(anywhere *)(to + 4 * h) = x->half[h];
}
INLINE void exchange_1(eight *x, eight *y)
{
    for (int h = 0; h < 2; ++h) {
        const four one = x->half[h], other = y->half[h];
        x->half[h] = __builtin_shufflevector(one, other, 0, 4, 2, 6);
        y->half[h] = __builtin_shufflevector(one, other, 1, 5, 3, 7);
    }
}
INLINE void exchange_2(eight *x, eight *y)
{
    for (int h = 0; h < 2; ++h) {
        const four one = x->half[h], other = y->half[h];
        x->half[h] = __builtin_shufflevector(one, other, 0, 1, 4, 5);
        y->half[h] = __builtin_shufflevector(one, other, 2, 3, 6, 7);
    }
}
INLINE void exchange_4(eight *x, eight *y)
{
    const four low = y->half[0];
    y->half[0] = x->half[1];
    x->half[1] = low;
}
#endif
/* Compilers unroll these loops, so that x is in registers. */
INLINE void transpose(eight *x)
{
    for (int i = 0; i < 8; i += 2) exchange_1(x + i, x + i + 1);
    for (int i = 0; i < 8; i += 4)
        for (int k = i; k < i + 2; ++k) exchange_2(x + k, x + k + 2);
    for (int i = 0; i < 4; ++i) exchange_4(x + i, x + i + 4);
}
#else
typedef struct { real lane[8]; } eight;
INLINE void get(eight *x, const real *from)
{
    for (int i = 0; i < 8; ++i) x->lane[i] = from[i];
}
INLINE void put(real *to, const eight *x)
{
    for (int i = 0; i < 8; ++i) to[i] = x->lane[i];
}
INLINE void transpose(eight *x)
{
    for (int i = 0; i < 8; ++i)
        for (int k = 0; k < i; ++k) {
            const real one = x[i].lane[k];
            x[i].lane[k] = x[k].lane[i];
            x[k].lane[i] = one;
        }
}
#endif

/* Read eight columns of LANES rows of a width; this also reads numbers beyond the end of a short row. */
INLINE void columns(const real *rows, int width, eight *x)
{
    for (int k = 0; k < 8; ++k) get(x + k, rows + k * width);
    transpose(x);
}

/* Write row after row. In rows shorter than eight numbers, the next row overwrites the numbers beyond the end. */
INLINE void write_rows(const real *results, int count, real *out)
{
    for (int j = 0; j < count; j += 8) {
        const int first = j + 8 <= count || count < 8 ? j : count - 8;
        eight x[8];
        for (int i = 0; i < 8; ++i) get(x + i, results + (first + i < count ? first + i : first) * LANES);
        transpose(x);
        for (int k = 0; k < 8; ++k) put(out + k * count + first, x + k);
    }
}
@sines@
@functions@
#ifdef @UP@_MAIN
#include <stdio.h>
@main@
#endif
#endif
