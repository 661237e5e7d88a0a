"""Newton methods for nonlinear programs; nothing here knows of walking.

`interior_point.minimise` starts anywhere, `active_set.follow` from the solution of a program like
the one to be solved. Both take a `nonlinear_program`; `second_order` says what a function offers
them.
"""
