cimport cython
from libc cimport math
from miro_exact.dmath cimport sincos
from miro_sim.pitch cimport rays, scene, sensor
from miro_sim.pitch.rays cimport enters, entry

cdef int _SETS, _OUT, _SURE, _UNSURE, _MIXED, _WIDTH, _HEIGHT, _CORNERS, _FAR_UM, _ROUNDED_UM, _LINE, _FIELD, _BAND, _PLACES
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
    cdef int sets, field_sets, fields, side, black, span_first, span_end, first, samples, upper, lower, above, below
    cdef int lanes, times, place
    cdef list stood, covers
    cdef long long changes, scene_changed
    cdef long long changed[10]
    cdef long long drift_um[10]
    cdef int covered_first[4]
    cdef int covered_end[4]
    cdef int instants[6]
    cdef double after_s[6]
    cdef int team_paint[10]
    cdef int identity_paint[10]
    cdef int x[80]
    cdef int y[80]
    cdef int cos[84]
    cdef int sin[84]
    cdef long long shift_u[80]
    cdef long long shift_v[80]
    cdef int edges[132]
    cdef int corner_u[5632]
    cdef int corner_v[5632]
    cdef int line_least_u[704]
    cdef int line_most_u[704]
    cdef int line_least_v[704]
    cdef int line_most_v[704]
    cdef int least_u[352]
    cdef int most_u[352]
    cdef int least_v[352]
    cdef int most_v[352]
    cdef int fall_u[4]
    cdef int fall_v[4]
    cdef int low_u[4]
    cdef int high_u[4]
    cdef int low_v[4]
    cdef int high_v[4]
    cdef unsigned char covered[16384]
    cdef long long total[16384]
    cdef int u[16]
    cdef int v[16]
    cdef int seen[128]
    cdef int height_um[128]

    @cython.locals(stood=tuple)
    cpdef robot(self, int team, int identity, double x_m, double y_m, double theta_rad, double v_m_s=*, double w_rad_s=*)
    @cython.locals(cosine='long long', sine='long long')
    cdef void _stand(self, int place) noexcept
    cdef void _surround(self, int at, long long least, long long most) noexcept
    @cython.locals(reach=int, length='long long', way='long long', turn='long long', drift='long long')
    cdef void _bound(self, int body) noexcept
    cpdef bytearray window(self, long long left, long long top, long long width, long long height)
    cdef void _put_robots(self, int row, int at) noexcept
    cdef void _cover(self, int top, int bottom, int first, int end) except *
    cdef void _cover_with(self, int body, int top, int bottom, int first, int end) noexcept
    cdef void _find_span(self, int body, int row, int first, int end) noexcept
    @cython.locals(reach=int, x='long long', y='long long')
    cdef inline long long _beside(self, int body, int pixel) noexcept
    @cython.locals(bounds=int, still=bint, column='long long', lane='long long', line=int)
    cdef void _find_corners(self, int body, int row, int left, int right) noexcept
    @cython.locals(x='double[4]', y='double[4]', u='int[4]', v='int[4]', lane='long long')
    cdef void _turn_corners(self, int place, long long corner, long long line, long long bounds, long long left,
                            long long right) noexcept
    cdef void _bound_pixels(self, long long left, long long right) noexcept
    cdef inline bint _inside(self, int column, int at) noexcept
    cdef inline bint _outside(self, int column, int at) noexcept
    cdef void _cover_pixel(self, int body, int row, int column, int index) noexcept
    cdef long long _alone(self, int body, int row, int column) noexcept
    @cython.locals(packed='long long *', identity=int)
    cdef long long _paint_top(self, int body, int row, int column, int on_top) noexcept
    cdef inline int _within(self, int row, int column, int box) noexcept
    @cython.locals(across_u=bint, across_v=bint, within=int, first=int, lane='long long')
    cdef int _count_within(self, int row, int column, int at) noexcept
    cdef inline int _count(self, bint across_u, bint across_v) noexcept
    cdef inline void _turn(self, int row, int column, int at) noexcept
    @cython.locals(lane='long long', above='long long', below='long long')
    cdef inline void _lay(self, int* corners, int* at, int* by, int* right, int* bend) noexcept
    @cython.locals(at='int[4]', by='int[4]', right='int[4]', bend='int[4]', within='int[4]', lane='long long',
                   least=int, most=int, above=int, below=int, _=int)
    cdef int _count_along(self, int* corners, int* low, int* high) noexcept
    cdef inline int _add(self, int* within) noexcept
    @cython.locals(at_u='int[4]', by_u='int[4]', right_u='int[4]', bend_u='int[4]', at_v='int[4]', by_v='int[4]',
                   right_v='int[4]', bend_v='int[4]', within='int[4]', lane='long long', low_u=int, high_u=int,
                   low_v=int, high_v=int, above=int, below=int, _=int)
    cdef int _count_both(self) noexcept
    cdef int _entered(self, int body, int row, int column, int on_top) noexcept
    @cython.locals(least_u='int[4]', most_u='int[4]', least_v='int[4]', most_v='int[4]', outside='int[4]',
                   across_u='int[4]', across_v='int[4]', off='double[4]', over='double[4]', gone=int, crossed_u=int,
                   crossed_v=int, crossed=int, lane='long long', low_u=int, high_u=int, low_v=int, high_v=int, u=int,
                   v=int, along_u=double, along_v=double, middle=double, around=double)
    cdef int _enter(self, int place, int pixel) noexcept
    @cython.locals(above='long long', below='long long', lane='long long')
    cdef inline void _bound_corners(self, int* corners, int* least, int* most) noexcept
    cdef inline void _fall(self, int place, int pixel) noexcept
    @cython.locals(at_u='int[4]', by_u='int[4]', right_u='int[4]', bend_u='int[4]', at_v='int[4]', by_v='int[4]',
                   right_v='int[4]', bend_v='int[4]', within='int[4]', fall_u='double[4]', fall_v='double[4]',
                   most='double[4]', u='int[4]', v='int[4]', row=int, lane='long long', one=int, other=int, inside=int,
                   _=int)
    cdef int _count_entering(self) noexcept
    @cython.locals(column=int, p=int, at=int, by=int)
    cdef inline void _spread(self, int* samples, int* corners) noexcept
    cdef long long _samples(self, int row, int column) noexcept
    cdef void _see(self, int body, int at, int pixel) noexcept
    cdef int _top(self, int body, long long u, long long v) noexcept
    cdef inline bint _lies_in(self, int box, long long u, long long v) noexcept
