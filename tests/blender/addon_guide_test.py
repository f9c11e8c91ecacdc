"""The script of the user guide runs as it stands there, and its table of presets is the add-on's."""
import contextlib
import io
import re
from pathlib import Path

import bpy

from addon_case import AddonCase, addon, main

GUIDE = (Path(__file__).resolve().parents[2] / "docs/blender.md").read_text(encoding="utf-8")


class Guide(AddonCase):
    def test_the_script_runs(self):
        script, = re.findall("```python\n(.*?)```", GUIDE, re.DOTALL)
        told = io.StringIO()
        with contextlib.redirect_stdout(told):
            exec(compile(script, "docs/blender.md", "exec"), {})
        self.assertRegex(told.getvalue(), r"\d+ faces; \[\('Deformer', 'baked 1 to 24'\)\]")

    def test_presets_are_described_as_they_are(self):
        for label, sentence, *_ in addon("interface.presets").PRESETS.values():
            self.assertIn(f"| {label} | {sentence} |", GUIDE)
        _, _, clay, _ = addon("interface.presets").PRESETS["CLAY"]
        told = re.findall(r"Raise \*Toughness\* in the body node from ([\d.]+) to ([\d.]+)", GUIDE)
        self.assertEqual([float(low) for low, _ in told], [clay["toughness"]])

    def test_operators_and_attributes_are_there(self):
        for name in re.findall(r"`sunder\.(\w+)\(", GUIDE):
            self.assertTrue(hasattr(bpy.types, "SUNDER_OT_" + name), name)
        tree, nodes = self.tree()
        nodes["solver"].set_parameters(accelerations=True)
        result, = self.results(tree)
        self.bake(tree)
        self.scene.frame_set(2)
        listed = re.findall(r"^\| `(\w+)` \| (faces|points) \|", GUIDE, re.MULTILINE)
        self.assertEqual(len(listed), 10)
        for name, domain in listed:
            self.assertEqual(result.data.attributes[name].domain, {"faces": "FACE", "points": "POINT"}[domain])


if __name__ == "__main__":
    main()
