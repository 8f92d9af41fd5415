cimport cython
from miro_robot.parts.part cimport Part

cdef long long _NEVER
cdef double _TURN_RAD, _STEP_US
cdef int _COAST, _FORWARD, _BACKWARD, _BRAKE, _SHAFT

cdef class OnShaft(Part):
    cpdef speed_changed(self, long long tick)

cdef class DcMotorPart(Part):
    cdef readonly double drive_v, drop_v, ohm, nm_a, kg_m2, friction_nm, tick_s
    cdef readonly long long step_ticks
    cdef readonly list on_shaft
    cdef public int mode, blocked
    cdef public long long from_tick
    cdef public double rad_s, turns, load_nm

    @cython.locals(a=int, b=int)
    cpdef changed(self, unsigned int pins, long long tick)
    cpdef carry(self, double kg_m2, double friction_nm)
    cpdef double turns_per_tick(self) noexcept
    cpdef double turns_at(self, long long tick) noexcept
    cdef void _move(self, long long tick) noexcept
    @cython.locals(stands=bint, part=OnShaft)
    cdef _go_on(self, long long tick)
    @cython.locals(emf_v=double)
    cdef double _volts(self) noexcept
    @cython.locals(torque_nm=double)
    cdef int _way(self) noexcept
    @cython.locals(way=int, volts=double, damping=double, torque_nm=double, share=double, speed=double)
    cdef double _after(self, double seconds) noexcept
