    {
        double worst = 0.0;
        for (int k = 0; k < @n@; ++k) {
            real @each_array@, one[@count@];
@fill_one@
            @name@(@passed@, one);
            worst = larger(worst, share(@count@, one, true_@name@[k], BOUND(@name@)[k]));
        }
        wrong |= report("@name@", @n@, worst);
    }
