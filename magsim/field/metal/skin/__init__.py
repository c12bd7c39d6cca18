"""Conducting skins: the mesh of an aircraft, thin shells with their eddy currents, and the skin of one aircraft."""
