"""Newton methods for nonlinear programs; nothing here knows of walking."""
