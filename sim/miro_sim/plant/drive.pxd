# C layout of miro_sim.plant.drive.
cimport cython
from miro_robot.lm629.chip cimport Lm629
from miro_robot.plant cimport Plant
from miro_sim.plant.chassis cimport Body
from miro_sim.plant.circuit cimport Winding
from miro_sim.plant.encoder cimport Quadrature
from miro_sim.plant.rough cimport RoughBody

cdef long long LONGEST_STEP
cdef double TICK_S

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
    @cython.final
    @cython.locals(constant=double, start_tick=cython.longlong, left_charge=double, right_charge=double)
    cdef inline int _step(self, int ticks) except -1
    @cython.final
    cdef void _show_index(self, Lm629 chip, Quadrature encoder, long long tick) noexcept
