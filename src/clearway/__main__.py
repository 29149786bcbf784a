"""`python -m clearway`, for a debugger that wants a module to run."""

from clearway.cli import main

if __name__ == "__main__":
    main()
