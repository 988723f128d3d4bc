#include <stdint.h>

/* For urdfkin itself: where q, v, a and the results lie, and how many there are, stand in a row of whole
   numbers. 0, or 1 where an input is not finite. A part is looked at and computed while it is in a cache. */
static int not_finite(size_t n, const double *x)
{
    int64_t bad = 0;
    for (size_t i = 0; i < n; ++i) bad |= !(fabs(x[i]) <= DBL_MAX);
    return bad != 0;
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
    double *out = (double *)(uintptr_t)places[@OUT@];
@inputs@
    int bad = 0;
    while (n) {
        const size_t m = n < 2048 ? n : 2048;
@look@
        if (m == 1)
            one(@passed@, out);
        else
            @title@_@name@_batch(m, @passed@, out);
        n -= m;
        out += m * @count@;
@advance@
    }
    return bad;
}
