cimport cython
from miro_exact cimport dmath
from miro_sim.pitch cimport rays, scene, sensor

cdef int _SETS, _OUT, _UNSURE, _MIXED, _WIDTH, _HEIGHT, _CORNERS, _HALF_UM, _FAR_UM, _ROUNDED_UM
cdef int _TOP, _TEAM, _IDENTITY, _RAYS
cdef long long _TOP_UM, _CORNER_UM

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
    cdef int sets, field_sets, side, black, near_count, seer_count, cornered, more_um, around_um, first, samples
    cdef int middle_u, middle_v, fall_u, fall_v
    cdef bint sure, sampled
    cdef int low_u[4]
    cdef int high_u[4]
    cdef int low_v[4]
    cdef int high_v[4]
    cdef int team_paint[10]
    cdef int identity_paint[10]
    cdef int near[10]
    cdef int span_first[10]
    cdef int span_end[10]
    cdef int seers[10]
    cdef int drift_um[10]
    cdef int spread_um[60]
    cdef int x[60]
    cdef int y[60]
    cdef int cos[60]
    cdef int sin[60]
    cdef int top_x[4]
    cdef int top_y[4]
    cdef int corner_u[4]
    cdef int corner_v[4]
    cdef int u[16]
    cdef int v[16]
    cdef int seen[16]
    cdef int height_um[16]

    @cython.locals(body=int, at=int, place=int, share=double, after_s=double, way_m=double, sine=double, cosine=double)
    cpdef robot(self, int team, int identity, double x_m, double y_m, double theta_rad, double v_m_s=*, double w_rad_s=*)
    @cython.locals(first=int, end=int, row=int)
    cdef _draw(self, int left, int top, int width, int height, unsigned char[::1] out)
    @cython.locals(first=int, middle=int, place=int, way=int, turn=int, drift=int)
    cdef void _bound(self, int body) noexcept
    @cython.locals(pixel=int, body=int, reach='long long')
    cdef void _gather(self, int left, int top, int width, int height) noexcept
    @cython.locals(place=int, cosine='long long', sine='long long', x='long long', y='long long', u=int, v=int,
                   end_u=int, end_v=int, aside=int)
    cdef int _beyond(self, int body, int pixel) noexcept
    @cython.locals(step=int, body=int, beyond=int)
    cdef void _find_span(self, int index, int row, int first, int end) noexcept
    @cython.locals(left=int, right=int, column=int, passing=int, last=int, index=int, pixel=int, at=int, total='long long')
    cdef void _draw_robots(self, int row, int first, int end) noexcept
    @cython.locals(total='long long')
    cdef long long _steady(self, int body, int pixel) noexcept
    @cython.locals(index=int, total='long long')
    cdef long long _instant(self, int pixel, int column, int at) noexcept
    @cython.locals(x='long long', y='long long')
    cdef inline void _turn(self, int place, int pixel) noexcept
    @cython.locals(x='long long', y='long long')
    cdef void _fall(self, int place, int pixel) noexcept
    @cython.locals(scene=scene.Scene, behind=int, on_top=int, entered=int, team=int, identity=int, body=int,
                   total='long long')
    cdef long long _alone(self, int place, int pixel) noexcept
    @cython.locals(low_u=int, high_u=int, low_v=int, high_v=int, around=int)
    cdef inline int _within(self, int place, int pixel, int box) noexcept
    @cython.locals(inside_u=int, within=int, sample=int)
    cdef int _count(self, int place, int pixel, int low_u, int high_u, int low_v, int high_v) noexcept
    @cython.locals(fall_u='long long', fall_v='long long', low_u=int, high_u=int, low_v=int, high_v=int,
                   reach='long long', middle='long long', low='long long', high='long long', around='long long',
                   entered=int, sample=int, u=int, v=int)
    cdef int _across(self, int place, int pixel, int within) noexcept
    @cython.locals(u='int *', v='int *', cosine='long long', sine='long long', corner=int, x='long long', y='long long',
                   column=int)
    cdef void _sample(self, int place, int pixel) noexcept
    @cython.locals(twist=int, column=int, p=int, at=int, by=int)
    cdef inline void _spread(self, int* samples, int a, int b, int c, int d) noexcept
    @cython.locals(first=int, corner=int, ray=int)
    cdef void _find_corners(self, int pixel) noexcept
    @cython.locals(scene=scene.Scene, sample=int, index=int, behind=int, ball_seen=bint, paint=int, ball=int,
                   total='long long')
    cdef long long _samples(self, int pixel) noexcept
    @cython.locals(sample=int, u='long long', v='long long', height='long long')
    cdef void _see(self, int place, int pixel) noexcept
    cdef int _top(self, int body, long long u, long long v) noexcept
