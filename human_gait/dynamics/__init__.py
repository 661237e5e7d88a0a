"""What a motion takes: torques and their derivatives, by Pinocchio or by the recursion."""
