"""The person who walks: degrees of freedom, measures, links, as DH table, URDF and model."""
