"""How many move among each other: rules that turn what each body sees and wants into its next velocity.

Compiled kernels that know neither the world nor the navigators; both use them. A rule is given everything that can be
seen (`bodies.Bodies`, `walls.Walls`) and those that decide by it (`bodies.Wishes`), and answers with a velocity for each.
"""
