"""Ground floor: shapes, distances, ray casting, grids, motion, search. Imports nothing of Clearway's."""
