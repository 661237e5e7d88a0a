"""One stride as files for other programs."""
