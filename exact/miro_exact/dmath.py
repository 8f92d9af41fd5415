# cython: cdivision=True
# No divisor below is ever zero.
"""Elementary functions from + - * / alone, so that every machine gives the same bits.

The method is that of fdlibm (Sun Microsystems 1993): reduce the argument by a split constant, evaluate a
polynomial on the small interval, carry the low part of the reduced argument. Coefficients are fdlibm's
published ones. Bit tricks are replaced by comparisons and by products with powers of two, which are exact (`ldexp`).
"""

import math

from miro_exact.domain import DomainError

PI = 3.141592653589793
ANGLE_LIMIT = 1.6e6  # rad; the split of pi/2 below is exact for fewer than 2**20 quadrants

_PI = 3.141592653589793  # the same two as C constants
_LIMIT = 1.6e6
_INV_PIO2 = 0.6366197723675814
_PIO2_1 = 1.5707963267341256  # first 33 bits of pi/2
_PIO2_1T = 6.077100506506192e-11  # pi/2 - _PIO2_1
_PIO2_2 = 6.077100506303966e-11  # next 33 bits
_PIO2_2T = 2.0222662487959506e-21
_PIO2_3 = 2.0222662487111665e-21  # next 33 bits
_PIO2_3T = 8.4784276603689e-32

_TWO_PI_1 = 6.2831853069365025  # 4 * _PIO2_1, 4 * _PIO2_2, 4 * _PIO2_2T
_TWO_PI_2 = 2.4308402025215864e-10
_TWO_PI_2T = 8.089064995183803e-21

_S1 = -1.66666666666666324348e-01
_S2 = 8.33333333332248946124e-03
_S3 = -1.98412698298579493134e-04
_S4 = 2.75573137070700676789e-06
_S5 = -2.50507602534068634195e-08
_S6 = 1.58969099521155010221e-10

_C1 = 4.16666666666666019037e-02
_C2 = -1.38888888888741095749e-03
_C3 = 2.48015872894767294178e-05
_C4 = -2.75573143513906633035e-07
_C5 = 2.08757232129817482790e-09
_C6 = -1.13596475577881948265e-11

_A0 = 3.33333333333329318027e-01
_A1 = -1.99999999998764832476e-01
_A2 = 1.42857142725034663711e-01
_A3 = -1.11111104054623557880e-01
_A4 = 9.09088713343650656196e-02
_A5 = -7.69187620504482999495e-02
_A6 = 6.66107313738753120669e-02
_A7 = -5.83357013379057348645e-02
_A8 = 4.97687799461593236017e-02
_A9 = -3.65315727442169155270e-02
_A10 = 1.62858201153657823623e-02
_PI_LO = 1.2246467991473531772e-16  # pi - PI

_LN2_HI = 6.93147180369123816490e-01  # 33 bits
_LN2_LO = 1.90821492927058770002e-10
_INV_LN2 = 1.44269504088896338700e00
_E1 = 1.66666666666666019037e-01
_E2 = -2.77777777770155933842e-03
_E3 = 6.61375632143793436117e-05
_E4 = -1.65339022054652515390e-06
_E5 = 4.13813679705723846039e-08
_EXP_MAX = 709.782712893384
_EXP_MIN = -745.1332191019411

_L1 = 6.666666666666735130e-01
_L2 = 3.999999999940941908e-01
_L3 = 2.857142874366239149e-01
_L4 = 2.222219843214978396e-01
_L5 = 1.818357216161805012e-01
_L6 = 1.531383769920937332e-01
_L7 = 1.479819860511658591e-01
_SQRT2 = 1.4142135623730951
_LARGEST = 1.7976931348623157e308


def sin(x: float) -> float:
    """Sine of x rad. ValueError unless |x| < ANGLE_LIMIT."""
    return sincos(x)[0]


def cos(x: float) -> float:
    """Cosine of x rad. ValueError unless |x| < ANGLE_LIMIT."""
    return sincos(x)[1]


def sincos(x: float) -> tuple[float, float]:
    """(sin x, cos x) of x rad for the price of one reduction. ValueError unless |x| < ANGLE_LIMIT."""
    if not (-_LIMIT < x < _LIMIT):
        raise DomainError(f"angle must be within +-{ANGLE_LIMIT} rad, got {x!r}")
    return sincos_within(x)


def sincos_within(x: float) -> tuple[float, float]:
    """`sincos` for a caller that has checked that |x| < ANGLE_LIMIT."""
    if x < 0.0:
        scaled = x * _INV_PIO2 - 0.5
    else:
        scaled = x * _INV_PIO2 + 0.5
    # int() cuts off towards zero: with the half before it, it rounds to the nearest quadrant.
    n = int(scaled)
    high = x
    low = 0.0
    if n != 0:
        count = float(n)
        # pi/2 in parts of 33 bits: their products with `count`, of 20, are exact (fdlibm, rem_pio2).
        rest = x - count * _PIO2_1
        carry = count * _PIO2_1T
        high = rest - carry
        if abs(high) < abs(x) * 3.0517578125e-05:  # 2**-15: cancellation, take the next 33 bits of pi/2
            before = rest
            carry = count * _PIO2_2
            rest = before - carry
            carry = count * _PIO2_2T - ((before - rest) - carry)
            high = rest - carry
            if abs(high) < abs(x) * 3.552713678800501e-15:  # 2**-48: and the last
                before = rest
                carry = count * _PIO2_3
                rest = before - carry
                carry = count * _PIO2_3T - ((before - rest) - carry)
                high = rest - carry
        # What the rounding of `high` lost; it enters both polynomials below to the first order.
        low = (rest - high) - carry
    z = high * high
    w = z * z
    # sine of high + low
    v = z * high
    r = _S2 + z * (_S3 + z * _S4) + z * w * (_S5 + z * _S6)
    s = high - ((z * (0.5 * low - v * r) - low) - v * _S1)
    # cosine of high + low
    r = z * (_C1 + z * (_C2 + z * _C3)) + w * w * (_C4 + z * (_C5 + z * _C6))
    half = 0.5 * z
    top = 1.0 - half
    # 1 - z/2 loses bits where z is large: they are added back (fdlibm, k_cos).
    c = top + (((1.0 - top) - half) + (z * r - high * low))
    quadrant = n & 3
    if quadrant == 0:
        return (s, c)
    if quadrant == 1:
        return (c, -s)
    if quadrant == 2:
        return (-s, -c)
    return (-c, s)


def atan(x: float) -> float:
    """Arc tangent in rad, -pi/2..pi/2. ValueError for NaN (infinities are fine)."""
    if x != x:
        raise DomainError("atan of NaN")
    if x < 0.0:
        return -_atan(-x, 0.0, False)
    return _atan(x, 0.0, False) if x > 0.0 else x


def _atan(a: float, more: float, supplement: bool) -> float:
    """Arc tangent of a >= 0 plus `more` (far below its last place), or pi minus that: rounded once at the end."""
    # atan(a) = atan(c) + atan((a - c) / (1 + a c)) with c = 0, 1/2, 1, 3/2, infinity: what is left is small (fdlibm).
    if a < 0.4375:
        high = 0.0
        low = 0.0
        if a < 7.450580596923828e-09 and not supplement:  # 2**-27: a - a**3/3 rounds to a
            return a
    elif a < 0.6875:
        high = 4.63647609000806093515e-01  # atan(1/2)
        low = 2.26987774529616870924e-17
        a = (2.0 * a - 1.0) / (2.0 + a)
    elif a < 1.1875:
        high = 7.85398163397448278999e-01  # atan(1)
        low = 3.06161699786838301793e-17
        a = (a - 1.0) / (a + 1.0)
    elif a < 2.4375:
        high = 9.82793723247329054082e-01  # atan(3/2)
        low = 1.39033110312309984516e-17
        a = (a - 1.5) / (1.0 + 1.5 * a)
    else:
        high = 1.57079632679489655800e00  # atan(infinity)
        low = 6.12323399573676603587e-17
        a = -1.0 / a
    z = a * a
    w = z * z
    # Odd and even powers apart, as fdlibm adds them up: the order is part of the bits.
    odd = z * (_A0 + w * (_A2 + w * (_A4 + w * (_A6 + w * (_A8 + w * _A10)))))
    even = w * (_A1 + w * (_A3 + w * (_A5 + w * (_A7 + w * _A9))))
    low = low + more
    if supplement:
        rest = _PI - high
        low = (((_PI - rest) - high) + _PI_LO) - low
        high = rest
        a = -a
    return high - ((a * (odd + even) - low) - a)


def _lost(q: float, y: float, x: float) -> float:
    """Rounding error of the quotient q = y / x of positive numbers: y / x - q (Dekker's exact product)."""
    if not (1e-140 < y < 1e140 and 1e-140 < x < 1e140 and q > 1e-140):
        return 0.0  # the split below would leave the range of float64
    # Halves of 26 bits (Veltkamp): the four products of halves are exact, and so is their sum in this order.
    spread = q * 134217729.0  # 2**27 + 1
    q_high = spread - (spread - q)
    q_low = q - q_high
    spread = x * 134217729.0
    x_high = spread - (spread - x)
    x_low = x - x_high
    product = q * x
    error = ((q_high * x_high - product) + q_high * x_low + q_low * x_high) + q_low * x_low
    return ((y - product) - error) / x


def atan2(y: float, x: float) -> float:
    """Angle of the point (x, y) in rad, -pi..pi; signed zeros as in IEEE 754. ValueError unless finite."""
    if not (-_LARGEST <= x <= _LARGEST) or not (-_LARGEST <= y <= _LARGEST):
        raise DomainError(f"atan2 needs finite numbers, got {y!r}, {x!r}")
    if y == 0.0:
        if x > 0.0 or (x == 0.0 and math.copysign(1.0, x) > 0.0):
            return y
        return math.copysign(_PI, y)
    if x == 0.0:
        angle = 0.5 * _PI
    else:
        ratio = abs(y / x)
        more = _lost(ratio, abs(y), abs(x)) / (1.0 + ratio * ratio)
        angle = _atan(ratio, more, x < 0.0)
    if y < 0.0:
        return -angle
    return angle


def wrap_pi(x: float) -> float:
    """The angle x rad brought into (-pi, pi]; unchanged where it is there already. ValueError as for sin."""
    if not (-_LIMIT < x < _LIMIT):
        raise DomainError(f"angle must be within +-{ANGLE_LIMIT} rad, got {x!r}")
    if -_PI < x <= _PI:
        return x
    if x == -_PI:
        return _PI
    scaled = x / (2.0 * _PI)
    if x < 0.0:
        turns = float(int(scaled - 0.5))
    else:
        turns = float(int(scaled + 0.5))
    # 2 pi in three parts, as in `sincos_within`.
    result = ((x - turns * _TWO_PI_1) - turns * _TWO_PI_2) - turns * _TWO_PI_2T
    if result <= -_PI:
        # Rounding may leave the result a last place outside of the range, on either side.
        return min(result + 2.0 * _PI, _PI)
    if result > _PI:
        return max(result - 2.0 * _PI, -3.1415926535897927)  # the number after -pi
    return result


def exp(x: float) -> float:
    """e to the power x. OverflowError above 709.78, ValueError for NaN, 0.0 below -745.13."""
    if x != x:
        raise DomainError("exp of NaN")
    if x > _EXP_MAX:
        raise DomainError(f"exp({x!r}) is beyond float64")
    return exp_within(x)


def exp_within(x: float) -> float:
    """`exp` for a caller that has checked that x is a number up to 709."""
    if x < _EXP_MIN:
        return 0.0
    if -0.34657359027997264 < x < 0.34657359027997264:  # ln 2 / 2
        k = 0
    elif x < 0.0:
        k = int(x * _INV_LN2 - 0.5)
    else:
        k = int(x * _INV_LN2 + 0.5)
    # ln 2 in two parts, the first of 33 bits: its product with k is exact (fdlibm, e_exp).
    high = x - float(k) * _LN2_HI
    low = float(k) * _LN2_LO
    r = high - low
    t = r * r
    c = r - t * (_E1 + t * (_E2 + t * (_E3 + t * (_E4 + t * _E5))))
    return _scaled(1.0 - ((low - (r * c) / (2.0 - c)) - high), k)


def _scaled(y: float, k: int) -> float:
    """y * 2**k for y near 1, rounded once: only the last product can be subnormal."""
    if k < -960:
        return y * math.ldexp(1.0, k + 960) * 1.0261342003245941e-289  # 2**-960
    if k > 960:
        return y * math.ldexp(1.0, k - 960) * 9.7453140114e288  # 2**960
    return y * math.ldexp(1.0, k)


def log(x: float) -> float:
    """Natural logarithm. ValueError unless x is finite and positive."""
    if not (0.0 < x <= _LARGEST):
        raise DomainError(f"log needs a finite positive number, got {x!r}")
    return log_within(x)


def log_within(x: float) -> float:
    """`log` for a caller that has checked that x is finite and positive."""
    k = 0
    # Products with 2 and 1/2 are exact: this is frexp without a look at the bits.
    while x < 0.5 * _SQRT2:
        x = x * 2.0
        k -= 1
    while x >= _SQRT2:
        x = x * 0.5
        k += 1
    f = x - 1.0
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    even = w * (_L2 + w * (_L4 + w * _L6))
    odd = z * (_L1 + w * (_L3 + w * (_L5 + w * _L7)))
    half = 0.5 * f * f
    powers = float(k)
    return powers * _LN2_HI - ((half - (s * (half + (odd + even)) + powers * _LN2_LO)) - f)
