cimport cython

from miro_robot.mcs51.bus cimport Bus

cdef int _OUTSIDE
cdef int _BREAKPOINT
cdef int _SPECIAL
cdef int _UNDEFINED_OPCODE
cdef int _STACK_OVERFLOW
cdef int _STACK_UNDERFLOW
cdef int _OUTSIDE_IMAGE

cdef class Executor:
    cdef readonly Bus bus
    cdef unsigned char rom[65538]
    cdef unsigned char rows[65536]
    cdef unsigned char row_of[256]
    cdef unsigned char length_of[256]
    cdef unsigned char cycles_of[256]
    cdef unsigned char iram[256]
    cdef public int pc
    cdef public int a
    cdef public int b
    cdef public int sp
    cdef public int dptr
    cdef public int cy
    cdef public int ac
    cdef public int ov
    cdef public int user_flags
    cdef public int bank
    cdef readonly long long cycles
    cdef readonly long long start
    cdef long long limit
    cdef long long until
    cdef int stop
    cdef readonly long long instructions
    cdef readonly long long idle_cycles
    cdef readonly long long faults

    @cython.locals(iram='unsigned char *', rom='unsigned char *', pc=int, row=int, op=int, first=int, second=int,
                   after=int, length=int, address=int, value=int)
    cpdef int run(self, long long until_cycle) except -1

    @cython.final
    cdef inline int read(self, int address) except -1
    @cython.final
    cdef inline int read_latched(self, int address) except -1
    @cython.final
    cdef inline int write(self, int address, int value) except -1
    @cython.final
    @cython.locals(byte=int)
    cdef inline int read_bit(self, int bit) except -1
    @cython.final
    @cython.locals(byte=int)
    cdef inline int latched_bit(self, int bit) except -1
    @cython.final
    @cython.locals(address=int, kept=int)
    cdef inline int write_bit(self, int bit, int level) except -1
    @cython.final
    cdef inline void branch(self, int offset) noexcept
    @cython.final
    cdef inline int call(self, int target) except -1
    @cython.final
    cdef inline int claim(self) except -1
    @cython.final
    @cython.locals(value=int)
    cdef inline int pop(self) except -1
    @cython.final
    @cython.locals(a=int, total=int)
    cdef inline void add(self, int operand, int carry) noexcept
    @cython.final
    @cython.locals(a=int, total=int)
    cdef inline void subtract(self, int operand) noexcept
    @cython.final
    cdef inline void compare(self, int left, int right, int offset) noexcept
    @cython.final
    @cython.locals(quotient=int)
    cdef inline void divide(self) noexcept
    @cython.final
    @cython.locals(value=int)
    cdef inline void decimal_adjust(self) noexcept
    @cython.final
    cdef int fault(self, int kind) except -1

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
