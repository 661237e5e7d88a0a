"""A walk as still pictures."""
