"""Starting points for materials. They are looks, not data sheets: what is said of each is what it does."""

# label, sentence, parameters of the body, parameters of the solver
PRESETS = {
    "STEEL": (
        "Steel",
        "Heavy; dents and folds, tears late. Softer than steel by a factor of 1000, so that a dent can be seen",
        {"density": 7800, "youngs_modulus": 2e8, "poisson_ratio": 0.3, "yield": 0.004, "flow_rate": 400, "hardening": 0.5,
         "toughness": 0.1},
        {"substeps": 16},
    ),
    "LEAD": (
        "Lead",
        "Very heavy and limp; flattens and stays flat, hardly ever tears. Softer than lead",
        {"density": 11300, "youngs_modulus": 2e7, "poisson_ratio": 0.4, "yield": 0.004, "flow_rate": 600,
         "hardening": 0.02, "toughness": 0.35},
        {"substeps": 12},
    ),
    "CLAY": (
        "Clay",
        "Squashes, sticks and tears into lumps, as damp clay does",
        {"density": 1800, "youngs_modulus": 1e6, "poisson_ratio": 0.3, "yield": 0.01, "flow_rate": 300, "hardening": 0.1,
         "toughness": 0.12},
        {"substeps": 12},
    ),
    "GLASS": (
        "Glass",
        "Never dents; shatters at once. Far softer than glass, and cracks run along the pieces that were cut before",
        {"density": 2500, "youngs_modulus": 1e8, "yield": None, "toughness": 0.01},
        {"substeps": 16},
    ),
    "WOOD": (
        "Wood-like",
        "Light and stiff; gives a little, then breaks into large chunks. Has no grain: it breaks alike in all directions",
        {"density": 700, "youngs_modulus": 2e7, "yield": 0.02, "flow_rate": 100, "hardening": 2.0, "toughness": 0.04},
        {"substeps": 12},
    ),
}


def items():
    return [(name, label, sentence) for name, (label, sentence, *_) in PRESETS.items()]
