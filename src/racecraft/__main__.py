"""`python -m racecraft`: the command line."""

from racecraft.cli.app import main

if __name__ == "__main__":
    main()
