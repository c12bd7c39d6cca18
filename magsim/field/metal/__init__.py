"""The metal of an aircraft: steel that is magnetized, and conductors in which eddy currents flow."""
