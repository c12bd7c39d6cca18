"""The towed bird: rope and body under a carrier.

``chain`` describes rope and body, ``dynamics`` holds the compiled equations of motion, ``equilibrium`` finds the state
in which they begin, ``modes`` its stability, ``integration`` steps them through time to a ``motion``. ``hook`` is the
motion of the tow point, ``setup`` builds the chain of a scenario, ``coupled`` is a chain that pulls on a flight model,
and ``towing`` adds the bird to a flight.
"""
