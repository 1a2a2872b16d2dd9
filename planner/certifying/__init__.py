"""Lower bounds of what a plan minimises for all poses of a cell, and the certificate that they give a plan."""
