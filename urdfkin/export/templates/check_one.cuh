#ifdef __CUDACC__
    if (has_gpu()) { /* All vectors repeated in a batch that does not fill the last warp. */
        enum { N = 3 * THREADS + 5 };
        static real @arrays@, all[N][@count@];
        double worst = 0.0;
        for (int k = 0; k < N; ++k) {
@fill@
        }
        cudaStream_t stream;
        bool failed = cudaStreamCreate(&stream) != cudaSuccess;
        {
            const OnDevice @on_device@, results(sizeof all);
            failed |= @UP@_CALL(@title@_@name@, @UP@_REAL)(N, @device@, results.at, stream) != cudaSuccess;
            failed |= cudaStreamSynchronize(stream) != cudaSuccess;
            failed |= cudaMemcpy(all, results.at, sizeof all, cudaMemcpyDeviceToHost) != cudaSuccess;
        }
        failed |= cudaStreamDestroy(stream) != cudaSuccess;
        for (int k = 0; k < N; ++k)
            worst = larger(worst, share(@count@, all[k], true_@name@[k % @n@], BOUND(@name@)[k % @n@]));
        wrong |= report("@name@ on the GPU", @n@, failed ? HUGE_VAL : worst);
    }
#endif
