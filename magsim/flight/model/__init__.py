"""The aircraft as a flight model of JSBSim.

``aero``, ``balance``, ``propeller`` and ``engines`` compute it from the aircraft's facts; ``airframe``, ``autopilot``
and ``air_xml`` write it as XML. ``instance`` loads it, ``trim`` and ``start`` begin a flight, and ``plant`` steps it.
``setup`` and ``weather`` describe the start and the air, ``channels`` the logged quantities, ``rates`` integrators and
log rate.
"""
