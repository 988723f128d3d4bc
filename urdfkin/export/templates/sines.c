
/* Sine and cosine of `count` angles in each lane: Cody and Waite's reduction to [-pi/4, pi/4], the polynomials of
   fdlibm (Sun Microsystems, k_sin.c and k_cos.c), then the quarter turns. There is no branch, so a compiler can
   compute all lanes at once. A lane with an angle of FAR or more uses the library's functions. There is none if
   the sum of squares is below FAR squared. */
#define IS_SINGLE (sizeof(real) == sizeof(float))
#define FAR (IS_SINGLE ? R(8192.0) : R(823549.0))
INLINE int any_far(const real *x, const int count)
{
    real squares[LANES];
    for (int k = 0; k < LANES; ++k) {
        real sum = R(0.0);
        for (int i = k; i < count * LANES; i += LANES) sum += x[i] * x[i];
        squares[k] = sum;
    }
    long far = 0;
    for (int k = 0; k < LANES; ++k) far |= !(squares[k] < FAR * FAR);
    return far != 0;
}

SELDOM void library_sines(const real *x, real *sine, real *cosine, const int count)
{
    for (int k = 0; k < count * LANES; ++k)
        if (fabs(x[k]) >= FAR) {
            sine[k] = sin(x[k]);
            cosine[k] = cos(x[k]);
        }
}

INLINE void sines_cosines(const real *x, real *sine, real *cosine, const int count)
{
    /* Adding and subtracting `whole` rounds to an integer. p1, p2 and p3 are parts of pi/2; n p1 and n p2 are
       exact. */
    const real whole = IS_SINGLE ? R(12582912.0) : R(6755399441055744.0);
    const real p1 = IS_SINGLE ? R(1.5703125) : R(1.57079632673412561417e+00);
    const real p2 = IS_SINGLE ? R(4.837512969970703125e-4) : R(6.07710050630396597660e-11);
    const real p3 = IS_SINGLE ? R(7.54978995489188216e-8) : R(2.02226624879595063154e-21);
    /* The reduced angle, and n modulo 4, from -2 to 2. */
    for (int k = 0; k < count * LANES; ++k) {
        const real n = (x[k] * R(0.636619772367581382) + whole) - whole;
        sine[k] = ((x[k] - n * p1) - n * p2) - n * p3;
        cosine[k] = n - R(4.0) * ((n * R(0.25) + whole) - whole);
    }
    for (int k = 0; k < count * LANES; ++k) {
        const real r = sine[k], m = cosine[k], z = r * r, size = fabs(m);
        const real s = r + r * z * (R(-1.66666666666666324348e-01) + z * (R(8.33333333332248946124e-03)
            + z * (R(-1.98412698298579493134e-04) + z * (R(2.75573137070700676789e-06)
            + z * (R(-2.50507602534068634195e-08) + z * R(1.58969099521155010221e-10))))));
        const real c = R(1.0) + z * (R(-0.5) + z * (R(4.16666666666666019037e-02)
            + z * (R(-1.38888888888741095749e-03) + z * (R(2.48015872894767294178e-05)
            + z * (R(-2.75573143513906633035e-07) + z * (R(2.08757232129817482790e-09)
            + z * R(-1.13596475577881948265e-11)))))));
        /* The cosine of m quarter turns is 1 - |m|, the sine m (2 - |m|). */
        const real turn_c = R(1.0) - size, turn_s = m * (R(2.0) - size);
        sine[k] = s * turn_c + c * turn_s;
        cosine[k] = c * turn_c - s * turn_s;
    }
    if (any_far(x, count)) library_sines(x, sine, cosine, count);
}
