"""Physical and geometric constants, and conversion factors."""

MU0 = 1.25663706127e-6
"""Vacuum permeability [H/m], CODATA 2022."""

NT_PER_T = 1e9
"""Nanotesla in one tesla."""

G0 = 9.80665
"""Standard acceleration of free fall [m/s^2]."""

FT = 0.3048
"""Foot [m]."""

INCH = 0.0254
"""Inch [m]."""

LBF = 4.4482216152605
"""Pound-force [N]."""

LB = 0.45359237
"""Pound [kg]."""

SLUG_FT2 = 1.3558179483314004
"""Slug foot squared [kg m^2]."""

SLUG_FT3 = 515.378818393
"""Slug in a cubic foot [kg/m^3]."""

HP = 745.69987158227022
"""Mechanical horsepower [W]."""

RHO0 = 1.225
"""Density of the ICAO standard atmosphere at sea level [kg/m^3]."""
