
/* ---- @name@: @operations@ operations ---- */

/* Results from inputs, angles, sines and cosines, which are L apart in memory. */
INLINE void line_@name@(const real *in, real *out, const size_t L)
{
    (void)in;
    (void)L;
@lines@
}

void @title@_@name@(@parameters@)
{
    real in[@size@] = {@inputs@};
@unused@
@sines@
    line_@name@(in, out, 1);
}

/* Results of LANES configurations from their inputs, which are before the sines. */
static void all_lanes_@name@(real *restrict in, real *restrict results)
{
@lane_sines@
    for (int k = 0; k < LANES; ++k)
        line_@name@(in + k, results + k, (size_t)LANES);
}

static void lanes_@name@(@parameters@)
{
    ALIGNED real in[@size@ * LANES];
    ALIGNED real results[@count@ * LANES];
@reads@
    all_lanes_@name@(in, results);
    write_rows(results, @count@, out);
}

void @title@_@name@_batch(size_t n, @parameters@)
{
    /* The last rows are computed in copies, so that no memory beyond an array's end is read or written. */
    for (; n > LANES + @reserve@; n -= LANES, @advance@, out += LANES * @count@)
        lanes_@name@(@passed@, out);
    while (n) {
        const size_t m = n < LANES ? n : LANES;
        real @copies@, own[LANES * @count@ + 8];
@copy@
        lanes_@name@(@own@, own);
        for (size_t i = 0; i < m * @count@; ++i) out[i] = own[i];
        n -= m;
@advance_m@
        out += m * @count@;
    }
}
