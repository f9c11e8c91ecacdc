"""Starting points for materials. They are looks, not data sheets: what is said of each is what it does."""

# label, sentence, parameters of the body, parameters of the solver
PRESETS = {
    "STEEL": (
        "Steel",
        "Heavy and stiff; dents where it is hit and rebounds, tears at hard blows alone. A thousand times softer than steel, "
        "so that a dent can be seen",
        {"density": 7800, "youngs_modulus": 2e8, "poisson_ratio": 0.3, "yield": 0.002, "flow_rate": 2000, "hardening": 0.3,
         "toughness": 0.1,
         "fracture_energy": "auto"},
        {"substeps": 16},
    ),
    "SHEET_METAL": (
        "Sheet Metal",
        "For what is thin: panels, cans, roofs. Dents and creases where it is hit and stays so, tears where it is bent or stretched "
        "too far. A hundred times softer than steel",
        {"density": 7800, "youngs_modulus": 2e9, "poisson_ratio": 0.3, "yield": 0.002, "flow_rate": 2000, "hardening": 0.2,
         "toughness": 0.03,
         "fracture_energy": "auto"},
        {"substeps": 16},
    ),
    "STEEL_BEAM": (
        "Steel Beam",
        "For beams, rails, rods and frames: as stiff as steel. Bends to a hinge where it is loaded too much and stays so, tears "
        "after a fifth of its length",
        {"density": 7800, "youngs_modulus": 2e11, "poisson_ratio": 0.3, "yield": 0.002, "flow_rate": 2000, "hardening": 0.04,
         "toughness": 0.01,
         "fracture_energy": "auto"},
        {"substeps": 16},
    ),
    "LEAD": (
        "Lead",
        "Very heavy and limp; flattens where it lands and stays so, hardly ever tears. Hundreds of times softer than lead",
        {"density": 11300, "youngs_modulus": 2e7, "poisson_ratio": 0.4, "yield": 0.004, "flow_rate": 600,
         "hardening": 0.02, "toughness": 0.35,
         "fracture_energy": "auto"},
        {"substeps": 12},
    ),
    "CLAY": (
        "Clay",
        "Squashes, stays so and tears into lumps. Lumps do not stick together again",
        {"density": 1800, "youngs_modulus": 1e6, "poisson_ratio": 0.3, "yield": 0.01, "flow_rate": 300, "hardening": 0.1,
         "toughness": 0.035,
         "fracture_energy": "auto"},
        {"substeps": 12},
    ),
    "STONE": (
        "Stone",
        "Never dents; cracks run through it and leave chunks, with crumbs where it is hit. Concrete, rock, plaster. Hundreds of times "
        "softer than stone",
        {"density": 2400, "youngs_modulus": 1e8, "poisson_ratio": 0.2, "yield": None, "toughness": 0.005,
         "fracture_energy": "auto"},
        {"substeps": 16},
    ),
    "GLASS": (
        "Glass",
        "Never dents; shatters, the more the thinner it is. Hundreds of times softer than glass; cracks run between the "
        "pieces that were cut before",
        {"density": 2500, "youngs_modulus": 1e8, "yield": None, "toughness": 0.0018,
         "fracture_energy": "auto"},
        {"substeps": 16},
    ),
    "WOOD": (
        "Wood-like",
        "Light; gives a little, then splits off chunks. Has no grain: it breaks alike in all directions",
        {"density": 700, "youngs_modulus": 2e7, "yield": 0.012, "flow_rate": 100, "hardening": 2.0, "toughness": 0.008,
         "fracture_energy": "auto"},
        {"substeps": 12},
    ),
}


def items():
    return [(name, label, sentence) for name, (label, sentence, *_) in PRESETS.items()]
