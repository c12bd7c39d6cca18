"""Sources that are small beside their distance, what steel remembers, and mounts that bend."""
