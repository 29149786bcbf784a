"""Behaviour trees as Nav2 has them: read from XML, ticked by BehaviorTree.CPP 4's rules, our own small interpreter."""
