cimport cython
from miro_exact cimport dmath
from miro_sim.pitch cimport rays, scene, sensor
from miro_sim.pitch.rays cimport between

cdef int _SETS, _OUT, _UNSURE, _MIXED, _WIDTH, _HEIGHT, _CORNERS
cdef long long _HALF_UM, _TOP_UM, _CORNER_UM, _NEAR_UM, _MOST_MARGIN_UM

@cython.locals(most='long long')
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
    cdef int team_u, team_v, identity_u, identity_v, patch_um
    cdef bint moving
    cdef int still[10]
    cdef int sets, field_sets, side, black, near_count
    cdef int team_paint[10]
    cdef int identity_paint[10]
    cdef int near[10]
    cdef int code[60]
    cdef int x[60]
    cdef int y[60]
    cdef int cos[60]
    cdef int sin[60]
    cdef int spread_um[60]
    cdef int least_x[10]
    cdef int most_x[10]
    cdef int least_y[10]
    cdef int most_y[10]
    cdef int margin_um[10]
    cdef int seen[16]
    cdef int height_um[16]
    cdef int corner_u[40]
    cdef int corner_v[40]
    cdef int top_x[4]
    cdef int top_y[4]
    cdef int cornered
    cdef int fall_u[10]
    cdef int fall_v[10]
    cdef int seer[10]
    cdef int count

    @cython.locals(body=int, at=int, place=int, share=double, aside='long long', after_s=double, way_m=double, sine=double,
                   cosine=double)
    cpdef robot(self, int team, int identity, double x_m, double y_m, double theta_rad, double v_m_s=*, double w_rad_s=*)
    @cython.locals(first=int, end=int, row=int)
    cdef _draw(self, int left, int top, int width, int height, unsigned char[::1] out)
    @cython.locals(first=int, place=int, middle=int, drift='long long', x='long long', y='long long', turn='long long',
                   way_x='long long', way_y='long long', far='long long', margin='long long')
    cdef void _bound(self, int body) noexcept
    @cython.locals(pixel=int, body=int, reach='long long', x='long long', y='long long')
    cdef void _gather(self, int left, int top, int width, int height) noexcept
    @cython.locals(middle_x='int[::1]', middle_y='int[::1]', fall_x='int[::1]', fall_y='int[::1]', column=int, pixel=int,
                   index=int, x=int, y=int, end_x=int, end_y=int, total='long long')
    cdef void _draw_robots(self, int row, int first, int end) noexcept
    @cython.locals(seen=bint, index=int, body=int, margin=int, common=int, at=int, code=int, part='long long',
                   total='long long')
    cdef long long _total(self, int pixel, int x, int y, int end_x, int end_y) noexcept
    @cython.locals(samples=int, paint=int, index=int, code=int)
    cdef long long _instant(self, int pixel, int at) noexcept
    @cython.locals(least=int, most=int)
    cdef inline bint _passes(self, int body, int x, int y, int end_x, int end_y) noexcept
    @cython.locals(place=int, x='long long', y='long long', u='long long', v='long long', away='long long',
                   fall_u='long long', fall_v='long long')
    cdef int _code(self, int body, int at, int pixel, long long spread) noexcept
    @cython.locals(away='long long', other='long long')
    cdef int _sure_top(self, int body, long long u, long long v, long long spread) noexcept
    cdef int _top(self, int body, long long u, long long v) noexcept
    @cython.locals(scene=scene.Scene, first=int, end=int, sample=int, index=int, slot=int, behind=int, ball_seen=bint,
                   paint=int, ball=int, total='long long')
    cdef long long _samples(self, int pixel, int at) noexcept
    @cython.locals(place=int, cosine='long long', sine='long long', slot=int, corner=int, x='long long', y='long long')
    cdef void _turn(self, int body, int at, int pixel) noexcept
    @cython.locals(first=int, corner=int, ray=int)
    cdef void _find_corners(self, int pixel) noexcept
    @cython.locals(body=int, fall_u='long long', fall_v='long long', top='long long', side='long long', team='long long',
                   identity='long long', total='long long', row=int, q=int, u=int, v=int, step_u=int, step_v=int,
                   at_u=int, at_v=int, _=int, least_u=int, most_u=int, least_v=int, most_v=int,
                   most='long long', team_u=int, team_v=int, identity_u=int, identity_v=int, patch=int)
    cdef long long _alone(self, long long behind, int first, int end) noexcept
    @cython.locals(body=int, a=int, fall_u='long long', fall_v='long long', sample=int, u='long long', v='long long',
                   height='long long')
    cdef void _see(self, int slot, int first, int end) noexcept
