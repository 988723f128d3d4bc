/* Kernels of CUDA on the processor, to test which memory they read and write without a GPU. A block's threads are
   threads of the host, and the threads of a warp wait for each other. */
#pragma once
#include <barrier>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#define __host__
#define __device__
#define __global__
#define __launch_bounds__(threads)
#define __shared__ static /* blocks run one after the other */

struct dim3 {
    unsigned x;
    explicit dim3(unsigned count) : x(count) {}
};
typedef struct CUstream_st *cudaStream_t;
typedef int cudaError_t;
enum { cudaSuccess = 0, cudaMemcpyHostToDevice, cudaMemcpyDeviceToHost, cudaMemcpyDeviceToDevice };

inline thread_local dim3 threadIdx(0), blockIdx(0), gridDim(0);
inline thread_local std::barrier<> *own_warp = nullptr;
inline void __syncwarp() { own_warp->arrive_and_wait(); }

template <class... Given>
cudaError_t cudaLaunchKernel(void (*kernel)(Given...), dim3 grid, dim3 block, void **given, size_t, cudaStream_t)
{
    std::tuple<Given...> values;
    [&]<size_t... I>(std::index_sequence<I...>) {
        ((std::get<I>(values) = *static_cast<std::tuple_element_t<I, std::tuple<Given...>> *>(given[I])), ...);
    }(std::index_sequence_for<Given...>());
    for (unsigned b = 0; b < grid.x; ++b) {
        std::vector<std::unique_ptr<std::barrier<>>> warps;
        for (unsigned w = 0; w < block.x / 32; ++w) warps.push_back(std::make_unique<std::barrier<>>(32));
        std::vector<std::thread> threads;
        for (unsigned t = 0; t < block.x; ++t)
            threads.emplace_back([&, b, t] {
                threadIdx = dim3(t), blockIdx = dim3(b), gridDim = grid;
                own_warp = warps[t / 32].get();
                std::apply(kernel, values);
            });
        for (std::thread &thread : threads) thread.join();
    }
    return cudaSuccess;
}

/* A launch ends before the function that starts it returns. */
typedef std::chrono::steady_clock::time_point *cudaEvent_t;
inline cudaError_t cudaEventCreate(cudaEvent_t *at)
{
    return *at = new std::chrono::steady_clock::time_point, cudaSuccess;
}
inline cudaError_t cudaEventDestroy(cudaEvent_t at) { return delete at, cudaSuccess; }
inline cudaError_t cudaEventRecord(cudaEvent_t at) { return *at = std::chrono::steady_clock::now(), cudaSuccess; }
inline cudaError_t cudaEventSynchronize(cudaEvent_t) { return cudaSuccess; }
inline cudaError_t cudaEventElapsedTime(float *time, cudaEvent_t start, cudaEvent_t end)
{
    return *time = std::chrono::duration<float, std::milli>(*end - *start).count(), cudaSuccess;
}
inline const char *cudaGetErrorString(cudaError_t) { return "an error"; }

inline cudaError_t cudaGetDeviceCount(int *count) { return *count = 1, cudaSuccess; }
inline cudaError_t cudaGetLastError() { return cudaSuccess; }
inline cudaError_t cudaMalloc(void **at, size_t bytes) { return *at = std::malloc(bytes), cudaSuccess; }
inline cudaError_t cudaFree(void *at) { return std::free(at), cudaSuccess; }
inline cudaError_t cudaMemcpy(void *to, const void *from, size_t bytes, int)
{
    return std::memcpy(to, from, bytes), cudaSuccess;
}
inline cudaError_t cudaStreamCreate(cudaStream_t *stream) { return *stream = nullptr, cudaSuccess; }
inline cudaError_t cudaStreamSynchronize(cudaStream_t) { return cudaSuccess; }
inline cudaError_t cudaStreamDestroy(cudaStream_t) { return cudaSuccess; }
inline cudaError_t cudaMemcpyAsync(void *to, const void *from, size_t bytes, int kind)
{
    return cudaMemcpy(to, from, bytes, kind);
}
