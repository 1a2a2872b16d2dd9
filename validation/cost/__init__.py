"""What accuracy costs in time: each parameter measured, a model of errors and seconds, and runs that ask for either."""
