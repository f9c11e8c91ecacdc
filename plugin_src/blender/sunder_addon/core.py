"""What scripts reach of the library: `sunder_addon.core.sunder()` is Sunder's Python package (docs/blender.md)."""
from .base.core import Refused, Unusable, problem, sunder  # noqa: F401
