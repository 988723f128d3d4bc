@head@
#ifndef @UP@_CUH
#define @UP@_CUH
#include <stddef.h>

/* C entry points, compiled where @UP@_ENTRY_POINTS is defined. They start a kernel on a stream (NULL: the default
   stream) for n configurations in the memory of the device, row after row, and return a cudaError_t. */
#ifdef __cplusplus
extern "C" {
#endif
struct CUstream_st;
@declarations@
#ifdef __cplusplus
}
#endif

#ifndef @UP@_DECLARATIONS
#include <cmath>
#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__)
#error "-ffast-math reorders sums and rounds sines more; the error bounds of this file do not allow for it"
#endif
#ifdef __CUDACC__
#include <cuda_runtime.h>
#define @UP@_BOTH __host__ __device__
#else
#define @UP@_BOTH
#endif

namespace @title@_kinematics {
@functions@
#ifdef __CUDACC__

/* Threads of a block and of a warp; numbers of a row that a warp moves at once. */
enum { THREADS = 128, WARP = 32, PIECE = 16 };
/* Largest number of blocks; a thread computes several configurations if there are more. */
const size_t MOST_BLOCKS = 1u << 20;

/* Shared memory of a warp. The additional column avoids conflicts of memory banks. */
template <class T> struct Tile {
    T row[WARP][PIECE + 1];
};

/* Read `count` rows of WIDTH numbers. Neighbouring threads read neighbouring numbers into shared memory; each
   thread then takes its own row. */
template <int WIDTH, class T> __device__ void read_rows(const T *rows, int count, Tile<T> &tile, T *own)
{
    const int lane = static_cast<int>(threadIdx.x) % WARP;
#pragma unroll
    for (int first = 0; first < WIDTH; first += PIECE) {
        const int piece = WIDTH - first < PIECE ? WIDTH - first : PIECE;
        for (int i = lane; i < count * piece; i += WARP)
            tile.row[i / piece][i % piece] = rows[static_cast<size_t>(i / piece) * WIDTH + first + i % piece];
        __syncwarp();
#pragma unroll
        for (int k = 0; k < PIECE; ++k)
            if (k < piece) own[first + k] = lane < count ? tile.row[lane][k] : T(0.0);
        __syncwarp();
    }
}

/* Write `count` rows of WIDTH numbers, in the same way. */
template <int WIDTH, class T> __device__ void write_rows(const T *own, int count, Tile<T> &tile, T *rows)
{
    const int lane = static_cast<int>(threadIdx.x) % WARP;
#pragma unroll
    for (int first = 0; first < WIDTH; first += PIECE) {
        const int piece = WIDTH - first < PIECE ? WIDTH - first : PIECE;
#pragma unroll
        for (int k = 0; k < PIECE; ++k)
            if (k < piece) tile.row[lane][k] = own[first + k];
        __syncwarp();
        for (int i = lane; i < count * piece; i += WARP)
            rows[static_cast<size_t>(i / piece) * WIDTH + first + i % piece] = tile.row[i / piece][i % piece];
        __syncwarp();
    }
}

inline unsigned blocks(size_t n)
{
    const size_t needed = n / THREADS + (n % THREADS != 0);
    return static_cast<unsigned>(needed < MOST_BLOCKS ? needed : MOST_BLOCKS);
}
@kernels@
#endif
} // namespace @title@_kinematics

#if defined(__CUDACC__) && (defined(@UP@_ENTRY_POINTS) || defined(@UP@_MAIN))
extern "C" {
@entries@
}
#endif

#ifdef @UP@_MAIN
@start@
#ifdef __CUDACC__
#define @UP@_PASTE(name, type) name##_##type
#define @UP@_CALL(name, type) @UP@_PASTE(name, type)
static bool has_gpu()
{
    int count = 0;
    if (cudaGetDeviceCount(&count) == cudaSuccess && count > 0) return true;
    cudaGetLastError();
    return false;
}

/* An array in the memory of the device. */
struct OnDevice {
    real *at;
    explicit OnDevice(size_t bytes) : at(NULL) { cudaMalloc(reinterpret_cast<void **>(&at), bytes ? bytes : 1); }
    OnDevice(const real *from, size_t bytes) : at(NULL)
    {
        cudaMalloc(reinterpret_cast<void **>(&at), bytes ? bytes : 1);
        cudaMemcpy(at, from, bytes, cudaMemcpyHostToDevice);
    }
    ~OnDevice() { cudaFree(at); }
};
#endif
@main@
#endif
#endif
#endif
