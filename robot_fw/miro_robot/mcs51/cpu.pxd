cimport cython

from miro_robot.mcs51.chip cimport Chip

cdef long long NEVER_TICK
cdef int _REPLAN, _REACHED, _BREAKPOINT, _WIRE_FULL, _ASLEEP, _MARK, _MARK_CYCLES, _MAIN_LOOP_STARVED, _INTERRUPT_NOT_LEFT
cdef int _UNDEFINED_OPCODE, _STACK_OVERFLOW, _STACK_UNDERFLOW, _OUTSIDE_IMAGE
cdef int _MOV_DATA, _P2, _CORE, _IDL, _SPREAD_FROM, _SPREAD_TO, _DEPTH

@cython.final
cdef class Cpu(Chip):
    cpdef int run(self, long long until_cycle) except -1
    cdef int run_alone(self, long long until_cycle) except -1
    cpdef int go_on(self, long long until_cycle) except -1
    cpdef int step(self) except -1
    cdef int begin_run(self) except -1
    cdef int end_run(self) except -1
    cdef int boundary(self) except -1
    @cython.locals(blocked=bint)
    cdef inline int _attend(self, long long now) except -1
    cpdef bint executes_next(self) except -1
    cdef int _note_end(self, long long now) except -1
    cdef int _look_for_sleep(self, long long now) except -1
    cdef int _watch_main_loop(self, long long now) except -1
    cdef int _enter(self, int source) except -1
    cdef int end_of_interrupt(self, int pc) except -1
    cdef int return_in_service(self, int pc) except -1
    @cython.locals(now='long long', pc='long long', line='unsigned long long', row=int, value=int)
    cdef int execute(self, long long until_cycle) except -1

    cdef inline int read(self, int address) except -1
    cdef int read_register(self, int address) except -1
    cdef inline int core_register(self, int address) noexcept
    cpdef int sfr(self, int address) except -1
    cdef int register(self, int address, long long cycle) except -1
    cdef int read_latch(self, int address) except -1
    cdef inline int read_latched(self, int address) except -1
    cdef inline int write(self, int address, int value) except -1
    cdef int write_register(self, int address, int value) except -1
    cdef inline int read_bit(self, int bit) except -1
    cdef inline int latched_bit(self, int bit) except -1
    cdef inline int write_bit(self, int bit, int level) except -1
    cdef int write_register_bit(self, int address, int mask, int level) except -1
    cdef inline int branch(self, int pc, int offset) noexcept
    cdef inline int fork(self, int target) noexcept
    cdef inline int call(self, int pc, int target) except -1
    cdef inline int claim(self) except -1
    @cython.locals(empty=bint)
    cdef inline int pop(self) except -1
    @cython.locals(round_the_top=bint)
    cdef int set_sp(self, int value) except -1
    cdef inline void add(self, int operand, int carry) noexcept
    cdef inline void subtract(self, int operand) noexcept
    cdef inline int compare(self, int pc, int left, int right, int offset) noexcept
    cdef inline void divide(self) noexcept
    cdef inline void decimal_adjust(self) noexcept

    cpdef begin_edges(self)
    @cython.locals(place='unsigned int')
    cdef void count_edge(self, int target) noexcept
    cdef void enter_edges(self) noexcept
    cdef void leave_edges(self) noexcept
