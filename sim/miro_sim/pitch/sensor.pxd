cimport cython
from miro_exact cimport rng
from miro_exact.dmath cimport sincos

cdef long long _MASK, _FRAME_BLOCKS, _LINE_BLOCKS, _FULL, _TICKS
cdef int _BITS, _WIDTH, _GREY, _PAD, _ABOVE


@cython.final
cdef class Sensor:
    cdef readonly object settings
    cdef readonly rng.Stream stream
    cdef long long frame, offset, jitter
    cdef int scale
    cdef readonly int reach, side
    cdef bytes levels
    cdef short taps[72]
    cdef short gamma[4096]
    cdef short luma_noise[4096]
    cdef short chroma_noise[4096]
    cdef short y[352]
    cdef short cb[352]
    cdef short cr[352]
    cdef short soft_cb[352]
    cdef short soft_cr[352]
    cdef unsigned int words[448]

    cpdef begin(self, long long frame, long long tick, int samples)
    @cython.locals(twice_hz='long long', turns=double, mean=double)
    cdef double _lamps(self, long long tick) except? -1.0
    cdef void put(self, int column, long long total, long long light) noexcept
    cdef int _shown(self, long long total, long long light) noexcept
    cdef void write(self, int row, int left, int width, bytearray out, int at) except *
    @cython.locals(levels='const unsigned char *', words='unsigned int *', part=int)
    cdef void _quantise(self, long long first, long long end, long long blocks, unsigned char* out,
                        long long at) noexcept
    cdef inline void _write_pixel(self, const unsigned char* levels, long long column, unsigned int word,
                                  unsigned int last, unsigned char* out, long long at) noexcept
    @cython.locals(lane='long long', step='long long', sums='int[8]', bend=short)
    cdef void _soften(self, short* values, short* soft, long long left, long long width) noexcept
    @cython.locals(word='unsigned long long', by='long long', begin=int, last=int)
    cdef void _shake(self, int row, int left, int width) noexcept
    cdef void _move(self, short* values, int first, int last, long long by) noexcept
