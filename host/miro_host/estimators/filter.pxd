cimport cython
from miro_exact cimport dmath
from miro_host.estimators.motion cimport Motion

cdef int _N
cdef double _LARGEST


@cython.final
cdef class Filter:
    cdef readonly int size
    cdef readonly Motion motion
    cdef readonly double position_m, heading_rad, wheel, rim_m_s, warp_m, warp_length_m, effect_s, period_s
    cdef public int known
    cdef public double at_s
    cdef public double state[9], covariance[81]
    cdef readonly double left_m, right_m
    cdef double column[9], lower[25]

    cdef int factorise(self, int size) except -1
    @cython.locals(total=double)
    cpdef bint finite(self)
    cdef int forget(self, int index) except -1
    cpdef run(self, double to_s)
    cpdef predict(self, double to_s)
    cdef int move(self, int state, int other) except -1
    cpdef loosen(self, double position_m2, double heading_rad2)
    cdef int spread(self, int extra, double variance, double along, double turn, double cos, double sin) noexcept
    cdef int warp_on(self, double way_m) noexcept
    cdef int decompose(self, double position_m2, double heading_rad2) except -1
    cpdef double distance2(self, double x_m, double y_m, double theta_rad, double position_m2,
                           double heading_rad2) except? -7.5
    cpdef double along_m2(self, double cos, double sin, double position_m2) except? -7.5
    @cython.locals(warp=cython.bint)
    cpdef see(self, double x_m, double y_m, double theta_rad, double position_m2, double heading_rad2)
    @cython.locals(believed=cython.bint)
    cpdef bint count(self, int extra, double extra_m, double variance, double gate)
    cdef int correct(self, int first, int other, double innovation, double variance) except -1
    cdef int tidy(self) except -1
