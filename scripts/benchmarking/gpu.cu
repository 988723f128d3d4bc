/* The program of scripts/benchmark_gpu.py, which replaces the words between two @. */
#define @UP@_ENTRY_POINTS
#include "@file@"
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <vector>

static void check(cudaError_t error)
{
    if (error == cudaSuccess) return;
    std::fprintf(stderr, "CUDA: %s\n", cudaGetErrorString(error));
    std::exit(2);
}

/* The median time of a launch, in seconds. */
template <class Launch> double seconds(Launch launch)
{
    cudaEvent_t start, end;
    check(cudaEventCreate(&start)), check(cudaEventCreate(&end));
    std::vector<float> times;
    for (int k = 0; k < @launches@ + 3; ++k) { /* three launches to warm up */
        check(cudaEventRecord(start)), check(launch()), check(cudaEventRecord(end));
        check(cudaEventSynchronize(end));
        float time = 0.0f;
        check(cudaEventElapsedTime(&time, start, end));
        if (k >= 3) times.push_back(time);
    }
    check(cudaEventDestroy(start)), check(cudaEventDestroy(end));
    std::sort(times.begin(), times.end());
    return 1e-3 * times[times.size() / 2];
}

template <class T> T *filled(size_t count)
{
    std::vector<T> numbers(count);
    for (size_t i = 0; i < count; ++i) numbers[i] = static_cast<T>(0.001 * static_cast<double>(i % 3001));
    T *at = NULL;
    check(cudaMalloc(reinterpret_cast<void **>(&at), (count ? count : 1) * sizeof(T)));
    check(cudaMemcpy(at, numbers.data(), count * sizeof(T), cudaMemcpyHostToDevice));
    return at;
}

template <class T> void measure(const char *real, size_t n)
{
    T *q = filled<T>(n * @nq@), *v = filled<T>(n * @nv@), *a = filled<T>(n * @nv@);
    T *out = filled<T>(n * @most@);
    (void)v, (void)a;
@measured@
    check(cudaFree(q)), check(cudaFree(v)), check(cudaFree(a)), check(cudaFree(out));
}

int main()
{
    const size_t sizes[] = {@sizes@}, bytes = static_cast<size_t>(1) << 28;
    char *from = filled<char>(bytes), *to = filled<char>(bytes);
    const double copy = seconds([&] { return cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToDevice); });
    std::printf("{\"bandwidth\": %.6g}\n", 2.0 * static_cast<double>(bytes) / copy);
    check(cudaFree(from)), check(cudaFree(to));
    for (size_t n : sizes) measure<double>("double", n), measure<float>("float", n);
}
