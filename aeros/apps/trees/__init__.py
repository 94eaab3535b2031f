"""Behaviour trees of other tools: BehaviorTree.CPP's XML to compositions, and compositions to that XML."""
