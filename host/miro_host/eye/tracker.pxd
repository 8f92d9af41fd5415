cimport cython
from libc cimport math
from miro_host.eye.patches cimport Patches
from miro_host.eye.regions cimport Regions
from miro_host.eye.top cimport Top
from miro_host.eye.track cimport Track
from miro_host.eye.weighing cimport Weighing

cdef int LARGE_PX
cdef double CLEARLY_M, CONTESTED_M


@cython.final
cdef class Tracker:
    cdef readonly object pattern, learning
    cdef readonly str team
    cdef readonly tuple robots
    cdef readonly bytes table
    cdef readonly list kinds, weighings, tracks
    cdef readonly bint weighted
    cdef readonly int window_px, team_kind
    cdef readonly long long lost_frames, searches
    cdef readonly Top top
    cdef readonly Patches patches
    cdef readonly Regions regions
    cdef public object notes

    @cython.locals(track=Track)
    cpdef list track(self, frame, long long tick)
    @cython.locals(track=Track, x_m=double, y_m=double, theta_rad=double)
    cdef _followed(self, frame, long long tick, int slot)
    @cython.locals(whole_width=int, whole_height=int)
    cpdef bytearray _look(self, frame, double u, double v, int size, int slot)
    cpdef _expect(self, double x_m, double y_m, double theta_rad)
    @cython.locals(track=Track)
    cpdef _chosen(self, bytearray pixels, long long tick, int slot)
    cdef _part(self, list pairs)
    cdef _pair(self, bytearray pixels, long long tick, int slot)
    @cython.locals(weighing=Weighing, team_u=double, team_v=double, identity_u=double, identity_v=double)
    cdef (double, double, double, double) _centroids(self, bytearray pixels, int slot)


cdef int _first(double middle, int size, int whole) noexcept
