"""The path over ground.

``patterns`` draws it from ``elements`` in a ``plane``, ``dubins`` connects them, ``heights`` plans heights, ``wind``
is the wind triangle.
"""
