cimport cython
from libc cimport math
from miro_exact.rng cimport Stream
from miro_host.eye.grabber cimport Grabber
from miro_host.eye.tracker cimport Tracker
from miro_host.vision cimport Vision
from miro_sim.pitch.camera cimport Camera
from miro_sim.world.robot cimport Robot

cdef double WRONG


cdef class GaussianSight:
    cdef readonly list bodies, visions, streams
    cdef public long long frame

    @cython.locals(vision=Vision, noise=Stream, body=Robot)
    cpdef list expose(self, long long tick)


cdef class SeeingSight:
    cdef readonly object camera
    cdef readonly list bodies
    cdef readonly Grabber grabber
    cdef readonly Stream chances
    cdef readonly double worst_m
    cdef readonly long long frame, lost, dropped, repeated, wrong, swapped

    cpdef list look(self, long long tick)
    @cython.locals(robots='long long')
    cpdef tuple expose(self, long long tick)
    @cython.locals(x_m=double, y_m=double)
    cdef _count(self, long long tick, tuple seen)
    @cython.locals(body=Robot, true_x_m=double, true_y_m=double, dx=double, dy=double)
    cdef double _distance_m(self, Py_ssize_t own, long long tick, double x_m, double y_m) except? -1.0


cdef class GeometricSight(SeeingSight):
    cdef readonly object field


cdef class PixelSight(SeeingSight):
    cdef public object watch
    cdef public list everyone
    cdef readonly Camera eye
    cdef readonly Tracker tracker

    @cython.locals(body=Robot, x_m=double, y_m=double, theta_rad=double, v_m_s=double, w_rad_s=double)
    cpdef Camera picture_at(self, long long frame, long long tick)
