
/* The tolerances of a function's test vectors in the precision of this program. */
#define BOUND(name) (sizeof(real) == sizeof(float) ? single_##name : within_##name)

/* NaN counts as larger than any number, also if a number follows it. */
static double larger(double x, double y) { return x != x || y <= x ? x : y; }

/* The largest error as a share of its bound. */
static double share(int n, const real *found, const double *right, const double *within)
{
    const double eps = sizeof(real) == sizeof(float) ? (double)FLT_EPSILON : DBL_EPSILON;
    double worst = 0.0;
    for (int i = 0; i < n; ++i) {
        const double error = fabs((double)found[i] - right[i]);
        worst = larger(worst, within[i] > 0.0 ? error / (within[i] * eps) : error <= 0.0 ? 0.0 : HUGE_VAL);
    }
    return worst;
}

static int report(const char *name, int n, double worst)
{
    const int good = worst <= 1.0;
    const char *const word = good ? "good" : "WRONG";
    printf("%s %s: %d test vectors, worst error %.3g of the bound\n", word, name, n, worst);
    return !good;
}

int main(void)
{
    int wrong = 0;
@checks@
    return wrong;
}
