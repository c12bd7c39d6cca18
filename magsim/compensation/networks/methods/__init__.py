"""The networks as methods: settings, compensator and presets, a file for each family."""
