"""How tough a body is from place to place; knows nothing of Blender."""
import numpy as np


GLUED = 4  # of what keeps a particle, in state files and `kept` of a state


def tearing_factors(of_fragment, edges, holds, of_edge, glued=None):
    """What a body's toughness is multiplied by for each of its particles, (n,): the particle's own factor times that of the
    weakest edge that holds at it. A plane through the strain may meet stronger edges alone: it may hold for longer.

    of_fragment (n,), edges (m, 2) particles, holds (m,) bool, of_edge (m,), infinite where glued for good; glued (n,) bool, what
    an activate node glues at the frame: no edge of it breaks.
    """
    if glued is not None and glued.any():
        of_edge = np.where(glued[edges].any(axis=1), np.inf, of_edge)
    weakest = np.full(len(of_fragment), np.inf)
    for end in (0, 1):
        np.minimum.at(weakest, edges[holds, end], of_edge[holds])
    return of_fragment * np.where(np.isin(np.arange(len(weakest)), edges[holds]), weakest, 1.0)
