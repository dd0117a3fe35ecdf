"""``python -m strapdown``."""

from strapdown.cli.main import run

if __name__ == "__main__":
    run()
