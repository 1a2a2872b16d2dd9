"""What is to be measured, and on which features of the object."""
