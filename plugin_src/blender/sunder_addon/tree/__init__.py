"""The node tree: its nodes, sockets and parameters, what is wired to what, which objects play it."""
