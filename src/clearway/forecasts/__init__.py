"""Where perceived obstacles will be: tracked, forecast by several models of motion at once, and bounded."""
