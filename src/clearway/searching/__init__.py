"""What breaks a navigator: searches among the members of a scenario family, and how rare a break is."""
