"""`python -m workbench`, the same as `holdfast`."""

from workbench.terminal.cli import main

__all__: list[str] = []

if __name__ == "__main__":
    main()
