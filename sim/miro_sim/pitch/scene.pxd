cimport cython
from miro_sim.pitch cimport rays, sensor

cdef int _MIXED, _UNKNOWN, _CORNERS, _WIDTH, _PAD
cdef long long _WALL_HEIGHT_UM, _WALL_UM, _GOAL_HALF_UM, _GOAL_DEPTH_UM, _CORNER_UM, _LINE_HALF_UM
cdef long long _CIRCLE_UM, _AREA_HALF_UM, _AREA_DEPTH_UM, _BALL_UM

@cython.locals(values='short[16]', lane='long long')
cdef void _copy(short[::1] kept, long long pixel, short* line, long long column, long long count) noexcept


@cython.final
cdef class Scene:
    cdef readonly rays.Rays rays
    cdef long long packed[18]
    cdef unsigned char[::1] paint
    cdef long long[::1] total
    cdef int[::1] lit, lit_first, lit_end
    cdef short[::1] light, y, cb, cr
    cdef long long middle_x, middle_y, half_x, half_y, ball_x, ball_y, falloff
    cdef int floor, line, wall_top, wall_face, outside, ball_rim
    cdef readonly bint has_ball
    cdef long long slope_x[16]
    cdef long long slope_y[16]

    cdef inline bint _near_ball(self, int pixel) noexcept
    @cython.locals(paint=int)
    cdef bint shows_ball(self, int pixel) noexcept
    cdef void show(self, sensor.Sensor sensor, int row, int first, int end, int instants) noexcept
    cdef void _light_up(self, sensor.Sensor sensor, int row, int first, int end, int instants) noexcept
    cdef inline int behind(self, int pixel) noexcept
    cdef void look(self, int pixel) noexcept
    @cython.locals(x='long long', y='long long', right_x='long long', right_y='long long')
    cdef void spread(self, int pixel) noexcept
    cdef inline int sample(self, int sample) noexcept
    cdef int ball_above(self, int sample, long long above) noexcept
    cdef inline int _paint_of(self, long long slope_x, long long slope_y) noexcept
    cdef int _sure(self, int pixel) noexcept
    cdef inline bint _inside(self, long long x, long long y, long long more) noexcept
    cdef inline bint _on_line(self, long long x, long long y, long long more) noexcept
