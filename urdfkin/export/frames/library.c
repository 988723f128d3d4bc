#include <stdint.h>
#ifdef __SSE2__
#include <immintrin.h>
#endif

/* For urdfkin itself: where q, v, a and the results lie, how many there are, and where a block's results come
   together on their way past the caches (0: they go at once), stand in a row of whole numbers. 0, or 1 where an
   input is not finite. */

/* What one register holds, and how it goes past the caches. */
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

/* Of so many times LANES numbers: 0 x is 0, or no number. Four sums, of which none waits for another. It brings
   near what is computed with next. */
#define SUMS 4
typedef double numbers __attribute__((vector_size(PIECE * sizeof(double)), aligned(sizeof(double)), may_alias));
INLINE void look(size_t count, const double *x, numbers *bad)
{
    const numbers *at = (const numbers *)x;
    count *= LANES / PIECE;
    for (size_t i = 0; i < count / SUMS; ++i, at += SUMS)
        for (int k = 0; k < SUMS; ++k) bad[k] += 0.0 * at[k];
    for (size_t k = 0; k < count % SUMS; ++k) bad[k] += 0.0 * at[k];
}

/* A line that is written whole is not read before. */
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

/* One configuration in every lane: the same machine code as a batch's, and so the same bits. */
static void one(@given@, double *out)
{
    ALIGNED double in[@room@ * LANES];
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
    for (; n > LANES + @spare@; n -= LANES, @advance@, out += LANES * @count@) {
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
