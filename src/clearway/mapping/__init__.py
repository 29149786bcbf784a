"""The mapping phase: a robot is driven through a floor plan on a tour and builds the map that it will navigate on."""

from clearway.mapping.phase import MappingResult, build_map

__all__ = ["MappingResult", "build_map"]
