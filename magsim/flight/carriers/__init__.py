"""The ways to fly a carrier: by its flight model, along its path without one, as a logged track."""
