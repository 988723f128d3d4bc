
/* Sine and cosine of an angle in each lane: Cody and Waite's reduction to [-pi/4, pi/4], the polynomials of
   fdlibm (Sun Microsystems, k_sin.c and k_cos.c), then the quarter turns. No branch, so that a compiler can do
   it for all lanes at once; a lane whose angle is FAR takes the library's functions. None is where the sum of
   the squares is small. */
#define IS_SINGLE (sizeof(real) == sizeof(float))
#define FAR (IS_SINGLE ? R(8192.0) : R(823549.0))
INLINE void sine_cosine(const real *x, real *sine, real *cosine, real *squares)
{
    /* Added to a number, it leaves no room for a fraction. pi/2 in three parts, of which n times the first two
       is exact. */
    const real whole = IS_SINGLE ? R(12582912.0) : R(6755399441055744.0);
    const real p1 = IS_SINGLE ? R(1.5703125) : R(1.57079632673412561417e+00);
    const real p2 = IS_SINGLE ? R(4.837512969970703125e-4) : R(6.07710050630396597660e-11);
    const real p3 = IS_SINGLE ? R(7.54978995489188216e-8) : R(2.02226624879595063154e-21);
    for (int k = 0; k < LANES; ++k) {
        const real n = (x[k] * R(0.636619772367581382) + whole) - whole;
        const real r = ((x[k] - n * p1) - n * p2) - n * p3, z = r * r;
        const real s = r + r * z * (R(-1.66666666666666324348e-01) + z * (R(8.33333333332248946124e-03)
            + z * (R(-1.98412698298579493134e-04) + z * (R(2.75573137070700676789e-06)
            + z * (R(-2.50507602534068634195e-08) + z * R(1.58969099521155010221e-10))))));
        const real c = R(1.0) + z * (R(-0.5) + z * (R(4.16666666666666019037e-02)
            + z * (R(-1.38888888888741095749e-03) + z * (R(2.48015872894767294178e-05)
            + z * (R(-2.75573143513906633035e-07) + z * (R(2.08757232129817482790e-09)
            + z * R(-1.13596475577881948265e-11)))))));
        /* m = n modulo 4, from -2 to 2: the cosine of m quarter turns is 1 - |m|, the sine m (2 - |m|). */
        const real m = n - R(4.0) * ((n * R(0.25) + whole) - whole), size = fabs(m);
        const real turn_c = R(1.0) - size, turn_s = m * (R(2.0) - size);
        sine[k] = s * turn_c + c * turn_s;
        cosine[k] = c * turn_c - s * turn_s;
        squares[k] += x[k] * x[k];
    }
}

INLINE int any_far(const real *squares)
{
    long far = 0;
    for (int k = 0; k < LANES; ++k) far |= !(squares[k] < FAR * FAR);
    return far != 0;
}

INLINE void library_sines(const real *x, real *sine, real *cosine)
{
    for (int k = 0; k < LANES; ++k)
        if (fabs(x[k]) >= FAR) {
            sine[k] = sin(x[k]);
            cosine[k] = cos(x[k]);
        }
}
