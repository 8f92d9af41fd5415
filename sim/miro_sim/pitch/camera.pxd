cimport cython
from miro_exact.dmath cimport sincos
from miro_sim.pitch cimport rays, scene, sensor

cdef int _SETS, _OUT, _SURE, _UNSURE, _MIXED, _WIDTH, _HEIGHT, _CORNERS, _FAR_UM, _ROUNDED_UM, _LINE, _BAND
cdef int _TOP, _TEAM, _IDENTITY, _REACH, _BASE, _EDGES, _V, _LOW, _HIGH, _CROSSED_U, _CROSSED_V, _RAYS
cdef long long _HALF_UM, _TOP_UM

@cython.locals(low=int, high=int)
cdef inline bint _inside(int box, int every, int some) noexcept
@cython.locals(low=int, high=int)
cdef inline bint _outside(int box, int every, int some) noexcept
@cython.locals(most='long long')
cdef bint _enters(long long u, long long v, long long fall_u, long long fall_v) noexcept
@cython.locals(latest='long long')
cdef long long _entry(long long u, long long v, long long fall_u, long long fall_v) noexcept


@cython.final
cdef class Camera:
    cdef readonly object parameters, settings, pattern
    cdef readonly int width, height, robots
    cdef readonly rays.Rays rays
    cdef scene.Scene scene
    cdef readonly sensor.Sensor sensor
    cdef object boxes
    cdef int sets, field_sets, side, black, span_first, span_end, first, samples, upper, lower, above, below
    cdef int fall_u, fall_v, covered_first, covered_end
    cdef int team_paint[10]
    cdef int identity_paint[10]
    cdef long long drift_um[10]
    cdef int x[60]
    cdef int y[60]
    cdef int cos[60]
    cdef int sin[60]
    cdef long long shift_u[60]
    cdef long long shift_v[60]
    cdef int edges[1220]
    cdef int near_low[10]
    cdef int near_high[10]
    cdef int corner_u[4224]
    cdef int corner_v[4224]
    cdef int code[4224]
    cdef int every[2112]
    cdef int some[2112]
    cdef int always[352]
    cdef int ever[352]
    cdef unsigned char covered[4096]
    cdef long long total[4096]
    cdef int u[16]
    cdef int v[16]
    cdef int seen[96]
    cdef int height_um[96]

    @cython.locals(body=int, at=int, place=int, share=double, after_s=double, way_m=double, sine=double, cosine=double)
    cpdef robot(self, int team, int identity, double x_m, double y_m, double theta_rad, double v_m_s=*, double w_rad_s=*)
    @cython.locals(cosine='long long', sine='long long', at=int, box=int, low_u=int, high_u=int, low_v=int, high_v=int,
                   drop='long long', x='long long', y='long long')
    cdef _stand(self, int place)
    @cython.locals(camera='long long', drop='long long', margin='long long')
    cdef void _surround(self, int place, int at, int low, long long fall) noexcept
    @cython.locals(first=int, middle=int, reach=int, length='long long', place=int, way='long long', turn='long long',
                   drift='long long')
    cdef void _bound(self, int body) noexcept
    @cython.locals(out=bytearray)
    cpdef bytearray window(self, long long left, long long top, long long width, long long height)
    @cython.locals(first=int, end=int, band=int, above=int, below=int, row=int)
    cdef _draw(self, int left, int top, int width, int height, bytearray out)
    @cython.locals(column=int, sure=bint, total='long long')
    cdef void _put_robots(self, int row, int at) noexcept
    @cython.locals(width=int, height=int, at=int, pixel=int, most='long long', body=int)
    cdef void _cover(self, int top, int bottom, int first, int end) noexcept
    @cython.locals(at=int, row=int, left=int, right=int, column=int)
    cdef void _cover_with(self, int body, int top, int bottom, int first, int end) noexcept
    @cython.locals(step=int, left=int, right=int, beside='long long')
    cdef void _find_span(self, int body, int row, int first, int end) noexcept
    @cython.locals(place=int, edges=int, x='long long', y='long long', u='long long', v='long long',
                   beside_u='long long', beside_v='long long')
    cdef inline long long _beside(self, int body, int pixel) noexcept
    @cython.locals(rays=rays.Rays, at=int, place=int, cosine='long long', sine='long long', shift_u='long long',
                   shift_v='long long', line=int, corner=int, column=int, x='long long', y='long long')
    cdef void _find_corners(self, int body, int row, int left, int right) noexcept
    @cython.locals(edges='int *', a=int, b=int, c=int, d=int, e=int, f=int, g=int, h=int, i=int, j=int,
                   corner='long long', lane='long long', u=int, v=int, high=int)
    cdef void _encode(self, int at, int first, int end) noexcept
    @cython.locals(at=int, above='long long', below='long long', joined='long long', column='long long',
                   lane='long long', a=int, b=int, c=int, d=int)
    cdef void _join(self, int row, int left, int right) noexcept
    @cython.locals(total='long long')
    cdef void _cover_pixel(self, int body, int row, int column, int index) noexcept
    @cython.locals(scene=scene.Scene, whole=int, pixel=int, behind=int, on_top=int, entered=int, team=int, identity=int,
                   total='long long')
    cdef long long _alone(self, int body, int row, int column) noexcept
    cdef inline int _within(self, int body, int row, int column, int box) noexcept
    @cython.locals(low=int, high=int, within=int, at=int, every=int, some=int, crossed=int, edges=int)
    cdef int _count_within(self, int body, int row, int column, int box) noexcept
    cdef inline void _turn(self, int row, int column, int at) noexcept
    @cython.locals(u=int, v=int, low_u=int, high_u=int, low_v=int, high_v=int, inside_u=int, within=int, sample=int)
    cdef inline int _count(self, int at, int crossed) noexcept
    @cython.locals(within=int)
    cdef inline int _count_along(self, int* corners, int at, int crossed) noexcept
    @cython.locals(a=int, b=int, c=int, d=int, upper=int, lower=int, beyond=int, column=int, p=int, by=int, at=int,
                   above=int, below=int)
    cdef int _count_beyond(self, int* corners, int edge) noexcept
    @cython.locals(every=int, some=int, near=int, entered=int, at=int, inside=bint)
    cdef int _entered(self, int body, int row, int column, int on_top) noexcept
    @cython.locals(a=int, b=int, c=int, d=int, least_u=int, most_u=int, least_v=int, most_v=int, low_u=int, high_u=int,
                   low_v=int, high_v=int, crossed=int, within=int, u=int, v=int)
    cdef int _enter(self, int place, int pixel) noexcept
    @cython.locals(x='long long', y='long long')
    cdef inline void _fall(self, int place, int pixel) noexcept
    @cython.locals(fall_u='long long', fall_v='long long', most='long long', middle='long long', around='long long')
    cdef int _across(self, int within, long long u, long long v, long long around_u, long long around_v) noexcept
    @cython.locals(fall_u='long long', fall_v='long long', u='long long', v='long long', low_u='long long',
                   high_u='long long', low_v='long long', high_v='long long', most='long long', low='long long',
                   high='long long', entered=int, sample=int)
    cdef int _count_entering(self) noexcept
    @cython.locals(a=int, b=int, c=int, d=int, column=int, p=int, at=int, by=int)
    cdef inline void _spread(self, int* samples, int* corners) noexcept
    @cython.locals(pixel=int, scene=scene.Scene, behind=int, ball_seen=bint, at=int, body=int, sample=int, paint=int,
                   height=int, ball=int, total='long long')
    cdef long long _samples(self, int row, int column) noexcept
    @cython.locals(place=int, sample=int, u='long long', v='long long', index=int, height='long long')
    cdef void _see(self, int body, int at, int pixel) noexcept
    cdef int _top(self, int body, long long u, long long v) noexcept
    @cython.locals(at=int, inside_u=bint)
    cdef inline bint _lies_in(self, int place, int box, long long u, long long v) noexcept
