"""The towed bird: rope, body, and how they swing under a carrier.

``line`` holds what hangs, ``chain`` the compiled equations of motion, ``steady`` the equilibrium they begin in,
``swing`` the flight through time; ``hook`` is the motion of the tow point, ``setup`` what a scenario makes of it,
``coupled`` a line that pulls on a flight model, and ``towing`` adds the bird to a flight.
"""
