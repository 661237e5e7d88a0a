"""The commands of ``human-gait`` by what they are about, and how each of them ends."""
