cimport cython
from miro_host.eye.regions cimport Regions
from miro_host.eye.top cimport Top

cdef int _MOST, _TEAMS, _IDENTITIES
cdef double _FAR


@cython.final
cdef class Patches:
    cdef readonly Regions regions
    cdef Top robot_top
    cdef readonly int count, left, top, expected
    cdef int index[170]
    cdef double x_m[170]
    cdef double y_m[170]
    cdef double expect_x[4]
    cdef double expect_y[4]
    cdef readonly int out_pairs, out_team, out_identity
    cdef readonly bint out_contested
    cdef readonly double out_off_m, out_next_m, out_gap_m

    cpdef int look(self, bytearray pixels, int left, int top, int width, int height) except -1
    cdef void place(self, int region) except *
    cdef bint is_patch(self, int region) noexcept
    cpdef expect_nothing(self)
    cpdef expect(self, double team_x, double team_y, double identity_x, double identity_y)
    cpdef int choose(self, int team, int identity) except -1
    cdef bint is_whole(self, int patch, int kind) noexcept
    cdef bint fits(self, int mark, int other) noexcept
    cdef void take(self, int mark, int other) noexcept
    cdef double off_m(self, int team, int identity) noexcept
    cdef int partners(self, int patch) noexcept
