cimport cython
from miro_robot.parts.part cimport Part

cdef long long _NEVER
cdef int _SHORT, _WAVES, _CHANGED, _DUE, _ADVANCE, _OTHER
cdef int MOST_PINS, MOST_PARTS, PORT_PINS, RELEASED, LOW


cdef class Observer:
    cdef readonly object nets
    cdef public list edges
    cdef unsigned char wanted[288]
    cdef long long last_tick

    cpdef note(self, long long tick, int net, int level)


cdef class Nets:
    cdef readonly object netlist
    cdef readonly list parts
    cdef readonly int count, part_count
    cdef readonly tuple names
    cdef readonly list all_names
    cdef public int powered
    cdef int lows[288]
    cdef int highs[288]
    cdef int downs[288]
    cdef readonly int levels[288]
    cdef int contended[288]
    cdef list observers
    cdef int observed[288]
    cdef int touched[288]
    cdef int is_touched[288]
    cdef int touched_count
    cdef int suspects[288]
    cdef int is_suspect[288]
    cdef readonly int suspect_count
    cdef readonly int ports[32]
    cdef int shorts[32]
    cdef public int latches[4]
    cdef readonly int external[4]
    cdef readonly int wired[4]
    cdef readonly int live[4]
    cdef public int ports_changed
    cdef readonly long long next_tick, reach_tick
    cdef long long next_ticks[64]
    cdef long long reach_ticks[64]
    cdef int waiting[64]
    cdef int is_waiting[64]
    cdef int waiting_count
    cdef int moving[64]
    cdef int is_moving[64]
    cdef int moving_count
    cdef public list faults
    cdef int called, called_why
    cdef unsigned int called_pins
    cdef int first[289]
    cdef int pin_part[2048]
    cdef int pin_number[2048]
    cdef int pin_inverted[2048]
    cdef int net_of[2048]
    cdef int inverted[2048]
    cdef int port_of[288]
    cdef int next_port[32]
    cdef list latch_nets
    cdef int kin_first[65]
    cdef int feeder_end[64]
    cdef int kin[4096]
    cdef int reaches[64]
    cdef unsigned int cpu_pins[64]

    @cython.locals(end=int, index=int, pin=int, net=int, port=int)
    cdef _connect(self, netlist)
    @cython.locals(end=int, index=int)
    cdef _connect_kin(self, netlist)
    cdef list _reaching(self, netlist)
    cpdef bint is_output(self, int net) except -1
    cdef bint _may_contend(self, int net, netlist)
    @cython.locals(net=int, number=int, index=int, pin=int, part=Part)
    cpdef restart(self)
    @cython.locals(net=int, index=int, part=Part)
    cpdef show_all(self)
    @cython.locals(net=int, added=int)
    cpdef tie(self, int number, int level)
    cpdef note_shorts(self, int port, int low, int high)
    cdef inline int _latched(self, int number) noexcept
    cpdef observe(self, observer)
    cpdef ignore(self, observer)
    @cython.locals(net=int, number=int, port=int, mask=int)
    cdef _note_observed(self)
    @cython.locals(observer=Observer)
    cdef _report(self, long long tick, int net, int level)
    @cython.locals(index=int, place=int)
    cpdef int due(self, long long tick) except -1
    @cython.locals(index=int, tick='long long', reach_tick='long long')
    cdef void _earliest(self) noexcept
    cpdef int write_port(self, int port, int latch, long long tick) except -1
    @cython.locals(changed=int, number=int, net=int)
    cdef inline void put_latch(self, int port, int latch) noexcept
    @cython.locals(bit=int, net=int)
    cpdef write_latch(self, int index, int before, int after)
    @cython.locals(levels=int, bit=int, net=int)
    cpdef int buffered(self, int index) except -1
    @cython.locals(net=int)
    cdef inline void _add_drive(self, int index, int pin, int drive, int count) noexcept
    cdef inline void _add_level(self, int net, int level, int count) noexcept
    cpdef int settle(self, long long tick) except -1
    cpdef int collect(self, int index, long long tick) except -1
    @cython.locals(waves=int, count=int, place=int)
    cdef int _spread_waves(self, long long tick) except -1
    @cython.locals(part=Part)
    cdef int _call(self, int index, int why, long long tick) except -1
    @cython.locals(place=int)
    cdef inline int _after(self, int index, Part part, long long tick) except -1
    @cython.locals(waits=bint)
    cdef _check_next(self, Part part, long long tick)
    @cython.locals(reach_tick='long long')
    cdef _check_reach(self, Part part, long long tick)
    @cython.locals(tick='long long', reach_tick='long long', before='long long', reach_before='long long')
    cdef inline int _look_up(self, int index, Part part) except -1
    @cython.locals(moved='unsigned int', part=Part, place=int, index=int, pin=int)
    cdef int _take_effect(self) except -1
    cdef inline void _touch(self, int net) noexcept
    @cython.locals(place=int, net=int, level=int, changed=bint, both=int)
    cdef int _spread(self, long long tick) except -1
    cdef inline int _level(self, int net, int low, int high) noexcept
    @cython.locals(level=int, place=int, part=Part, pin=int, inverted=int, drive=int, low=int, high=int, bit='unsigned int', strong='unsigned int')
    cdef inline int _show(self, int net) except -1
    @cython.locals(place=int)
    cdef inline int _mark(self, int net) except -1
    @cython.locals(index=int, part=Part)
    cdef inline int _mark_pin(self, int place) except -1
    @cython.locals(end=int)
    cdef inline void _wait(self, int index) noexcept
    @cython.locals(place=int, net=int, both=int)
    cpdef list judge(self)
    @cython.locals(number=int, port=int, mask=int, own_low=int, levels=int, tied=int)
    cdef inline void _show_ports(self, int net) noexcept
    @cython.locals(part=Part, pin=int, place=int, number=int)
    cpdef list drivers(self, int net)
