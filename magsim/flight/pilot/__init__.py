"""The pilot flies the model along its path.

``guidance`` steers, ``trains`` schedules maneuvers, ``flaps`` and ``gusts`` act at given times, ``monitor`` ends a
flight that goes wrong, ``log`` keeps its rows. ``calibration`` and ``combined`` find the ``response`` of the loops from
flights in still air, by ``measure``.
"""
