cimport cython
from miro_exact cimport dmath, rng

cdef long long _MASK, _FRAME_BLOCKS, _LINE_BLOCKS, _FULL
cdef int _BITS, _WIDTH, _GREY, _PAD


@cython.final
cdef class Sensor:
    cdef readonly object settings
    cdef readonly rng.Stream stream
    cdef long long frame, offset, jitter
    cdef int scale
    cdef readonly int reach, side
    cdef int shift, half
    cdef int taps[9]
    cdef short gamma[4096]
    cdef short luma_noise[4096]
    cdef short chroma_noise[4096]
    cdef unsigned short y[352]
    cdef unsigned short cb[352]
    cdef unsigned short cr[352]
    cdef unsigned short soft_cb[352]
    cdef unsigned short soft_cr[352]
    cdef unsigned int words[448]
    cdef int sums[16]

    cpdef begin(self, long long frame, long long tick, int samples)
    @cython.locals(red=int, green=int, blue=int)
    cdef void put(self, int column, long long total, long long light) noexcept
    @cython.locals(value='long long')
    cdef int _shown(self, long long total, long long light) noexcept
    @cython.locals(first='long long', column=int, part=int, block=int, word='unsigned int', last='unsigned int')
    cdef void write(self, int row, int left, int width, unsigned char[::1] out, int at) noexcept
    @cython.locals(first='long long', lane='long long', step='long long', sums='int *', tap=short, bend=short)
    cdef void _soften(self, unsigned short* values, unsigned short* soft, long long left, long long width) noexcept
    cdef inline int _byte(self, int value) noexcept
    @cython.locals(first='long long', word='unsigned long long', by='long long', begin=int, last=int)
    cdef void _shake(self, int row, int left, int width) noexcept
    @cython.locals(column=int, after=int, before=int)
    cdef void _move(self, unsigned short* values, int first, int last, long long by) noexcept
