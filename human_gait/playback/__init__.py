"""A walk in the browser."""
