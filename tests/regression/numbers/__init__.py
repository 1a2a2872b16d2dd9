"""What the library says of the bundled scenes at poses that are not round: the cases of ``test_numbers``."""
