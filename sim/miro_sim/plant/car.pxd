cimport cython
from miro_exact cimport dmath
from miro_robot.parts.part cimport Part
from miro_sim.plant.chassis cimport Body
from miro_sim.plant.dc_motor cimport DcMotorPart, OnShaft
from miro_sim.plant.plane cimport Plane

cdef double _TURN_RAD, _DEGREE_RAD, _NO_NEARER_CM, _MOST_RAD
cdef int _BODY

cdef class OnCar(Part):
    cpdef displaced(self, long long tick)

cdef class CarPart(OnShaft):
    cdef readonly Body body
    cdef readonly Plane plane
    cdef readonly double radius_cm, radius_m, half_track_cm, top_cm_tick
    cdef readonly list on_body
    cdef DcMotorPart left, right, rear_left, rear_right
    cdef public double left_turns, right_turns
    cdef public int bumped
    cdef public long long bumps
    cdef public double at_x_cm, at_y_cm, at_rad, cosine, sine

    cdef DcMotorPart _motor(self, int pin)
    @cython.locals(left=double, right=double, bumped=int)
    cpdef speed_changed(self, long long tick)
    @cython.locals(left=double, right=double, x_m=double, y_m=double, room_cm=double, body=Body)
    cdef int _roll(self, long long tick) except -1
    @cython.locals(turns=double)
    cdef double _turns(self, DcMotorPart motor, DcMotorPart rear, long long tick) noexcept
    @cython.locals(left=double, right=double, x_m=double, y_m=double, rad=double, body=Body)
    cpdef look(self, long long tick)
    cdef long long _known(self, long long tick)
    cpdef double top_speed(self, double ahead_cm, double left_cm) noexcept
    cpdef double edge_cm(self, double ahead_cm, double left_cm) except? -7.5
    @cython.locals(sine=double, cosine=double)
    cpdef double echo_cm(self, long long tick, double ahead_cm, double left_cm, double turned_deg) except? -7.5
    cdef double _speed_cm_s(self)
