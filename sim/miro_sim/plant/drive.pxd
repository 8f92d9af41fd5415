cimport cython
from miro_exact cimport dmath
from miro_robot.lm629.chip cimport Lm629
from miro_robot.plant cimport Plant
from miro_sim.plant.chassis cimport Body
from miro_sim.plant.rough cimport RoughBody

cdef long long LONGEST_STEP, _NEVER
cdef double TICK_S, _LARGEST
cdef int _MOST_STEPS

@cython.final
cdef class Decay:
    cdef double share[4098]

@cython.final
cdef class Winding:
    cdef public double current_a
    cdef readonly int drive, wanted, wait_ticks, on_ticks, off_ticks, is_open
    cdef list volts
    cdef double volt[6], ohm[6], tau[6]
    cdef long long row[6]
    cdef readonly Decay decay

    cdef inline bint rests(self) noexcept
    cpdef open(self, int is_open)
    cpdef inline void ask(self, int wanted) noexcept
    cdef inline long long pass_edge(self, Lm629 chip) noexcept
    cpdef double step(self, int ticks, double emf_v) except? -7.5
    cdef inline double _pass(self, int ticks, double emf_v) noexcept
    @cython.locals(kind=cython.longlong, goes_on=cython.bint)
    cdef inline double _flow(self, int ticks, double emf_v) noexcept
    cdef double _through_zero(self, int ticks, double emf_v, double final, double tau) noexcept
    @cython.locals(kind=cython.longlong)
    cdef inline double _onward(self, double ticks, double emf_v) noexcept

@cython.final
cdef class Quadrature:
    cdef readonly double counts_per_radian
    cdef readonly long long counts_per_turn
    cdef readonly double position
    cdef readonly long long count
    cdef readonly int held_a, held_b

    cdef public Lm629 chip
    cdef double positions[17]
    cdef long long counts[17]

    @cython.locals(c_radians='double[16]', c_ticks='long long[17]')
    cpdef int turn(self, list radians, list ticks) except -1
    @cython.locals(edges=cython.longlong, count=cython.longlong, before=cython.longlong, one_way=cython.bint)
    cdef void _turn(self, double *radians, long long *ticks, int steps) noexcept
    @cython.locals(first=cython.int, way=cython.longlong)
    cdef int _tell_run(self, Lm629 chip, double *radians, long long *ticks, int steps, long long edges) noexcept
    cdef inline int _step_to(self, long long count, int step) noexcept
    cdef void _tell_each(self, Lm629 chip, double *radians, long long *ticks, int steps) noexcept
    @cython.locals(forward=cython.bint, after=cython.longlong)
    cdef long long _edge_tick(self, double *radians, long long *ticks, int step, long long count) noexcept
    cpdef void hold(self, int a, int b) noexcept
    cdef void _show(self, long long tick, Lm629 chip) noexcept
    cpdef inline int a(self) noexcept
    cpdef inline int b(self) noexcept
    cpdef int index(self) noexcept

@cython.locals(pulsing=cython.bint)
cdef long long _other_tick(Lm629 chip) noexcept

cdef class DifferentialDrive(Plant):
    cdef readonly object params
    cdef readonly double torque_constant_nm_a
    cdef readonly long long tick
    cdef readonly Winding left_winding, right_winding
    cdef readonly Quadrature left_encoder, right_encoder
    cdef readonly Body body
    cdef readonly RoughBody rough
    cdef long long ticks[17]

    cpdef tuple pose_at(self, long long tick)
    cpdef tuple velocity_at(self, long long tick)
    @cython.final
    @cython.locals(ticks=cython.int, steps=cython.int)
    cdef void _run(self, long long until, long long last, long long left_tick, long long right_tick) except *
    @cython.final
    @cython.locals(still=cython.bint)
    cdef inline bint _stands(self) noexcept
    @cython.final
    cdef int _move(self, int steps) except -1
