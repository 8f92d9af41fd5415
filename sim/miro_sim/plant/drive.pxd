# C layout of miro_sim.plant.drive.
cimport cython
from miro_exact cimport dmath
from miro_robot.lm629.chip cimport Lm629
from miro_robot.plant cimport Plant
from miro_sim.plant.chassis cimport Body
from miro_sim.plant.rough cimport RoughBody

cdef long long LONGEST_STEP
cdef double TICK_S, _LARGEST, _ANGLES

@cython.final
cdef class Winding:
    cdef public double current_a
    cdef readonly int drive, wanted, wait_ticks, on_ticks, off_ticks
    cdef readonly double drive_v, diode_v, up_v, down_v
    cdef double ohm[2]
    cdef double tau[2]
    cdef double decay[4098]

    @cython.locals(longest=int)
    cpdef int after_load(self) except -1
    @cython.locals(wanted=int)
    cpdef void set_bridge(self, int enable, int forward) noexcept
    cdef inline void _switch(self, int drive) noexcept
    cpdef double step(self, int ticks, double emf_v) except? -7.5
    @cython.locals(wait=int, charge=double)
    cdef double _pass(self, int ticks, double emf_v) noexcept
    @cython.locals(start=double, positive=cython.bint, driven=cython.bint, voltage=double, tau=double, final=double,
                   end=double, ratio=double, crossing=double)
    cdef double _flow(self, int ticks, double emf_v) noexcept
    @cython.locals(voltage=double, driven=cython.bint, tau=double, final=double)
    cdef inline double _onward(self, double ticks, double emf_v) noexcept

@cython.final
cdef class Quadrature:
    cdef readonly double counts_per_radian
    cdef readonly long long counts_per_turn
    cdef readonly double position
    cdef readonly long long count

    @cython.locals(moved=double, start=double, position=double, last=cython.longlong)
    cpdef inline void turn(self, double radians, long long start_tick, int ticks, Lm629 chip) noexcept
    @cython.locals(count=cython.longlong, forward=cython.bint, boundary=cython.longlong, exact=double, after=cython.longlong)
    cdef void _cross(self, double start, long long last, double ticks_per_count, long long start_tick, int ticks,
                     Lm629 chip) noexcept
    cpdef int after_load(self) except -1
    cpdef inline int a(self) noexcept
    cpdef inline int b(self) noexcept
    cpdef int index(self) noexcept

@cython.locals(pulsing=cython.bint)
cdef inline long long _other_tick(Lm629 chip) noexcept
cdef inline void _pass_edge(Lm629 chip, Winding winding) noexcept

cdef class DifferentialDrive(Plant):
    cdef readonly object params
    cdef readonly double torque_constant_nm_a
    cdef readonly long long tick
    cdef readonly Winding left_winding, right_winding
    cdef readonly Quadrature left_encoder, right_encoder
    cdef readonly Body body
    cdef readonly RoughBody rough

    cpdef attach(self, Lm629 left, Lm629 right)
    cpdef int after_load(self) except -1
    cpdef advance(self, long long tick)
    cpdef set_bridge(self, long long tick, int side, int enable, int forward)
    @cython.locals(left=Lm629, right=Lm629, begin=cython.longlong, until=cython.longlong, now=cython.longlong)
    cpdef int run_pulses(self, long long tick) except -1
    @cython.final
    @cython.locals(
        body=Body, left_winding=Winding, right_winding=Winding, left_encoder=Quadrature, right_encoder=Quadrature,
        constant=double, impulse=double, inverse_ll=double, inverse_lr=double, inverse_rr=double,
        left_rad_s=double, right_rad_s=double, x_m=double, y_m=double, theta_rad=double,
        begin=cython.longlong, now=cython.longlong, next_tick=cython.longlong, ticks=cython.int,
        left_nms=double, right_nms=double, half_s=double, most=double, free_left=double, free_right=double,
        left_rub=double, right_rub=double, new_left=double, new_right=double, turned_left=double,
        turned_right=double, left_m=double, right_m=double, half=double, chord_m=double, angle=double, sine=double, cosine=double)
    cdef int _roll(self, long long until, Lm629 left, Lm629 right) except -1
    @cython.final
    @cython.locals(constant=double, start_tick=cython.longlong, left_charge=double, right_charge=double)
    cdef inline int _step(self, int ticks, Lm629 left, Lm629 right) except -1
    @cython.final
    cdef void _show_index(self, Lm629 chip, Quadrature encoder, long long tick) noexcept
