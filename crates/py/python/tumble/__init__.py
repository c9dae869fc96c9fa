"""Real-time dynamics for interactive and immersive environments."""

from tumble._native import __version__

__all__ = ["__version__"]
