"""What is certified before each step: a tube around the plan, a way to rest from it, and what the assumptions were worth."""
