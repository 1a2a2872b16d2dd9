"""`python -m validation.cli` is the command ``ice``."""

from validation.cli.main import main

if __name__ == "__main__":
    main()
