cimport cython
from libc cimport math
from miro_exact.dmath cimport sincos
from miro_sim.pitch cimport rays, scene, sensor
from miro_sim.pitch.rays cimport enters, entry

cdef int _SETS, _OUT, _SURE, _UNSURE, _MIXED, _WIDTH, _HEIGHT, _CORNERS, _FAR_UM, _ROUNDED_UM, _LINE, _LINES, _AXIS, _SAMPLES, _BAND, _PLACES
cdef int _TOP, _TEAM, _IDENTITY, _REACH, _BASE, _NEAR, _LOW_U, _HIGH_U, _LOW_V, _HIGH_V, _LIFT, _FAST_UM
cdef long long _HALF_UM, _TOP_UM

cdef int _um(double metres) noexcept
cdef int _rounded(double x) noexcept


@cython.final
cdef class Camera:
    cdef readonly object parameters, settings
    cdef readonly int width, height, robots
    cdef readonly rays.Rays rays
    cdef scene.Scene scene
    cdef readonly sensor.Sensor sensor
    cdef int sets, field_sets, fields, side, black, span_first, span_end, samples, worked, times, place
    cdef int least_u, most_u, least_v, most_v
    cdef long long fall_u, fall_v
    cdef list stood, covers
    cdef long long changes, scene_changed
    cdef long long changed[10]
    cdef long long drift_um[10]
    cdef int covered_first[4]
    cdef int covered_end[4]
    cdef double after_s[6]
    cdef int team_paint[10]
    cdef int identity_paint[10]
    cdef int x[60]
    cdef int y[60]
    cdef int cos[60]
    cdef int sin[60]
    cdef int edges[132]
    cdef int corner[8448]
    cdef int line_least[1408]
    cdef int line_most[1408]
    cdef unsigned char covered[16384]
    cdef long long total[16384]
    cdef int place_of[192]
    cdef int spread[2]
    cdef int seen[96]
    cdef int height_um[96]

    @cython.locals(stood=tuple)
    cpdef robot(self, int team, int identity, double x_m, double y_m, double theta_rad, double v_m_s=*, double w_rad_s=*)
    cdef inline void _turn(self, int place, long long x, long long y) noexcept
    cdef void _surround(self, int at, long long least, long long most) noexcept
    @cython.locals(reach=int, length='long long', way='long long', turn='long long', drift='long long')
    cdef void _bound(self, int body) noexcept
    cpdef bytearray window(self, long long left, long long top, long long width, long long height)
    cdef void _put_robots(self, int row, int at) noexcept
    cdef void _cover(self, int top, int bottom, int first, int end) except *
    cdef void _cover_with(self, int body, int top, int bottom, int first, int end) noexcept
    cdef void _find_span(self, int body, int row, int first, int end) noexcept
    @cython.locals(reach=int)
    cdef inline long long _beside(self, int body, int pixel) noexcept
    @cython.locals(x='double[4]', y='double[4]', u='int[4]', v='int[4]', lane='long long', column='long long')
    cdef void _find_corners(self, int body, int row, int left, int right) noexcept
    @cython.locals(least='int[4]', most='int[4]', lane='long long', column='long long')
    cdef void _bound_line(self, int row, int left, int right) noexcept
    cdef inline void _bound_pixel(self, int column) noexcept
    cdef inline bint _inside(self, int at) noexcept
    cdef inline bint _outside(self, int at) noexcept
    @cython.locals(packed='long long *')
    cdef void _cover_pixel(self, int body, int row, int column, int index) noexcept
    cdef int _within(self, int row, int column, int box) noexcept
    @cython.locals(across_u=bint, across_v=bint, within='int[4]', lane='long long', at='long long', u='long long',
                   v='long long')
    cdef int _count(self, int row, int column, int first, int end, int low_u, int high_u, int low_v,
                    int high_v) noexcept
    @cython.locals(at='int[4]', by='int[4]', lane=int)
    cdef void _spread(self, int row, int column, int axis) noexcept
    cdef int _entered(self, int body, int row, int column, int on_top) noexcept
    cdef inline int _enter(self, int row, int column, int number) noexcept
    cdef inline long long _across(self, int corner) noexcept
    cdef long long _samples(self, int row, int column) noexcept
    cdef void _see(self, int body, int number, int pixel) noexcept
    cdef int _top(self, int body, long long u, long long v) noexcept
    cdef inline bint _lies_in(self, int box, long long u, long long v) noexcept
