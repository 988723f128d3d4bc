    { /* Each vector alone, and all vectors repeated in a batch that does not fill the last register. */
        enum { N = 3 * LANES + 3 };
        static real @arrays@, all[N][@count@];
        real one[@count@];
        double worst = 0.0;
        for (int k = 0; k < N; ++k) {
@fill@
        }
        @title@_@name@_batch(N, @all@, &all[0][0]);
        for (int k = 0; k < N; ++k) {
            const double *right = true_@name@[k % @n@], *within = BOUND(@name@)[k % @n@];
            @title@_@name@(@each@, one);
            worst = larger(worst, share(@count@, one, right, within));
            worst = larger(worst, share(@count@, all[k], right, within));
        }
        wrong |= report("@name@", @n@, worst);
    }
