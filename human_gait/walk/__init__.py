"""Steps on the ground: contacts, reaction of the ground, the motion of a step as a value."""
