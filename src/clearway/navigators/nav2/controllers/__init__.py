"""Nav2's controllers."""
