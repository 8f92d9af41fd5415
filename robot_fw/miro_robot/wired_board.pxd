cimport cython
from miro_robot.empty_board cimport EmptyBoard
from miro_robot.parts.nets cimport Nets

cdef long long CYCLE_TICKS, NEVER_TICK, _BEHIND_TICKS
cdef unsigned char _TWO_CYCLES[256]
cdef int _ADDRESS, _RELEASE, _DATA, _STROBE, _SAMPLE, _STROBE_ENDS, _DATA_ENDS, _PAGE_ENDS, _RXD, _WR, _RD
cdef int _OUTPUT_PORT[3]
cdef int _OUTPUT_MASK[3]
cdef int REPLAN, STOPPED, _CONTENTION, _STARVED


cdef class WiredBoard(EmptyBoard):
    cdef readonly list parts
    cdef readonly dict part_index
    cdef readonly list starved
    cdef readonly Nets nets
    cdef long long horizon
    cdef unsigned char outside[4]
    cdef int pushed[4]
    cdef int on_bus, stuck
    cdef readonly int drives_rxd, outputs
    cdef int output_levels[4]
    cdef long long output_ticks[3]
    cdef long long output_tick, output_put
    cdef int latch_count, buffer_count
    cdef int latch_address[8]
    cdef int latch_mask[8]
    cdef int buffer_address[8]
    cdef int buffer_mask[8]
    cdef unsigned char latched[8]

    @cython.locals(faults='long long')
    cdef int _run(self, tuple addresses, long long until_tick) except -1
    cdef int _run_on(self, tuple marks, long long until_cycle) except -1
    cdef _sleep_on(self, long long until_cycle)
    cdef bint _may_wake(self) except -1
    cdef int _go_on(self, tuple marks, long long until_cycle) except -1
    @cython.locals(due='long long', due_cycle='long long', stop_cycle='long long', reason=int, faults='long long')
    cdef int _run_pieces(self, long long until_cycle) except -1
    @cython.locals(now='long long')
    cdef inline long long _cycle_of(self, long long due) noexcept
    cdef bint _is_due(self, long long due, long long due_cycle) except -1
    cdef bint _is_before_write(self, long long due_cycle) except -1
    @cython.locals(due='long long')
    cdef inline long long _due(self) noexcept
    @cython.locals(end_tick='long long')
    cdef int _catch_up(self) except -1
    cdef _step(self)
    @cython.locals(output=int)
    cdef int _output_due(self, long long tick) except -1
    @cython.locals(nets=Nets, port=int, mask=int, levels=int)
    cdef int _put_output(self, int output, int level, long long tick) except -1
    @cython.locals(output=int, foreseen='long long', before='long long')
    cpdef int outputs_changed(self, long long tick) except -1
    @cython.locals(output=int, level=int)
    cdef bint _goes_otherwise(self, long long tick) except -1
    @cython.locals(output=int)
    cdef int _foresee(self, long long tick) except -1
    @cython.locals(now='long long', nets=Nets)
    cpdef int sync(self, long long tick) except -1
    @cython.locals(port=int, nets=Nets)
    cdef inline int _push(self, long long tick) except -1
    @cython.locals(index=int)
    cdef _decode(self, spec)
    @cython.locals(nets=Nets)
    cdef inline int _put_on_port(self, int port, int latch, long long tick) except -1
    cdef inline int _before(self, long long tick) except -1
    @cython.locals(index=int, start='long long')
    cpdef movx_write(self, int address, int value, long long tick)
    @cython.locals(index=int, start='long long', value=int)
    cpdef int movx_read(self, int address, long long tick) except -1
    cdef int _put_address(self, int address, long long start) except -1
    @cython.locals(changed=int)
    cdef int _push_port(self, int port, int levels, long long tick) except -1
    @cython.locals(net=int)
    cdef _judge(self, long long tick)
    @cython.locals(port=int)
    cdef int _note_stuck(self) except -1
    cdef _note_faults(self, long long tick)
    cdef _supply(self, int on, long long tick)
