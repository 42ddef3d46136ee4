"""``python -m tdacoustic``."""

from tdacoustic.cli import main

if __name__ == "__main__":
    main()
