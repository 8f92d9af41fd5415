cimport cython

from miro_robot.mcs51.bus cimport Bus

cdef int _SPREAD_FROM, _SPREAD_TO, _DEPTH

cdef class Core:
    cdef readonly Bus bus
    cdef unsigned char rom[65538]
    cdef unsigned int lines[65536]
    cdef unsigned short line_of[256]
    cdef unsigned char iram[256]
    cdef public int pc, a, b, sp, dptr, cy, ac, ov, user_flags, bank
    cdef readonly long long cycles, start, at
    cdef long long limit, until
    cdef int stop
    cdef readonly long long instructions, idle_cycles, faults
    cdef unsigned char[::1] edges
    cdef int edge_mask, edge_before
    cdef int edge_outer[8]
    cdef int edge_depth
    cdef public int highest_sp
    cdef readonly int stack_floor, stack_end

    cpdef begin_edges(self)
    @cython.final
    @cython.locals(place='unsigned int')
    cdef void count_edge(self, int target) noexcept
    @cython.final
    cdef void enter_edges(self) noexcept
    @cython.final
    cdef void leave_edges(self) noexcept

    @cython.locals(line='unsigned int')
    cdef unsigned int line_at(self, int address) noexcept
    cdef int begin_run(self) except -1
    cdef int end_run(self) except -1
    cdef int boundary(self) except -1
    cdef int end_of_interrupt(self) except -1
    cdef int read_sfr(self, int address) except -1
    cdef int read_latch(self, int address) except -1
    cdef int write_sfr(self, int address, int value) except -1
    cdef int write_sfr_bit(self, int address, int mask, int level) except -1
    cdef int page(self) noexcept
    cdef int movx_read(self, int address) except -1
    cdef int movx_write(self, int address, int value) except -1
