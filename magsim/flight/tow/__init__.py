"""The towed bird: rope, body, and how they swing."""
