"""The best that was possible: the fastest way of a disc through space and time among discs whose motion is known."""
