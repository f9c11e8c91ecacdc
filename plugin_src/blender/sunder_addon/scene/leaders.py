"""What an object goes by: where a cycle begins, what is read at a frame is of no one frame."""


def _targets(constraints):
    for c in constraints:
        if not c.mute:
            yield c, getattr(c, "target", None)
            for named in getattr(c, "targets", ()):  # of an armature constraint
                yield c, named.target


def of_place(thing):
    """The objects by whose place an object has its own: its parent and what its constraints name."""
    return [o for o in (thing.parent, *(o for _, o in _targets(thing.constraints))) if o is not None]


def of_surface(thing):
    """The objects by whose mesh an object has its place or its own."""
    found = [getattr(m, name, None) for m in thing.modifiers if m.show_viewport or m.show_render
             for name in ("object", "target", "collection_object")]
    found += [o for c, o in _targets(thing.constraints) if c.type == "SHRINKWRAP" or getattr(c, "subtarget", "")]
    if thing.parent is not None and thing.parent_type.startswith("VERTEX"):
        found.append(thing.parent)
    return [o for o in found if o is not None and o.type == "MESH"]


def circle(thing):
    """Objects each of which has its place by the next one's, and the last by the first's, that an object goes by; or none."""
    way = []

    def beyond(one):
        if one in way:
            return way[way.index(one):]
        if one in seen:
            return []
        seen.append(one), way.append(one)
        found = next((c for o in of_place(one) if o is not one and (c := beyond(o))), [])
        way.pop()
        return found

    seen = []
    return beyond(thing)


def results_of(thing, tree):
    """Objects that show what a tree makes, by whose mesh an object has its place or its own mesh."""
    seen, rest = [thing], [thing]
    while rest:
        one = rest.pop()
        found = [o for o in (*of_place(one), *of_surface(one)) if o not in seen]
        seen += found
        rest += found
    return [o for one in seen for o in of_surface(one) if o.sunder.tree == tree]
