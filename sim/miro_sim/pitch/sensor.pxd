cimport cython
from miro_exact cimport dmath, rng

cdef long long _MASK, _FRAME_BLOCKS, _LINE_BLOCKS, _FULL
cdef int _BITS, _WIDTH, _GREY


@cython.final
cdef class Sensor:
    cdef readonly object settings
    cdef readonly rng.Stream stream
    cdef long long frame, offset, jitter
    cdef int scale
    cdef readonly int reach, side
    cdef int shift, half
    cdef int taps[9]
    cdef int gamma[4096]
    cdef int luma_noise[4096]
    cdef int chroma_noise[4096]
    cdef int y[320]
    cdef int cb[320]
    cdef int cr[320]
    cdef int soft_cb[320]
    cdef int soft_cr[320]

    cpdef begin(self, long long frame, long long tick, int samples)
    @cython.locals(red=int, green=int, blue=int)
    cdef void put(self, int column, long long total, long long light) noexcept
    @cython.locals(value='long long')
    cdef int _shown(self, long long total, long long light) noexcept
    @cython.locals(first='long long', column=int, part=int, word='unsigned int', last='unsigned int', y=int, cb=int, cr=int)
    cdef void write(self, int row, int left, int width, unsigned char[::1] out, int at) noexcept
    @cython.locals(inner='long long', inner_end='long long', end='long long', column='long long', total=int,
                   step='long long')
    cdef void _soften(self, int* values, int* soft, long long left, long long width) noexcept
    @cython.locals(total=int, step=int, low=int, high=int)
    cdef int _at_border(self, int* values, int column) noexcept
    cdef int _byte(self, int value) noexcept
    @cython.locals(first='long long', word='unsigned long long', by='long long', begin=int, last=int)
    cdef void _shake(self, int row, int left, int width) noexcept
    @cython.locals(column=int, after=int, before=int)
    cdef void _move(self, int* values, int first, int last, long long by) noexcept
