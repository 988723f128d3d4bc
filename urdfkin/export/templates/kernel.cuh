
template <class T> __global__ void __launch_bounds__(THREADS) @name@_kernel(size_t n, @parameters@)
{
    __shared__ Tile<T> tiles[THREADS / WARP];
    Tile<T> &tile = tiles[threadIdx.x / WARP];
    size_t first = static_cast<size_t>(blockIdx.x) * THREADS + threadIdx.x / WARP * WARP;
    for (; first < n; first += static_cast<size_t>(gridDim.x) * THREADS) {
        const int count = n - first < WARP ? static_cast<int>(n - first) : static_cast<int>(WARP);
        T @own@, results[@count@];
@reads@
        @name@(@passed@, results);
        write_rows<@count@>(results, count, tile, out + first * @count@);
    }
}

/* Start the kernel for n configurations in the memory of the device. */
template <class T> cudaError_t @name@_batch(size_t n, @parameters@, cudaStream_t stream = 0)
{
    if (n == 0) return cudaSuccess;
    void *arguments[] = {&n, @addresses@, &out};
    return cudaLaunchKernel(&@name@_kernel<T>, dim3(blocks(n)), dim3(THREADS), arguments, 0, stream);
}
