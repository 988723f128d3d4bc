#include <stdint.h>
#ifdef __AVX512F__
#include <immintrin.h>
#endif

/* For urdfkin itself: where q, v, a and the results lie, how many there are, and where a block's results come
   together on their way past the caches (0: they go at once), stand in a row of whole numbers. 0, or 1 where an
   input is not finite. */

/* Of so many numbers in each lane: 0 x is 0, or no number. It brings near what is computed with next. */
INLINE void look(size_t blocks, const double *x, double *bad)
{
    for (size_t i = 0; i < blocks * LANES; i += LANES)
        for (int k = 0; k < LANES; ++k) bad[k] += R(0.0) * x[i + k];
}

/* Past the caches: a line that is written whole is not read before. */
INLINE void stream(const double *x, size_t count, double *out)
{
    size_t i = 0;
#ifdef __AVX512F__
    for (; i < count && (uintptr_t)(out + i) % 64; ++i) out[i] = x[i];
    for (; i + 8 <= count; i += 8) _mm512_stream_pd(out + i, _mm512_loadu_pd(x + i));
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
    double bad[LANES] = {0.0};
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
#ifdef __AVX512F__
    _mm_sfence();
#endif
    int64_t found = 0;
    for (int k = 0; k < LANES; ++k) found |= bad[k] != 0.0;
    return found;
}
