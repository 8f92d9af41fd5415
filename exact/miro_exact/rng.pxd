cimport cython

ctypedef unsigned long long u64_t
ctypedef (u64_t, u64_t, u64_t, u64_t) words_t

cdef u64_t _WORD, _M0, _M1, _W0, _W1, _PAIRS, _BITS, _GAUSS, _NO_BLOCK
cdef long long _INDICES
cdef u64_t[::1] _TABLE


cpdef words_t philox4x32(u64_t c0, u64_t c1, u64_t c2, u64_t c3, u64_t k0, u64_t k1) noexcept


@cython.final
cdef class Stream:
    cdef readonly object seed
    cdef readonly str name
    cdef u64_t k0, k1, name0, name1, block
    cdef u64_t words[4]
    cdef long long group
    cdef unsigned int draws[16]
    cdef unsigned int least

    cdef void load(self, u64_t block) noexcept
    @cython.locals(four='unsigned int[16]', at='long long', lane=int)
    cdef void blocks(self, u64_t first, int count, unsigned int *words) noexcept
    @cython.locals(m0=u64_t, m1=u64_t, mask=u64_t, lane=int, _=int, k0='unsigned int', k1='unsigned int')
    cdef void _four_blocks(self, u64_t first, unsigned int *four) noexcept
    cdef void _load_draws(self, long long group) noexcept
    cpdef u64_t u32(self, long long index) except? 1
    cpdef bint below(self, long long index, u64_t threshold) except? -1
    cpdef u64_t next_below(self, long long index, long long end, u64_t threshold) except? 1
    cpdef u64_t u64(self, long long index) except? 1
    cdef u64_t pair(self, u64_t kind, long long index) except? 1
    cpdef int bit(self, long long index) except -1
    cpdef u64_t bits(self, long long index) except? 1
    cpdef double uniform(self, long long index) except? -1.0
    cpdef double gauss(self, long long index) except? -1000.0
