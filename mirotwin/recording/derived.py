"""Channels of a recording that follow from its other channels: they are for people, and nothing reads them back."""

import msgspec


class TheoryMessage(msgspec.Struct, frozen=True):
    """`theory`: terms of the paper's theory.

    f of equation (15) over the period that ends at `tick` (null where nothing was commanded), rho_c, the distance of
    the heading from across (equation 12, negative where the cosine is), and which assumptions hold (`report.theory`).
    """

    tick: int
    f1_m_s2: float | None
    f2_rad_s2: float | None
    rho_c_m: float
    across_rad: float
    holds_1: bool
    holds_2: bool
    holds_3: bool
