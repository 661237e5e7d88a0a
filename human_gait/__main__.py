"""``python -m human_gait`` is the command ``human-gait``."""

from human_gait.command import main

if __name__ == "__main__":
    main()
