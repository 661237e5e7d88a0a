"""What a result folder holds, and how it appears whole or not at all."""
