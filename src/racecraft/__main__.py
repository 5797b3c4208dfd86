"""`python -m racecraft`: the command line."""

from racecraft.cli.entry import main

if __name__ == "__main__":
    main()
