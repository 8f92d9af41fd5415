cimport cython
from miro_exact cimport dmath
from miro_sim.pitch cimport rays, scene, sensor

cdef int _SETS, _OUT, _UNSURE, _MIXED, _UNKNOWN, _WIDTH, _HEIGHT, _CORNERS
cdef long long _HALF_UM, _TOP_UM, _CORNER_UM, _MIDDLE_X_UM, _MIDDLE_Y_UM
cdef double _FAR_SQUARE

@cython.locals(middle_u='long long', middle_v='long long', long_u='long long', long_v='long long')
cdef bint _enters(long long u, long long v, long long fall_u, long long fall_v, long long half) noexcept
@cython.locals(latest='long long')
cdef long long _entry(long long u, long long v, long long fall_u, long long fall_v) noexcept


@cython.final
cdef class Camera:
    cdef readonly object parameters, settings, pattern
    cdef readonly int width, height, robots
    cdef readonly rays.Rays rays
    cdef scene.Scene scene
    cdef readonly sensor.Sensor sensor
    cdef long long falloff, team_u, team_v, identity_u, identity_v, patch_um
    cdef int sets, field_sets, side, black, near_count
    cdef int team_paint[10]
    cdef int identity_paint[10]
    cdef int near[10]
    cdef int code[60]
    cdef int x[60]
    cdef int y[60]
    cdef int cos[60]
    cdef int sin[60]
    cdef int seen[16]
    cdef int height_um[16]

    @cython.locals(body=int, at=int, place=int, share=double, after_s=double, way_m=double, sine=double, cosine=double)
    cpdef robot(self, int team, int identity, double x_m, double y_m, double theta_rad, double v_m_s=*, double w_rad_s=*)
    @cython.locals(first=int, end=int, row=int, column=int, pixel=int)
    cdef _draw(self, int left, int top, int width, int height, unsigned char[::1] out)
    @cython.locals(x='long long', y='long long', lost='long long')
    cdef long long _light(self, int pixel) noexcept
    @cython.locals(pixel=int, body=int, at=int, place=int, reach='long long', x='long long', y='long long', far='long long')
    cdef void _gather(self, int left, int top, int width, int height) noexcept
    @cython.locals(scene=scene.Scene, seen=bint, index=int, at=int, code=int, total='long long')
    cdef long long _total(self, int pixel) noexcept
    @cython.locals(samples=int, paint=int, index=int, code=int)
    cdef long long _instant(self, int pixel, int at) noexcept
    @cython.locals(far='long long', top_x='long long', top_y='long long', end_x='long long', end_y='long long')
    cdef bint _passes(self, int pixel, long long x, long long y, long long reach) noexcept
    @cython.locals(place=int, x='long long', y='long long', u='long long', v='long long', spread='long long',
                   away='long long', fall_u='long long', fall_v='long long')
    cdef int _code(self, int body, int at, int pixel) noexcept
    @cython.locals(spread='long long', away='long long', other='long long')
    cdef int _sure_top(self, int body, long long u, long long v) noexcept
    cdef int _top(self, int body, long long u, long long v) noexcept
    @cython.locals(scene=scene.Scene, first=int, end=int, sample=int, index=int, behind=int, near_ball=bint, paint=int,
                   ball=int, total='long long')
    cdef long long _samples(self, int pixel, int at) noexcept
    @cython.locals(rays=rays.Rays, place=int, a=int, c=int, cosine='long long', sine='long long', x='long long',
                   y='long long', u_a=int, v_a=int, u_b=int, v_b=int, u_c=int, v_c=int, u_d=int, v_d=int,
                   fall_u='long long', fall_v='long long', sample=int, q=int, u=int, v=int, step_u=int, step_v=int)
    cdef void _see(self, int body, int at, int pixel, int first, int end) noexcept
    @cython.locals(height='long long')
    cdef void _see_at(self, int body, int sample, long long u, long long v, long long fall_u, long long fall_v) noexcept
