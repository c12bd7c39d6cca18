"""The benchmark on known truth: levels of difficulty, sets of flights, tracks, and the board of all methods."""
