"""The search for the best mesh: the goal, the moves, what is known of them, and the loop.

Which move is next is decided by the plugins of kind `policy`, by what those of kind `estimate`
expect.
"""
