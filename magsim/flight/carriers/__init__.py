"""The ways to fly a carrier.

``modeled`` flies its flight model, ``kinematic`` follows the path without one, ``logged`` is a recorded track.
``planning`` makes the plan of a flight, ``outcome`` compares the flight with it.
"""
