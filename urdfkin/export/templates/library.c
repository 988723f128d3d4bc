#include <stdint.h>
#ifdef __SSE2__
#include <immintrin.h>
#endif

/* The entry point for urdfkin. Its argument is an array of integers: the number of configurations, the addresses
   of q, v, a and the results, and the address of a buffer. The buffer collects the results of a block before they
   are written past the caches (0: write them directly). It returns 0, or 1 if an input is not finite or is too large:
   a result can then overflow. */

/* Numbers in a register, and the instructions that load it and write it past the caches. */
#if defined(__AVX512F__)
#define PIECE 8
#define LOAD _mm512_loadu_pd
#define STREAM _mm512_stream_pd
#elif defined(__AVX__)
#define PIECE 4
#define LOAD _mm256_loadu_pd
#define STREAM _mm256_stream_pd
#else
#define PIECE 2
#define LOAD _mm_loadu_pd
#define STREAM _mm_stream_pd
#endif

/* A number x is too large if GROWTH x overflows. */
#define GROWTH @growth@

/* Check count * LANES numbers: 0 (GROWTH x) is 0, or NaN if x is not finite or too large. The four sums are
   independent, so they run in parallel. The check also loads the inputs of this block into the cache, and requests
   the bytes that are AHEAD of them. A processor that waits for the memory at each block takes up to half as long
   again for a robot with many joints off the path. */
#define SUMS 4
#define AHEAD 4096
#define LINE 64
typedef double numbers __attribute__((vector_size(PIECE * sizeof(double)), aligned(sizeof(double)), may_alias));
INLINE void look(size_t count, const double *x, numbers *bad)
{
    const numbers *at = (const numbers *)x;
    count *= LANES / PIECE;
    for (size_t i = 0; i < count / SUMS; ++i, at += SUMS) {
        for (size_t to = 0; to < SUMS * sizeof *at; to += LINE)
            __builtin_prefetch((const void *)((uintptr_t)at + AHEAD + to));
        for (int k = 0; k < SUMS; ++k) bad[k] += 0.0 * (GROWTH * at[k]);
    }
    for (size_t k = 0; k < count % SUMS; ++k) bad[k] += 0.0 * (GROWTH * at[k]);
}

/* Write whole cache lines, which the processor then does not read first. */
INLINE void stream(const double *x, size_t count, double *out)
{
    size_t i = 0;
#ifdef __SSE2__
    for (; i < count && (uintptr_t)(out + i) % 64; ++i) out[i] = x[i];
    for (; i + 8 <= count; i += 8)
        for (size_t k = i; k < i + 8; k += PIECE) STREAM(out + k, LOAD(x + k));
#endif
    for (; i < count; ++i) out[i] = x[i];
}

/* One configuration in every lane, with the machine code of a batch, so that the bits are equal. */
static void one(@inputs_of_one@, double *out)
{
    ALIGNED double in[@size@ * LANES];
    ALIGNED double results[@count@ * LANES];
@spread@
    all_lanes_@name@(in, results);
    for (int i = 0; i < @count@; ++i) out[i] = results[i * LANES];
}

int64_t task(const int64_t *places)
{
    size_t n = (size_t)places[@N@];
    double *out = (double *)(uintptr_t)places[@OUT@], *stage = (double *)(uintptr_t)places[@STAGE@];
@inputs@
    numbers bad[SUMS] = {{0.0}};
    for (; n > LANES + @reserve@; n -= LANES, @advance@, out += LANES * @count@) {
@look@
        lanes_@name@(@passed@, stage ? stage : out);
        if (stage) stream(stage, LANES * @count@, out);
    }
@look_left@
    if (n == 1)
        one(@passed@, out);
    else
        @title@_@name@_batch(n, @passed@, out);
#ifdef __SSE2__
    _mm_sfence();
#endif
    int64_t found = 0;
    for (int i = 0; i < SUMS; ++i)
        for (int k = 0; k < PIECE; ++k) found |= bad[i][k] != 0.0;
    return found;
}
