cimport cython

cdef int _PIXELS


@cython.final
cdef class Regions:
    cdef readonly int width, height, runs, count
    cdef bytes table
    cdef int run_kind[4096]
    cdef int run_row[4096]
    cdef int run_start[4096]
    cdef int run_end[4096]
    cdef int parent[4096]
    cdef int label[4096]
    cdef int kind[4096]
    cdef int area[4096]
    cdef int left[4096]
    cdef int top[4096]
    cdef int right[4096]
    cdef int bottom[4096]
    cdef int sum_u[4096]
    cdef int sum_v[4096]
    cdef int touches[4096]

    cpdef int find(self, bytearray pixels, int width, int height) except -1
    cpdef object region(self, int index)
    cpdef (double, double) centroid(self, int index)
    @cython.locals(data='unsigned char *', table='unsigned char *', width='long long', at='long long',
                   runs='long long', column='long long', before=int, kind=int)
    cdef void find_runs(self, bytearray pixels) noexcept
    cdef void merge(self) noexcept
    cdef void join(self, int first, int other) noexcept
    cdef int root(self, int run) noexcept
    cdef void collect(self) noexcept
    cdef void add(self, int index, int run) noexcept
