"""How `train_ppo.py` trains: what is learnt, where, and the optimisation."""
