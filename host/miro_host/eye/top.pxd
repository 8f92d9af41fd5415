cimport cython
from miro_exact.dmath cimport atan2, sincos, wrap_pi
from miro_host.eye.lens cimport Lens

cdef double _DISTANCE, _LEAST, _MOST


@cython.final
cdef class Top:
    cdef readonly str pattern
    cdef readonly Lens lens
    cdef readonly double angle_rad, distance_m, z_m, area_px, side_px, least_m, most_m
    cdef readonly int least_area, most_area

    cpdef (double, double, double, double) places(self, double x_m, double y_m, double theta_rad)
    cpdef (double, double, double) posture(self, double team_u, double team_v, double identity_u, double identity_v)
    cpdef double confidence(self, double gap_m, int team_area, int identity_area) except? -1.0
    cdef double margin(self, int area) except? -1.0
