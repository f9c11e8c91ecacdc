"""What a tree's bake is like, in a word and a sentence."""
from ..base import runtime
from . import cache, signature


class Status:
    """state: "baking", "none", "partial" or "complete"; is_stale: what it was baked from has changed since (None: not
    known now); text: a sentence; fraction: of a bake at work."""

    def __init__(self, state, text, is_stale=False, fraction=0.0):
        self.state, self.text, self.is_stale, self.fraction = state, text, is_stale, fraction


def status(tree, scene, compute=True):
    """`compute` False asks for no work, as when drawing: staleness may then be None."""
    job = runtime.jobs.get(tree.cache_id)
    if job is not None:
        return Status("baking", f"{100 * job.fraction:.0f}%: {job.text}", fraction=job.fraction)
    folder = cache.folder(tree)
    manifest = cache.manifest(folder)
    if manifest is None or not manifest.numbers:
        return Status("none", "not baked")
    found = (signature.signature if compute else signature.known)(tree, scene)
    note = cache.note(folder)
    is_stale = None if found is None else found != note.get("signature")
    first, last = manifest.numbers[0], manifest.numbers[-1]
    wanted = tree.frames(scene)[1]
    text = f"baked {first} to {last}"
    if last < wanted:
        text += f" of {wanted}"
    if note.get("taken_over") is not None:
        text += f" (to {note['taken_over']} as before the changes)"
    if is_stale:
        text = "out of date: " + text
    return Status("partial" if last < wanted else "complete", text, is_stale)
