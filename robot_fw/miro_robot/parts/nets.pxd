cimport cython
from miro_robot.parts.part cimport Part

cdef long long _NEVER
cdef int _WAVES, MOST_PINS, PORT_PINS, RELEASED, LOW

cdef class Nets:
    cdef readonly object netlist
    cdef readonly list parts
    cdef readonly int count, part_count
    cdef readonly tuple names
    cdef int lows[256]
    cdef int highs[256]
    cdef int downs[256]
    cdef readonly int levels[256]
    cdef int contended[256]
    cdef int watched[256]
    cdef int touched[256]
    cdef int is_touched[256]
    cdef int touched_count
    cdef int settled[256]
    cdef int is_settled[256]
    cdef int settled_count
    cdef public list edges
    cdef readonly int ports[32]
    cdef public int latches[4]
    cdef public int external[4]
    cdef readonly int wired[4]
    cdef int ports_changed
    cdef public int new_contention
    cdef public list faults
    cdef int is_waiting[64]
    cdef int is_moving[64]
    cdef int moving
    cdef int first[257]
    cdef int pin_part[2048]
    cdef int pin_number[2048]
    cdef int pin_inverted[2048]
    cdef int net_of[2048]
    cdef int inverted[2048]
    cdef int port_of[256]
    cdef int next_port[32]
    cdef list latch_nets
    cdef int feeder_first[65]
    cdef int feeder[4096]
    cdef int reaches[64]

    @cython.locals(end=int, index=int, pin=int, net=int)
    cdef _connect(self, netlist)
    cdef list _feeders(self, netlist, int index)
    cdef list _reaching(self, netlist)
    @cython.locals(net=int, number=int, index=int, pin=int, port=int, part=Part)
    cpdef restart(self)
    cpdef watch(self, int net, int on)
    @cython.locals(number=int, place=int, part=Part, pin=int)
    cpdef list drivers(self, int net)
    @cython.locals(index=int, tick='long long')
    cpdef long long next_tick(self) except -1
    @cython.locals(index=int, tick='long long', part=Part)
    cpdef long long reach_tick(self) except -1
    cdef inline Part _part(self, int index)
    @cython.locals(index=int, place=int, part=Part)
    cpdef int due(self, long long tick) except -1
    @cython.locals(changed=int, bit=int)
    cpdef int write_port(self, int port, int latch, long long tick) except -1
    cdef void _add_port(self, int number, int count) noexcept
    cpdef int write_latch(self, int index, int before, int after, long long tick) except -1
    cpdef add_latch(self, int index, int value)
    cdef void _drive_latch(self, int net, int level, int count) noexcept
    @cython.locals(net=int)
    cdef void _add_drive(self, int index, int pin, int drive, int count) noexcept
    @cython.locals(waves=int, index=int)
    cpdef int settle(self, long long tick) except -1
    cpdef int collect(self, int index, long long tick) except -1
    cpdef int call(self, int index, long long tick) except -1
    @cython.locals(part=Part, pins='unsigned int')
    cdef int _call(self, int index, int what, long long tick) except -1
    @cython.locals(part=Part)
    cdef inline int _after(self, int index, long long tick) except -1
    @cython.locals(moved='unsigned int', part=Part, index=int, pin=int)
    cdef int _take_effect(self) except -1
    cdef inline void _touch(self, int net) noexcept
    @cython.locals(place=int, net=int, level=int, changed=bint, number=int)
    cdef int _spread(self, long long tick) except -1
    cdef inline int _level(self, int net, int low, int high) noexcept
    @cython.locals(level=int, place=int, part=Part, pin=int, inverted=int, drive=int, low=int, high=int, bit='unsigned int', strong='unsigned int')
    cdef int _show(self, int net) except -1
    @cython.locals(place=int, index=int, part=Part)
    cdef int _mark(self, int net) except -1
    @cython.locals(place=int, net=int, both=int)
    cdef void _judge(self) noexcept
    @cython.locals(levels=int)
    cpdef int take_external(self, int port) except -1
    @cython.locals(levels=int, bit=int, net=int, own_low=int)
    cdef int _external(self, int port) noexcept
